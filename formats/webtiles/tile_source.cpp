/// Elevations packed into the tiles of a web map, all of one zoom level as one raster.

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/io/block_cache.h"
#include "formats/io/file_source.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "formats/webtiles/pmtiles.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Larger ones are no tiles.
constexpr std::int64_t kMostSide = 8192;

class TileSource final : public HeightSource {
 public:
  TileSource(const std::string& path, const OpenOptions& options) : file_(path) {
    info_.path = path;
    info_.format = "PMTiles";
    choose_zoom(options.part);
    packing_ = choose_packing(options);
    side_ = pixels_of(box_.any).side;
    if (!std::has_single_bit(static_cast<std::uint64_t>(side_))) {
      fail(ErrorCode::kUnsupported,
           fmt::format("has tiles of {0} x {0} samples, not a power of two, as if they had a rim of their neighbours'; "
                       "gdal_translate makes a GeoTIFF of it",
                       side_));
    }
    info_.width = (box_.last_column - box_.first_column + 1) * side_;
    info_.height = (box_.last_row - box_.first_row + 1) * side_;
    info_.block_width = info_.block_height = side_;
    constexpr std::size_t kWithOpacity = 4;  // some tile may have it
    describe_packing(packing_, kWithOpacity, 8, options, info_);
    place_web_tiles(zoom_, box_.first_column, box_.first_row, side_, info_);
    gap_ = stored_sample(info_.sample_type, info_.void_values.empty() ? std::numeric_limits<double>::quiet_NaN()
                                                                      : info_.void_values.front());
    tile_bytes_ = static_cast<std::size_t>(side_ * side_) * size_bytes(info_.sample_type);
    const auto across = static_cast<std::uint64_t>(info_.width / side_);
    cache_.emplace(tile_bytes_, std::clamp<std::uint64_t>(options.buffer_bytes / tile_bytes_, 1, across));
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

  [[nodiscard]] std::uint64_t buffer_bytes() const override { return cache_->capacity() * tile_bytes_; }

 private:
  struct Pixels {
    std::int64_t side = 0;
    std::size_t channels = 0;
    std::vector<std::byte> bytes;
  };

  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, info_.path + ": " + what); }

  void choose_zoom(const std::string& part) {
    const int coarsest = file_.coarsest();
    const int finest = file_.finest();
    zoom_ = finest;
    if (!part.empty()) {
      const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), zoom_);
      if (error != std::errc{} || end != part.data() + part.size()) zoom_ = -1;
    } else if (coarsest < finest) {
      info_.warnings.push_back(
          fmt::format("has zoom levels {} to {}; {} is read, `part` takes another", coarsest, finest, finest));
    }
    const auto found = zoom_ < coarsest || zoom_ > finest ? std::nullopt : file_.box(zoom_);
    if (!found) {
      fail(ErrorCode::kInvalidArgument,
           fmt::format("has no zoom level \"{}\"; there are {} to {}",
                       part.empty() ? std::to_string(finest) : printable(part), coarsest, finest));
    }
    box_ = *found;
  }

  [[nodiscard]] Packing choose_packing(const OpenOptions& options) const {
    if (!options.channel.empty())
      fail(ErrorCode::kInvalidArgument, "has no channels but packed elevations; `encoding` states how they are packed");
    if (const auto packing = stated_packing(options)) return *packing;
    if (const auto packing = packing_from_string(file_.encoding())) return *packing;
    fail(ErrorCode::kUnsupported,
         fmt::format("does not state how its colours hold elevations; `encoding` {} does", kEncodings));
  }

  [[nodiscard]] Pixels pixels_of(const TilePlace& place) {
    std::vector<std::byte> stored;
    if (file_.read(place, stored)) return decoded(place, stored);
    fail(ErrorCode::kCorrupt,
         fmt::format("tile {}/{}/{} is listed, but not there", place.zoom, place.column, place.row));
  }

  [[nodiscard]] Pixels decoded(const TilePlace& place, const std::vector<std::byte>& stored) const {
    const auto refuse = [&](ErrorCode code, const std::string& what) {
      fail(code, fmt::format("tile {}/{}/{} {}", place.zoom, place.column, place.row, what));
    };
    std::unique_ptr<PictureDecoder> decoder;
    if (kPngFormat.recognises(stored)) decoder = std::make_unique<PngDecoder>();
    if (looks_like_webp(stored)) decoder = std::make_unique<WebpDecoder>();
    if (!decoder) {
      const bool is_jpeg = text_of(stored).starts_with("\xFF\xD8");
      const bool is_gzip = text_of(stored).starts_with("\x1F\x8B");
      refuse(ErrorCode::kUnsupported, is_jpeg   ? "is a JPEG picture, which does not keep the bytes of elevations"
                                      : is_gzip ? "is no picture, but packed outlines, as of a map of vectors"
                                                : "is no PNG or WebP picture");
    }
    const auto check = [&](bool done) {
      if (!done) refuse(ErrorCode::kCorrupt, fmt::format("is damaged: {}", decoder->message()));
    };
    PngHeader header;
    check(decoder->open(stored, header));
    const bool is_square = header.width == header.height && header.width <= kMostSide;
    if (!is_square || (side_ > 0 && header.width != side_)) {
      refuse(ErrorCode::kUnsupported, fmt::format("has {} x {} samples, must have {} each way", header.width,
                                                  header.height, side_ > 0 ? side_ : kMostSide));
    }
    if (header.is_lossy) refuse(ErrorCode::kUnsupported, "is lossy WebP, which does not keep the bytes of elevations");
    check(decoder->start(header, PictureDecoder::For::kPicture));
    if (header.bit_depth != 8)
      refuse(ErrorCode::kUnsupported, fmt::format("has channels of {} bits, must have 8", header.bit_depth));
    Pixels pixels{header.width, header.channels.size(), std::vector<std::byte>(header.row_bytes * header.height)};
    check(decoder->read_picture(pixels.bytes, header) && decoder->finish());
    return pixels;
  }

  /// Tiles of a row, decoded side by side if they are not held; as many as the cache takes.
  [[nodiscard]] std::vector<const std::byte*> tiles_of(std::int64_t row, std::int64_t first, std::int64_t end) {
    const auto index = [&](std::int64_t column) {
      return static_cast<std::uint64_t>(row * (info_.width / side_) + column);
    };
    std::vector<const std::byte*> tiles;
    std::vector<std::pair<std::int64_t, std::byte*>> wanted;
    // Those that are held first: claiming makes room of what was not asked for lately.
    for (std::int64_t column = first; column < end; ++column) tiles.push_back(cache_->find(index(column)));
    for (std::int64_t column = first; column < end; ++column) {
      const std::byte*& tile = tiles[static_cast<std::size_t>(column - first)];
      if (tile != nullptr) continue;
      wanted.emplace_back(column, cache_->claim(index(column)));
      tile = wanted.back().second;
    }
    try {
      oneapi::tbb::this_task_arena::isolate([&] {
        oneapi::tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
          const auto [column, room] = wanted[i];
          decode({zoom_, box_.first_column + column, box_.first_row + row}, {room, tile_bytes_});
        });
      });
    } catch (...) {
      cache_->clear();
      throw;
    }
    return tiles;
  }

  void decode(const TilePlace& place, std::span<std::byte> samples) {
    std::vector<std::byte> stored;
    if (file_.read(place, stored)) {
      const Pixels pixels = decoded(place, stored);
      return unpack_elevations(packing_, pixels.channels, pixels.bytes, samples);
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

  PmtilesFile file_;
  SourceInfo info_;
  int zoom_ = 0;
  TileBox box_;
  std::int64_t side_ = 0;  ///< samples of a tile each way
  Packing packing_ = Packing::kTerrarium;
  std::vector<std::byte> gap_;  ///< a sample where there is no tile
  std::size_t tile_bytes_ = 1;
  std::optional<BlockCache> cache_;
};

std::unique_ptr<HeightSource> open_pmtiles(const std::string& path, const OpenOptions& options) {
  return std::make_unique<TileSource>(path, options);
}

}  // namespace

const Format kPmtilesFormat = {.name = "PMTiles",
                               .extensions = {".pmtiles"},
                               .note = "takes `encoding` and `part`",
                               .open = open_pmtiles,
                               .recognises = looks_like_pmtiles,
                               .takes_part = true,
                               .takes_encoding = true};

}  // namespace isohf
