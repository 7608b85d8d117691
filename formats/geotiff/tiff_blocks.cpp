#include "formats/geotiff/tiff_blocks.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "formats/io/file_stamp.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint64_t kMiB = 1U << 20U;
/// Decoded bytes of a block, all samples of its pixels.
constexpr double kLargestBlock = 256.0 * kMiB;
constexpr std::uint64_t kSmallestCache = 16 * kMiB;
constexpr std::uint64_t kLargestCache = 1024 * kMiB;
/// Tables longer than this are checked at their ends only.
constexpr std::uint64_t kMostCheckedBlocks = 1U << 22U;

/// How many bytes one stored byte can become at most, with room to spare; infinite if no bound is known.
/// PackBits: 2 bytes for 128. DEFLATE: 258 bytes for 2 bits. LZW: at most 3838 bytes for one code of 12 bits.
double largest_expansion(std::uint16_t compression) {
  switch (compression) {
    case 1:
      return 1.0;
    case 32773:
      return 64.0;
    case 8:
    case 32946:
      return 1100.0;
    case 5:
      return 2600.0;
    default:
      return std::numeric_limits<double>::infinity();
  }
}

std::size_t to_size(std::int64_t value) {
  return static_cast<std::size_t>(value);
}

/// Copies `count` words that lie some words apart.
template <typename Word>
void copy_apart(const std::byte* from, std::size_t from_step, std::byte* to, std::size_t to_step, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(to + i * to_step * sizeof(Word), from + i * from_step * sizeof(Word), sizeof(Word));
  }
}

void copy_samples(std::size_t sample_bytes, const std::byte* from, std::size_t from_step, std::byte* to,
                  std::size_t to_step, std::size_t count) {
  switch (sample_bytes) {
    case 1:
      return copy_apart<std::uint8_t>(from, from_step, to, to_step, count);
    case 2:
      return copy_apart<std::uint16_t>(from, from_step, to, to_step, count);
    case 4:
      return copy_apart<std::uint32_t>(from, from_step, to, to_step, count);
    default:
      return copy_apart<std::uint64_t>(from, from_step, to, to_step, count);
  }
}

/// Rows of bits, the first of a byte its highest, as bytes.
void spread_bits(const std::byte* rows, std::size_t row_bytes, std::size_t columns, std::byte* out, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t column = i % columns;
    out[i] = rows[i / columns * row_bytes + column / 8] >> (7 - column % 8) & std::byte{1};
  }
}

}  // namespace

TiffBlocks::TiffBlocks(std::string path, const TiffLayout& layout, TiffMainImage image, int channel,
                       std::uint64_t cache_bytes)
    : path_(std::move(path)),
      layout_(layout),
      directory_(image.directories.main),
      channel_(channel),
      sample_bytes_((layout.bits_per_sample + 7U) / 8U),
      pixel_bytes_(sample_bytes_ * (channel == kAllSamples ? layout.samples_per_pixel : 1U)) {
  check_blocks(*image.handle);
  const std::size_t unit_bytes = to_size(layout_.block_width * layout_.block_height) * pixel_bytes_;
  const std::uint64_t across = static_cast<std::uint64_t>(layout_.blocks_across);
  const std::uint64_t two_rows = std::clamp(2 * across * unit_bytes, kSmallestCache, kLargestCache);
  const std::uint64_t units = std::min(across * static_cast<std::uint64_t>(layout_.blocks_down),
                                       std::max<std::uint64_t>(2, std::min(two_rows, cache_bytes) / unit_bytes));
  cache_.emplace(unit_bytes, static_cast<std::size_t>(units));
  give_back(std::move(image.handle));
}

