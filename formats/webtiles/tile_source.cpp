/// Elevations packed into the tiles of a web map, all of one zoom level as one raster.

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/io/block_cache.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "formats/webtiles/tile_store.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Decoded tiles that are kept, where a row of them takes no more.
constexpr std::uint64_t kMostKeptBytes = std::uint64_t{256} << 20U;
/// Larger ones are no tiles.
constexpr std::int64_t kMostSide = 8192;
constexpr std::size_t kChannels = 4;

/// A tile's pixels: red, green, blue and opacity.
struct Pixels {
  std::int64_t side = 0;
  std::vector<std::byte> bytes;
};

class TileSource final : public HeightSource {
 public:
  TileSource(const std::string& path, const char* format, std::unique_ptr<TileStore> store, const OpenOptions& options)
      : store_(std::move(store)) {
    info_.path = path;
    info_.format = format;
    choose_zoom(options.part);
    side_ = pixels_of(box_.any).side;
    if (!std::has_single_bit(static_cast<std::uint64_t>(side_))) {
      fail(
          ErrorCode::kUnsupported,
          fmt::format("has tiles of {0} x {0} samples, no power of two, as where they have a rim of their neighbours'; "
                      "gdal_translate makes a GeoTIFF of it",
                      side_));
    }
    info_.width = (box_.last_column - box_.first_column + 1) * side_;
    info_.height = (box_.last_row - box_.first_row + 1) * side_;
    info_.block_width = info_.block_height = side_;
    packing_ = choose_packing(options.channel);
    describe_packing(packing_, kChannels, 8, info_);
    place_web_tiles(zoom_, box_.first_column, box_.first_row, side_, info_);
    gap_ = stored_sample(info_.sample_type,
                         info_.void_values.empty() ? std::numeric_limits<double>::quiet_NaN() : info_.void_values[0]);
    tile_bytes_ = static_cast<std::size_t>(side_ * side_) * size_bytes(info_.sample_type);
    limit_buffers(kMostKeptBytes);
    apply_open_options(info_, options);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    const std::int64_t last_column = (window.column + window.columns - 1) / side_;
    const std::int64_t last_row = (window.row + window.rows - 1) / side_;
    const auto at_once = static_cast<std::int64_t>(cache_->capacity());
    for (std::int64_t row = window.row / side_; row <= last_row; ++row) {
      for (std::int64_t from = window.column / side_; from <= last_column; from += at_once) {
        const std::int64_t end = std::min(from + at_once, last_column + 1);
        const std::vector<const std::byte*> tiles = tiles_of(row, from, end);
        for (std::int64_t column = from; column < end; ++column)
          copy(tiles[static_cast<std::size_t>(column - from)], column, row, window, samples);
      }
    }
  }

  void limit_buffers(std::uint64_t bytes) override {
    cache_.emplace(tile_bytes_, static_cast<std::size_t>(buffer_bytes(bytes) / tile_bytes_));
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    const auto across = static_cast<std::uint64_t>(info_.width / side_);
    return std::clamp<std::uint64_t>(std::min(limit, kMostKeptBytes) / tile_bytes_, 1, across) * tile_bytes_;
  }

