#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/io/inflated_bytes.h"
#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "formats/png/packed_elevations.h"
#include "formats/readers.h"
#include "formats/webtiles/tile_store.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::string_view kMagic = "PMTiles";
constexpr std::size_t kHeaderBytes = 127;
constexpr std::uint64_t kMostStoredBytes = std::uint64_t{1} << 26U;    ///< of a directory, a text, a tile
constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{1} << 24U;  ///< and of what is inside
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

/// The column and row of the `at`-th tile of a level.
std::pair<std::uint64_t, std::uint64_t> place_of(int zoom, std::uint64_t at) {
  std::uint64_t x = 0;
  std::uint64_t y = 0;
  for (std::uint64_t side = 1; side < std::uint64_t{1} << static_cast<unsigned>(zoom); side <<= 1U, at >>= 2U) {
    const bool right = (at >> 1U & 1U) != 0;
    const bool low = ((at & 1U) != 0) != right;
    turn(side, x, y, right, low);
    x += right ? side : 0;
    y += low ? side : 0;
  }
  return {x, y};
}

/// Of a directory: tiles of one picture from `number` on, or with `run` 0 the directory of all from it on.
struct Entry {
  std::uint64_t number = 0;
  std::uint64_t offset = 0;
  std::uint32_t bytes = 0;
  std::uint32_t run = 0;
};
using Directory = std::vector<Entry>;

class PmtilesStore final : public TileStore {
 public:
  explicit PmtilesStore(const std::string& path) : file_(path) {
    std::array<std::byte, kHeaderBytes> header{};
    if (file_.read_some(0, header) != header.size()) fail(ErrorCode::kCorrupt, "ends within its header");
    const auto number = [&](std::size_t at) { return load_little<std::uint64_t>(header.data() + at); };
    const auto byte = [&](std::size_t at) { return std::to_integer<int>(header[at]); };
    if (byte(7) != 3) fail(ErrorCode::kUnsupported, fmt::format("is of PMTiles version {}, must be 3", byte(7)));
    compression_ = byte(97);
    tile_compression_ = byte(98);
    if (compression_ < 1 || compression_ > 2 || tile_compression_ > 2) {
      fail(ErrorCode::kUnsupported,
           "is packed by Brotli, Zstandard or what is unknown; `pmtiles convert` packs it by gzip");  // NOLINT
    }
    constexpr std::array<const char*, 6> kKinds = {
        "", "vectors (MVT)", "", "JPEG pictures, which do not keep the bytes of elevations", "", "AVIF pictures"};
    if (const int kind = byte(99); kind >= 6 || *kKinds[static_cast<std::size_t>(kind)] != '\0') {
      fail(ErrorCode::kUnsupported,
           fmt::format("has tiles of {}; PNG and WebP are read",
                       kind >= 6 ? "an unknown kind" : kKinds[static_cast<std::size_t>(kind)]));
    }
    root_ = read_directory(number(8), number(16));
    metadata_offset_ = number(24);
    metadata_bytes_ = number(32);
    leaves_offset_ = number(40);
    tiles_offset_ = number(56);
    if (root_.empty()) fail(ErrorCode::kCorrupt, "holds no tiles");
  }

  [[nodiscard]] std::pair<int, int> zooms() override {
    const std::uint64_t first = edge(false);
    const std::uint64_t last = edge(true);
    const auto zoom_of = [](std::uint64_t number) {
      int zoom = 0;
      while (first_of_level(zoom + 1) <= number) ++zoom;
      return zoom;
    };
    return {zoom_of(first), zoom_of(last)};
  }

  [[nodiscard]] std::optional<Box> box(int zoom) override {
    std::optional<Box> box;
    add_all(root_, zoom, kMostDepth, box);
    return box;
  }