/// Checks, before anything is allocated, that all blocks lie in the file and can hold what the layout claims.
void TiffBlocks::check_blocks(TiffHandle& handle) {
  const char* kind = layout_.tiled ? "tile" : "strip";
  const bool is_plain = layout_.compression == 1;
  const double row_bytes = layout_.block_row_bytes();
  const double expansion = largest_expansion(layout_.compression);
  const auto across = static_cast<std::uint64_t>(layout_.blocks_across);
  const std::uint64_t per_plane = across * static_cast<std::uint64_t>(layout_.blocks_down);
  const bool has_all_planes = layout_.separate && channel_ == kAllSamples;
  const auto corrupt = [&](const std::string& what) { throw Error(ErrorCode::kCorrupt, path_ + ": " + what); };
  if (per_plane > std::numeric_limits<std::uint32_t>::max() / (layout_.separate ? layout_.samples_per_pixel : 1U)) {
    corrupt(fmt::format("{} x {} {}s, more than a TIFF file can hold", across, layout_.blocks_down, kind));
  }
  const std::uint64_t first = layout_.separate && !has_all_planes ? layout_.block_index(channel_, 0, 0) : 0;
  block_count_ = per_plane * (has_all_planes ? layout_.samples_per_pixel : 1U);
  const std::uint64_t file_bytes = FileStamp::of(path_).size_bytes;
  for (std::uint64_t i = 0; i < block_count_; ++i) {
    if (block_count_ > kMostCheckedBlocks && i == kMostCheckedBlocks / 2) i = block_count_ - kMostCheckedBlocks / 2;
    const TiffBlockSpan span = handle.block_span(first + i);
    if (span.size_bytes == 0) {
      ++missing_;
      continue;
    }
    const double rows = static_cast<double>(layout_.stored_rows(static_cast<std::int64_t>(i % per_plane / across)));
    const auto stored = static_cast<double>(span.size_bytes);
    if (row_bytes * rows / expansion > stored) {
      corrupt(fmt::format("{} {} has {} bytes, which cannot hold its samples' {}", kind, i, stored, row_bytes * rows));
    }
    // Writers may round a plain strip's size up.
    const double needed = is_plain ? row_bytes * rows : stored;
    if (static_cast<double>(span.offset_bytes) + needed > static_cast<double>(file_bytes)) {
      corrupt(fmt::format("truncated: {} {} of {} has {} bytes from byte {} on, the file has {} bytes in all", kind, i,
                          block_count_, needed, span.offset_bytes, file_bytes));
    }
  }
  // Of a plain strip that is too short, libtiff makes short ones and some of no bytes.
  const auto is_chopped = [&] {
    TiffHandle stored(path_, directory_, TiffHandle::PlainStrips::kAsStored);
    return stored.read_layout().block_height != layout_.block_height;
  };
  if (is_plain && !layout_.tiled && missing_ > 0 && is_chopped()) corrupt("the strip is too short for its samples");
  if (const double bytes = row_bytes * static_cast<double>(layout_.block_height); bytes > kLargestBlock) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: its {}s decode to {} bytes each, at most {} are read; gdal_translate -co TILED=YES "
                            "makes small ones",
                            path_, kind, bytes, kLargestBlock));
  }
}

void TiffBlocks::set_fill(std::span<const std::byte> sample) {
  ISOHF_ASSERT(sample.size() == sample_bytes_);
  std::copy(sample.begin(), sample.end(), fill_.begin());
}

void TiffBlocks::read(const Window& window, std::span<std::byte> samples) {
  ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0);
  ISOHF_ASSERT(window.column + window.columns <= layout_.width && window.row + window.rows <= layout_.height);
  ISOHF_ASSERT(samples.size() == to_size(window.columns * window.rows) * pixel_bytes_);
  if (samples.empty()) return;
  const std::int64_t left = window.column / layout_.block_width;
  const std::int64_t across = (window.column + window.columns - 1) / layout_.block_width + 1 - left;
  const std::int64_t top = window.row / layout_.block_height;
  const std::int64_t count = across * ((window.row + window.rows - 1) / layout_.block_height + 1 - top);
  const auto batch = static_cast<std::int64_t>((cache_->capacity() + 1) / 2);
  std::vector<Unit> units;
  for (std::int64_t begin = 0; begin < count; begin += batch) {
    units.clear();
    for (std::int64_t i = begin; i < std::min(begin + batch, count); ++i) {
      Unit unit{left + i % across, top + i / across};
      unit.is_in_place = can_read_in_place(unit, window);
      unit.bytes = unit.is_in_place
                       ? samples.data() +
                             to_size((unit.down * layout_.block_height - window.row) * window.columns) * pixel_bytes_
                       : cache_->find(layout_.block_index(0, unit.across, unit.down));
      unit.is_decoded = !unit.is_in_place && unit.bytes != nullptr;
      units.push_back(unit);
    }
    try {
      decode(units);
    } catch (...) {
      cache_->clear();
      throw;
    }
    for (const Unit& unit : units) {
      if (!unit.is_in_place) copy_out(unit, window, samples);
    }
  }
}

/// Uncompressed strips inside a window of whole rows, unless a channel is picked: to read them again costs little.
bool TiffBlocks::can_read_in_place(const Unit& unit, const Window& window) const {
  const std::int64_t first = unit.down * layout_.block_height;
  return layout_.compression == 1 && !layout_.tiled && is_stored_as_delivered() && window.columns == layout_.width &&
         first >= window.row && first + layout_.stored_rows(unit.down) <= window.row + window.rows;
}