 private:
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, info_.path + ": " + what); }

  void choose_zoom(const std::string& part) {
    const auto [coarsest, finest] = store_->zooms();
    zoom_ = finest;
    if (!part.empty()) {
      const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), zoom_);
      if (error != std::errc{} || end != part.data() + part.size()) zoom_ = -1;
    } else if (coarsest < finest) {
      info_.warnings.push_back(
          fmt::format("has zoom levels {} to {}; {} is read, `part` takes another", coarsest, finest, finest));
    }
    const auto found = zoom_ < coarsest || zoom_ > finest ? std::nullopt : store_->box(zoom_);
    if (!found) {
      fail(ErrorCode::kInvalidArgument,
           fmt::format("has no zoom level \"{}\"; there are {} to {}", printable(part), coarsest, finest));
    }
    box_ = *found;
  }

  [[nodiscard]] Packing choose_packing(const std::string& channel) {
    if (!channel.empty()) {
      if (const auto packing = packing_from_string(channel)) return *packing;
      fail(ErrorCode::kInvalidArgument, "has no channels but packed elevations; `encoding` says how they are packed");
    }
    if (const auto packing = packing_from_string(store_->encoding())) return *packing;
    // Tiles from all over: of the sea alone nothing shows.
    constexpr std::int64_t kEachWay = 5;
    PackingEvidence evidence(kChannels);
    const auto add = [&](const TilePlace& place) {
      std::vector<std::byte> stored;
      if (!store_->read(place, stored)) return;
      const Pixels pixels = decoded(place, stored);
      const std::size_t row_bytes = static_cast<std::size_t>(pixels.side) * kChannels;
      for (std::size_t at = 0; at < pixels.bytes.size(); at += row_bytes) {
        evidence.add(std::span(pixels.bytes).subspan(at, row_bytes));
      }
    };
    add(box_.any);
    for (std::int64_t i = 0; i < kEachWay * kEachWay; ++i) {
      const auto between = [](std::int64_t first, std::int64_t last, std::int64_t k) {
        return first + (last - first + 1) * (2 * k + 1) / (2 * kEachWay);
      };
      add({zoom_, between(box_.first_column, box_.last_column, i % kEachWay),
           between(box_.first_row, box_.last_row, i / kEachWay)});
    }
    const auto packing = evidence.packing();
    if (!packing) {
      fail(ErrorCode::kUnsupported,
           "nothing shows whether its colours are packed elevations, and how; `encoding` terrarium, mapbox or "
           "rgba-float "
           "says it");
    }
    info_.warnings.push_back(
        fmt::format("its colours are packed elevations, as their bytes show: decoded as with `encoding` {0}; give "
                    "`encoding` {0} to "
                    "say so",
                    to_string(*packing)));
    return *packing;
  }

  static std::string name_of(const TilePlace& place) {
    return fmt::format("tile {}/{}/{}", place.zoom, place.column, place.row);
  }

  [[nodiscard]] Pixels pixels_of(const TilePlace& place) const {
    std::vector<std::byte> stored;
    if (!store_->read(place, stored)) fail(ErrorCode::kCorrupt, name_of(place) + " is listed, but not there");
    return decoded(place, stored);
  }

  [[nodiscard]] Pixels decoded(const TilePlace& place, const std::vector<std::byte>& stored) const {
    const std::string where = name_of(place);
    PngDecoder png;
    WebpDecoder webp;
    PictureDecoder* const decoder = looks_like_png(stored)    ? static_cast<PictureDecoder*>(&png)
                                    : looks_like_webp(stored) ? static_cast<PictureDecoder*>(&webp)
                                                              : nullptr;
    if (decoder == nullptr) {
      constexpr std::array<std::byte, 2> kJpeg = {std::byte{0xFF}, std::byte{0xD8}};
      constexpr std::array<std::byte, 2> kGzip = {std::byte{0x1F}, std::byte{0x8B}};
      const auto begins = [&](const auto& head) {
        return stored.size() >= head.size() && std::equal(head.begin(), head.end(), stored.begin());
      };
      const char* const what = begins(kJpeg)   ? "a JPEG picture, which does not keep the bytes of elevations"
                               : begins(kGzip) ? "no picture, but packed outlines, as of a map of vectors"
                                               : "no PNG or WebP picture";
      fail(ErrorCode::kUnsupported, fmt::format("{} is {}", where, what));
    }
    PngHeader header;
    const auto check = [&](bool holds) {
      if (!holds) fail(ErrorCode::kCorrupt, fmt::format("{}: {}", where, decoder->message()));
    };
    check(decoder->open(stored, header));
    if (header.width != header.height || header.width > kMostSide || (side_ != 0 && header.width != side_)) {
      fail(ErrorCode::kUnsupported,
           fmt::format("{} has {} x {} samples, must have {}", where, header.width, header.height,
                       side_ == 0 ? "as many rows as columns" : fmt::format("{} each way", side_)));
    }
    if (header.is_lossy) {
      fail(ErrorCode::kUnsupported, where + " is lossy WebP, which does not keep the bytes of elevations");
    }
    check(decoder->start(header, PictureDecoder::For::kPicture));
    if (header.bit_depth != 8) {
      fail(ErrorCode::kUnsupported, fmt::format("{} has channels of {} bits, must have 8", where, header.bit_depth));
    }
    std::vector<std::byte> picture(header.row_bytes * header.height);
    check(decoder->read_picture(picture, header) && decoder->finish());
    return {header.width, with_opacity(std::move(picture), header.channels.size())};
  }

  /// Pixels of 1 to 4 channels as those of four: grey is red, green and blue alike.
  static std::vector<std::byte> with_opacity(std::vector<std::byte> picture, std::size_t channels) {
    if (channels == kChannels) return picture;
    std::vector<std::byte> all;
    all.reserve(picture.size() / channels * kChannels);
    for (std::size_t at = 0; at + channels <= picture.size(); at += channels) {
      const bool is_grey = channels < 3;
      for (std::size_t c = 0; c < 3; ++c) all.push_back(picture[at + (is_grey ? 0 : c)]);
      all.push_back(channels == 2 ? picture[at + 1] : std::byte{0xFF});
    }
    return all;
  }

  /// Tiles of a row, decoded side by side where they are not held; as many as the cache takes.
  [[nodiscard]] std::vector<const std::byte*> tiles_of(std::int64_t row, std::int64_t first, std::int64_t end) {
    struct Wanted {
      TilePlace place;
      std::byte* out;
      std::exception_ptr failure;
    };
    const std::int64_t across = info_.width / side_;
    std::vector<const std::byte*> tiles;
    std::vector<Wanted> wanted;
    // Those that are held first: claiming makes room of what was not asked for lately.
    for (std::int64_t column = first; column < end; ++column)
      tiles.push_back(cache_->find(static_cast<std::uint64_t>(row * across + column)));
    for (std::int64_t column = first; column < end; ++column) {
      const std::byte*& tile = tiles[static_cast<std::size_t>(column - first)];
      if (tile != nullptr) continue;
      std::byte* const room = cache_->claim(static_cast<std::uint64_t>(row * across + column));
      wanted.push_back({{zoom_, box_.first_column + column, box_.first_row + row}, room, nullptr});
      tile = room;
    }
    oneapi::tbb::this_task_arena::isolate([&] {
      oneapi::tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
        try {
          decode(wanted[i].place, {wanted[i].out, tile_bytes_});
        } catch (...) {
          wanted[i].failure = std::current_exception();
        }
      });
    });
    for (const Wanted& each : wanted) {
      if (!each.failure) continue;
      cache_->clear();
      std::rethrow_exception(each.failure);
    }
    return tiles;
  }

  void decode(const TilePlace& place, std::span<std::byte> samples) const {
    std::vector<std::byte> stored;
    if (store_->read(place, stored)) {
      return unpack_elevations(packing_, kChannels, decoded(place, stored).bytes, samples);
    }
    for (std::size_t at = 0; at < samples.size(); at += gap_.size())
      std::memcpy(samples.data() + at, gap_.data(), gap_.size());
  }

  /// What of a tile lies in the window.
  void copy(const std::byte* tile, std::int64_t column, std::int64_t row, const Window& window,
            std::span<std::byte> samples) const {
    const auto bytes = static_cast<std::int64_t>(size_bytes(info_.sample_type));
    const std::int64_t west = std::max(column * side_, window.column);
    const std::int64_t east = std::min((column + 1) * side_, window.column + window.columns);
    const std::int64_t north = std::max(row * side_, window.row);
    const std::int64_t south = std::min((row + 1) * side_, window.row + window.rows);
    for (std::int64_t y = north; y < south; ++y) {
      std::memcpy(samples.data() + ((y - window.row) * window.columns + west - window.column) * bytes,
                  tile + ((y - row * side_) * side_ + west - column * side_) * bytes,
                  static_cast<std::size_t>((east - west) * bytes));
    }
  }

  std::unique_ptr<TileStore> store_;
  SourceInfo info_;
  int zoom_ = 0;
  TileStore::Box box_;
  std::int64_t side_ = 0;  ///< samples of a tile each way
  Packing packing_ = Packing::kTerrarium;
  std::vector<std::byte> gap_;  ///< a sample where there is no tile
  std::size_t tile_bytes_ = 1;
  std::optional<BlockCache> cache_;
};

}  // namespace

std::string encoding_in_json(const std::string& text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("encoding") || !json["encoding"].is_string()) return {};
  return json["encoding"].get<std::string>();
}

std::unique_ptr<HeightSource> open_pmtiles(const std::string& path, const OpenOptions& options) {
  return std::make_unique<TileSource>(path, "PMTiles", open_pmtiles_store(path), options);
}

}  // namespace isohf
