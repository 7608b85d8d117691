#include "formats/webtiles/pmtiles.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "formats/png/packed_elevations.h"
#include "isohf/base/bytes.h"
#include "isohf/base/text/text.h"

namespace isohf {
namespace {

constexpr std::size_t kHeaderBytes = 127;
constexpr std::uint64_t kMostStoredBytes = std::uint64_t{1} << 26U;  ///< of a directory, a text, a tile
constexpr std::size_t kMostUnpackedBytes = std::size_t{1} << 24U;    ///< and of what is inside
/// Directories below the root that are kept: entries of 24 bytes.
constexpr std::size_t kMostKeptEntries = std::size_t{1} << 20U;
constexpr int kMostDepth = 4;
constexpr std::uint64_t kNoEnd = ~std::uint64_t{0};

/// Tiles are numbered along a Hilbert curve, level after level: the first of a level.
constexpr std::uint64_t first_of_level(int zoom) {
  return ((std::uint64_t{1} << static_cast<unsigned>(2 * zoom)) - 1) / 3;
}

/// Turns a quadrant of a Hilbert curve of `side`; only the bits below it count.
void turn(std::uint64_t side, std::uint64_t& x, std::uint64_t& y, bool right, bool low) {
  if (low) return;
  if (right) {
    x = side - 1 - x;
    y = side - 1 - y;
  }
  std::swap(x, y);
}

std::uint64_t number_of(const TilePlace& place) {
  auto x = static_cast<std::uint64_t>(place.column);
  auto y = static_cast<std::uint64_t>(place.row);
  std::uint64_t number = first_of_level(place.zoom);
  for (std::uint64_t side = std::uint64_t{1} << static_cast<unsigned>(place.zoom) >> 1U; side > 0; side >>= 1U) {
    const bool right = (x & side) != 0;
    const bool low = (y & side) != 0;
    number += side * side * ((right ? 3U : 0U) ^ (low ? 1U : 0U));
    turn(side, x, y, right, low);
  }
  return number;
}

/// The `at`-th tile of a level.
TilePlace place_of(int zoom, std::uint64_t at) {
  std::uint64_t x = 0;
  std::uint64_t y = 0;
  for (std::uint64_t side = 1; side < std::uint64_t{1} << static_cast<unsigned>(zoom); side <<= 1U, at >>= 2U) {
    const bool right = (at >> 1U & 1U) != 0;
    const bool low = ((at & 1U) != 0) != right;
    turn(side, x, y, right, low);
    x += right ? side : 0;
    y += low ? side : 0;
  }
  return {zoom, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y)};
}

/// What gzip data hold; nullopt if they are damaged or hold more than kMostUnpackedBytes.
std::optional<std::vector<std::byte>> inflated(const std::vector<std::byte>& stored) {
  constexpr std::size_t kMostRatio = 1032;  // of deflate
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflater(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  std::vector<std::byte> out(std::min(kMostUnpackedBytes, kMostRatio * stored.size()));
  std::size_t bytes = 0;
  if (inflater == nullptr || libdeflate_gzip_decompress(inflater.get(), stored.data(), stored.size(), out.data(),
                                                        out.size(), &bytes) != LIBDEFLATE_SUCCESS) {
    return std::nullopt;
  }
  out.resize(bytes);
  return out;
}

}  // namespace

void TileBox::include(std::int64_t column, std::int64_t row, std::int64_t side) {
  first_column = std::min(first_column, column);
  last_column = std::max(last_column, column + side - 1);
  first_row = std::min(first_row, row);
  last_row = std::max(last_row, row + side - 1);
}

PmtilesFile::PmtilesFile(const std::string& path) : file_(path, File::Mode::kRead) {
  std::array<std::byte, kHeaderBytes> header{};
  if (file_.read_at(0, header) != header.size()) fail(ErrorCode::kCorrupt, "ends within its header");
  const auto number = [&](std::size_t at) { return load_little<std::uint64_t>(header.data() + at); };
  const auto byte = [&](std::size_t at) { return std::to_integer<int>(header[at]); };
  if (byte(7) != 3) fail(ErrorCode::kUnsupported, fmt::format("is of PMTiles version {}, must be 3", byte(7)));
  constexpr int kGzip = 2;
  if (byte(97) < 1 || byte(97) > kGzip || byte(98) > kGzip) {
    fail(ErrorCode::kUnsupported,
         "is packed by Brotli, Zstandard or something unknown; `pmtiles convert` packs it by gzip");  // NOLINT
  }
  has_packed_directories_ = byte(97) == kGzip;
  has_packed_tiles_ = byte(98) == kGzip;
  constexpr std::array<const char*, 6> kKinds = {
      "", "vectors (MVT)", "", "JPEG pictures, which do not keep the bytes of elevations", "", "AVIF pictures"};
  const char* const kind = byte(99) < 6 ? kKinds[static_cast<std::size_t>(byte(99))] : "an unknown kind";
  if (*kind != '\0') fail(ErrorCode::kUnsupported, fmt::format("has tiles of {}; PNG and WebP are read", kind));
  coarsest_ = byte(100);
  finest_ = byte(101);
  if (coarsest_ > finest_ || finest_ > kMostZoom)
    fail(ErrorCode::kCorrupt, fmt::format("states zoom levels {} to {}", coarsest_, finest_));
  root_ = read_directory(number(8), number(16));
  metadata_offset_ = number(24);
  metadata_bytes_ = number(32);
  leaves_offset_ = number(40);
  tiles_offset_ = number(56);
  if (root_.empty()) fail(ErrorCode::kCorrupt, "holds no tiles");
}

std::optional<TileBox> PmtilesFile::box(int zoom) {
  std::optional<TileBox> box;
  add_all(root_, zoom, kMostDepth, box);
  return box;
}

bool PmtilesFile::read(const TilePlace& place, std::vector<std::byte>& stored) {
  const std::uint64_t number = number_of(place);
  Entry found;
  {
    const std::lock_guard lock(one_looks_);
    const Directory* directory = &root_;
    for (int depth = 0; found.run == 0; ++depth) {
      if (depth > kMostDepth) fail(ErrorCode::kCorrupt, "its directories never end");
      const auto after = std::ranges::upper_bound(*directory, number, {}, &Entry::number);
      if (after == directory->begin()) return false;
      found = *std::prev(after);
      if (found.run == 0) directory = &leaf(found, after == directory->end() ? kNoEnd : after->number);
    }
  }
  if (number - found.number >= found.run) return false;
  stored = bytes_at(sum(tiles_offset_, found.offset), found.bytes, has_packed_tiles_);
  return true;
}

std::string PmtilesFile::encoding() const {
  if (metadata_bytes_ == 0) return {};
  const std::vector<std::byte> text = bytes_at(metadata_offset_, metadata_bytes_, has_packed_directories_);
  const nlohmann::json json = nlohmann::json::parse(text_of(text), nullptr, false);
  if (!json.is_object() || !json.contains("encoding") || !json["encoding"].is_string()) return {};
  return json["encoding"].get<std::string>();
}

void PmtilesFile::fail(ErrorCode code, const std::string& what) const {
  throw Error(code, file_.path() + ": " + what);
}

/// Of two offsets that a damaged file may make too large.
std::uint64_t PmtilesFile::sum(std::uint64_t a, std::uint64_t b) const {
  if (b > file_.size_bytes() || a > file_.size_bytes()) fail(ErrorCode::kCorrupt, "ends early, or is damaged");
  return a + b;
}

std::vector<std::byte> PmtilesFile::bytes_at(std::uint64_t offset, std::uint64_t bytes, bool is_gzip) const {
  const std::uint64_t size = file_.size_bytes();
  if (bytes > kMostStoredBytes || offset > size || bytes > size - offset)
    fail(ErrorCode::kCorrupt, fmt::format("says {} bytes at {}, and has {}", bytes, offset, size));
  std::vector<std::byte> stored(static_cast<std::size_t>(bytes));
  if (file_.read_at(offset, stored) != stored.size()) fail(ErrorCode::kCorrupt, "ends early");
  if (!is_gzip) return stored;
  auto unpacked = inflated(stored);
  if (!unpacked) fail(ErrorCode::kCorrupt, fmt::format("the gzip data at byte {} are damaged", offset));
  return *std::move(unpacked);
}

/// Four lists of numbers of 7 bits a byte: tiles as differences, runs, lengths, and offsets, 0 for the place behind the
/// entry before.
PmtilesFile::Directory PmtilesFile::read_directory(std::uint64_t offset, std::uint64_t bytes) const {
  const std::vector<std::byte> text = bytes_at(offset, bytes, has_packed_directories_);
  std::size_t at = 0;
  const auto damaged = [&] { fail(ErrorCode::kCorrupt, fmt::format("the directory at byte {} is damaged", offset)); };
  const auto next = [&](std::uint64_t most) {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && at < text.size(); shift += 7) {
      const auto byte = std::to_integer<std::uint64_t>(text[at++]);
      value |= (byte & 0x7FU) << shift;
      if (byte >= 0x80) continue;
      if (value > most) break;
      return value;
    }
    damaged();
    return value;
  };
  Directory directory(static_cast<std::size_t>(next(text.size() / 4)));
  const std::uint64_t end = first_of_level(kMostZoom + 1);
  constexpr std::uint64_t kMostRun = 0xFFFFFFFF;
  std::uint64_t number = 0;
  for (Entry& entry : directory) {
    const std::uint64_t step = next(end - 1 - number);
    if (step == 0 && &entry != directory.data()) damaged();  // two would be one tile
    entry.number = number += step;
  }
  for (Entry& entry : directory) entry.run = static_cast<std::uint32_t>(next(std::min(end - entry.number, kMostRun)));
  for (Entry& entry : directory) entry.bytes = static_cast<std::uint32_t>(next(kMostStoredBytes));
  for (std::size_t i = 0; i < directory.size(); ++i) {
    const std::uint64_t value = next(kNoEnd);
    if (value == 0 && i == 0) damaged();
    directory[i].offset = value > 0 ? value - 1 : directory[i - 1].offset + directory[i - 1].bytes;
  }
  return directory;
}