  [[nodiscard]] bool read(const TilePlace& place, std::vector<std::byte>& stored) override {
    const std::uint64_t number = number_of(place);
    std::optional<Entry> found;
    {
      const std::lock_guard lock(one_looks_);
      const Directory* directory = &root_;
      for (int depth = 0; directory != nullptr; ++depth) {
        if (depth > kMostDepth) fail(ErrorCode::kCorrupt, "its directories never end");
        const auto behind = std::ranges::upper_bound(*directory, number, {}, &Entry::number);
        if (behind == directory->begin()) return false;
        const Entry entry = *std::prev(behind);
        if (entry.run == 0) {
          directory = &leaf(entry, behind == directory->end() ? kNoEnd : behind->number);
          continue;
        }
        if (number - entry.number >= entry.run) return false;
        found = entry;
        directory = nullptr;
      }
    }
    stored = bytes_at(sum(tiles_offset_, found->offset), found->bytes, tile_compression_ == 2);
    return true;
  }

  [[nodiscard]] std::string encoding() override {
    if (metadata_bytes_ == 0) return {};
    const std::vector<std::byte> text = bytes_at(metadata_offset_, metadata_bytes_, compression_ == 2);
    return encoding_in_json(std::string(text_of(text)));
  }

 private:
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const {
    throw Error(code, file_.path() + ": " + what);
  }

  [[nodiscard]] std::uint64_t sum(std::uint64_t a, std::uint64_t b) const {
    if (b > file_.size_bytes() || a > file_.size_bytes()) fail(ErrorCode::kCorrupt, "ends early, or is damaged");
    return a + b;
  }

  [[nodiscard]] std::vector<std::byte> bytes_at(std::uint64_t offset, std::uint64_t bytes, bool is_gzip) const {
    if (bytes > kMostStoredBytes || offset > file_.size_bytes() || bytes > file_.size_bytes() - offset) {
      fail(ErrorCode::kCorrupt, fmt::format("says {} bytes at {}, and has {}", bytes, offset, file_.size_bytes()));
    }
    std::vector<std::byte> stored(static_cast<std::size_t>(bytes));
    file_.read(offset, stored);
    if (!is_gzip) return stored;
    const auto unpacked = UnpackedBytes::from_gzip(stored, kMostUnpackedBytes);
    if (!unpacked) fail(ErrorCode::kCorrupt, fmt::format("the gzip data at byte {} are damaged", offset));
    return {unpacked->bytes().begin(), unpacked->bytes().end()};
  }

  /// Four lists of numbers of 7 bits a byte: tiles as differences, runs, lengths, and offsets, 0 for what follows.
  [[nodiscard]] Directory read_directory(std::uint64_t offset, std::uint64_t bytes) const {
    const std::vector<std::byte> text = bytes_at(offset, bytes, compression_ == 2);
    std::size_t at = 0;
    const auto next = [&] {
      std::uint64_t value = 0;
      for (unsigned shift = 0; shift < 64; shift += 7) {
        if (at == text.size()) break;
        const auto byte = std::to_integer<std::uint64_t>(text[at++]);
        value |= (byte & 0x7FU) << shift;
        if (byte < 0x80) return value;
      }
      fail(ErrorCode::kCorrupt, fmt::format("the directory at byte {} is damaged", offset));
    };
    const auto below = [&](std::uint64_t value, std::uint64_t most) {
      if (value > most) fail(ErrorCode::kCorrupt, fmt::format("the directory at byte {} is damaged", offset));
      return value;
    };
    const std::uint64_t count = next();
    below(count, text.size() / 4);
    Directory directory(static_cast<std::size_t>(count));
    const std::uint64_t end = first_of_level(kMostZoom + 1);
    constexpr std::uint64_t kMostRun = 0xFFFFFFFF;
    std::uint64_t number = 0;
    for (Entry& entry : directory) {
      const std::uint64_t step = next();
      if (&entry != directory.data()) below(1, step);  // else two are one tile
      entry.number = number = below(number + below(step, end), end - 1);
    }
    for (Entry& entry : directory)
      entry.run = static_cast<std::uint32_t>(below(next(), std::min(end - entry.number, kMostRun)));
    for (Entry& entry : directory) entry.bytes = static_cast<std::uint32_t>(below(next(), kMostStoredBytes));
    for (std::size_t i = 0; i < directory.size(); ++i) {
      const std::uint64_t value = next();
      if (value == 0) below(1, i);
      directory[i].offset = value > 0 ? value - 1 : directory[i - 1].offset + directory[i - 1].bytes;
    }
    return directory;
  }