bool TiffBlocks::is_stored_as_delivered() const {
  const std::size_t wanted = pixel_bytes_ / sample_bytes_;
  return layout_.bits_per_sample >= 8 && wanted == to_size(layout_.interleaved());
}

void TiffBlocks::copy_out(const Unit& unit, const Window& window, std::span<std::byte> samples) const {
  const std::int64_t left = std::max(window.column, unit.across * layout_.block_width);
  const std::int64_t right = std::min(window.column + window.columns, (unit.across + 1) * layout_.block_width);
  const std::int64_t top = std::max(window.row, unit.down * layout_.block_height);
  const std::int64_t bottom = std::min(window.row + window.rows, (unit.down + 1) * layout_.block_height);
  for (std::int64_t row = top; row < bottom; ++row) {
    const std::int64_t from =
        (row - unit.down * layout_.block_height) * layout_.block_width + left - unit.across * layout_.block_width;
    const std::int64_t to = (row - window.row) * window.columns + left - window.column;
    std::memcpy(samples.data() + to_size(to) * pixel_bytes_, unit.bytes + to_size(from) * pixel_bytes_,
                to_size(right - left) * pixel_bytes_);
  }
}

void TiffBlocks::decode(std::vector<Unit>& units) {
  std::vector<const Unit*> missing;
  // Claimed after all were found: at most half the cache is in use, so nothing of this batch is thrown out.
  for (Unit& unit : units) {
    if (unit.is_decoded) continue;
    if (!unit.is_in_place) unit.bytes = cache_->claim(layout_.block_index(0, unit.across, unit.down));
    missing.push_back(&unit);
  }
  const auto decode_one = [&](std::size_t i) {
    std::unique_ptr<TiffHandle> handle = take_handle();
    decode(*missing[i], *handle);
    give_back(std::move(handle));
  };
  if (missing.size() == 1) return decode_one(0);
  // Isolated: a thread that waits here does not start on unrelated work of the caller's.
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, missing.size(), decode_one); });
}

void TiffBlocks::decode(const Unit& unit, TiffHandle& handle) const {
  const std::size_t pixels = to_size(layout_.stored_rows(unit.down) * layout_.block_width);
  const auto row_bytes = static_cast<std::size_t>(layout_.block_row_bytes());
  const std::size_t stored_bytes = row_bytes * to_size(layout_.stored_rows(unit.down));
  const auto interleaved = to_size(layout_.interleaved());
  const bool is_bits = layout_.bits_per_sample < 8;
  // Samples of a pixel that are delivered, and those of them in a block.
  const std::size_t wanted = pixel_bytes_ / sample_bytes_;
  const std::size_t planes = layout_.separate ? wanted : 1;
  const bool is_direct = is_stored_as_delivered();
  std::unique_ptr<std::byte[]> decoded;
  if (!is_direct) decoded = std::make_unique_for_overwrite<std::byte[]>(stored_bytes);
  for (std::size_t plane = 0; plane < planes; ++plane) {
    const std::int64_t stored_plane = !layout_.separate         ? 0
                                      : channel_ == kAllSamples ? static_cast<std::int64_t>(plane)
                                                                : channel_;
    const std::uint64_t block = layout_.block_index(stored_plane, unit.across, unit.down);
    if (handle.block_span(block).size_bytes == 0) {
      const std::size_t filled = layout_.separate ? 1 : wanted;
      for (std::size_t i = 0; i < filled; ++i) {
        copy_samples(sample_bytes_, fill_.data(), 0, unit.bytes + (plane + i) * sample_bytes_, wanted, pixels);
      }
      continue;
    }
    std::byte* const to = is_direct ? unit.bytes : decoded.get();
    handle.decode_block(block, {to, stored_bytes});
    if (is_bits) {
      spread_bits(to, row_bytes, to_size(layout_.block_width), unit.bytes, pixels);
    } else if (!is_direct) {
      const std::size_t first = layout_.separate ? 0 : to_size(channel_) * sample_bytes_;
      copy_samples(sample_bytes_, to + first, interleaved, unit.bytes + plane * sample_bytes_, wanted, pixels);
    }
  }
}

std::unique_ptr<TiffHandle> TiffBlocks::take_handle() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<TiffHandle> handle = std::move(idle_.back());
      idle_.pop_back();
      return handle;
    }
  }
  return std::make_unique<TiffHandle>(path_, directory_);
}

void TiffBlocks::give_back(std::unique_ptr<TiffHandle> handle) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(handle));
}

}  // namespace isohf