/// The directory of the tiles from an entry's on to `end`.
const PmtilesFile::Directory& PmtilesFile::leaf(const Entry& entry, std::uint64_t end) {
  const auto found = leaves_.find(entry.offset);
  if (found != leaves_.end()) return found->second;
  Directory directory = read_directory(sum(leaves_offset_, entry.offset), entry.bytes);
  if (directory.empty() || directory.front().number < entry.number || directory.back().number >= end)
    fail(ErrorCode::kCorrupt, "a directory holds other tiles than its own");
  if (kept_entries_ + directory.size() > kMostKeptEntries) {
    leaves_.clear();
    kept_entries_ = 0;
  }
  kept_entries_ += directory.size();
  return leaves_.emplace(entry.offset, std::move(directory)).first->second;
}

/// The tiles of a level in a directory and those below it: of what is there, since stated bounds are rounded, or wrong.
void PmtilesFile::add_all(const Directory& directory, int zoom, int depth, std::optional<TileBox>& box) {
  if (depth < 0) fail(ErrorCode::kCorrupt, "its directories never end");
  const std::uint64_t first = first_of_level(zoom);
  const std::uint64_t end = first_of_level(zoom + 1);
  for (std::size_t i = 0; i < directory.size(); ++i) {
    const Entry& entry = directory[i];
    const std::uint64_t next = i + 1 < directory.size() ? directory[i + 1].number : kNoEnd;
    if (next <= first || entry.number >= end) continue;
    if (entry.run == 0) {
      const Directory below = leaf(entry, next);
      add_all(below, zoom, depth - 1, box);
      continue;
    }
    // Square by square of the curve.
    const std::uint64_t last = std::min(entry.number + entry.run, end);
    for (std::uint64_t number = std::max(entry.number, first); number < last;) {
      unsigned level = 0;
      while (level < static_cast<unsigned>(zoom) && ((number - first) >> 2U * level & 3U) == 0 &&
             number + (std::uint64_t{1} << 2U * (level + 1)) <= last) {
        ++level;
      }
      const TilePlace place = place_of(zoom, number - first);
      const std::int64_t side = std::int64_t{1} << level;
      if (!box) box = TileBox{place.column, place.column, place.row, place.row, place};
      box->include(place.column & ~(side - 1), place.row & ~(side - 1), side);
      number += std::uint64_t{1} << 2U * level;
    }
  }
}

bool looks_like_pmtiles(std::span<const std::byte> head) {
  return text_of(head).starts_with("PMTiles");
}

}  // namespace isohf