  /// The directory of the tiles from an entry's on to `end`.
  [[nodiscard]] const Directory& leaf(const Entry& entry, std::uint64_t end) {
    const auto found = leaves_.find(entry.offset);
    if (found != leaves_.end()) return found->second;
    Directory directory = read_directory(sum(leaves_offset_, entry.offset), entry.bytes);
    if (directory.empty() || directory.front().number < entry.number || directory.back().number >= end) {
      fail(ErrorCode::kCorrupt, "a directory holds other tiles than its own");
    }
    if (kept_entries_ + directory.size() > kMostKeptEntries) {
      leaves_.clear();
      kept_entries_ = 0;
    }
    kept_entries_ += directory.size();
    return leaves_.emplace(entry.offset, std::move(directory)).first->second;
  }

  /// The number of the first or last tile.
  [[nodiscard]] std::uint64_t edge(bool last) {
    Directory directory = root_;
    for (int depth = 0; depth <= kMostDepth; ++depth) {
      const Entry entry = last ? directory.back() : directory.front();
      if (entry.run > 0) return last ? entry.number + entry.run - 1 : entry.number;
      directory = Directory(leaf(entry, kNoEnd));
    }
    fail(ErrorCode::kCorrupt, "its directories never end");
  }

  /// The tiles of a level in a directory and those below it.
  void add_all(const Directory& directory, int zoom, int depth, std::optional<Box>& box) {
    const std::uint64_t first = first_of_level(zoom);
    const std::uint64_t end = first_of_level(zoom + 1);
    for (std::size_t i = 0; i < directory.size(); ++i) {
      const Entry& entry = directory[i];
      const std::uint64_t next = i + 1 < directory.size() ? directory[i + 1].number : kNoEnd;
      if (next <= first || entry.number >= end) continue;
      if (entry.run > 0) {
        add(std::max(entry.number, first), std::min(entry.number + entry.run, end), zoom, box);
      } else if (depth > 0) {
        const Directory below = leaf(entry, next);
        add_all(below, zoom, depth - 1, box);
      } else {
        fail(ErrorCode::kCorrupt, "its directories never end");
      }
    }
  }

  /// Tiles from `number` to `end` of a level, square by square.
  static void add(std::uint64_t number, std::uint64_t end, int zoom, std::optional<Box>& box) {
    const std::uint64_t first = first_of_level(zoom);
    while (number < end) {
      unsigned level = 0;
      while (level < static_cast<unsigned>(zoom) && ((number - first) >> 2U * level & 3U) == 0 &&
             number + (std::uint64_t{1} << 2U * (level + 1)) <= end) {
        ++level;
      }
      const auto [x, y] = place_of(zoom, number - first);
      const auto side = static_cast<std::int64_t>(std::uint64_t{1} << level);
      const std::int64_t west = static_cast<std::int64_t>(x) & ~(side - 1);
      const std::int64_t north = static_cast<std::int64_t>(y) & ~(side - 1);
      if (!box) {
        const TilePlace place{zoom, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y)};
        box = Box{west, west + side - 1, north, north + side - 1, place};
      }
      box->first_column = std::min(box->first_column, west);
      box->last_column = std::max(box->last_column, west + side - 1);
      box->first_row = std::min(box->first_row, north);
      box->last_row = std::max(box->last_row, north + side - 1);
      number += std::uint64_t{1} << 2U * level;
    }
  }

  RawFile file_;
  int compression_ = 0;
  int tile_compression_ = 0;
  std::uint64_t metadata_offset_ = 0;
  std::uint64_t metadata_bytes_ = 0;
  std::uint64_t leaves_offset_ = 0;
  std::uint64_t tiles_offset_ = 0;
  Directory root_;
  std::mutex one_looks_;
  std::map<std::uint64_t, Directory> leaves_;  ///< by their offsets
  std::size_t kept_entries_ = 0;
};

}  // namespace

bool looks_like_pmtiles(std::span<const std::byte> head) {
  return text_of(head).starts_with(kMagic);
}

std::unique_ptr<TileStore> open_pmtiles_store(const std::string& path) {
  return std::make_unique<PmtilesStore>(path);
}

}  // namespace isohf
