#include "formats/geotiff/tiff_blocks.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "formats/geotiff/tiff_file.h"
#include "formats/io/raw_file.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The blocks of one sample plane of an image, as its tables list them.
struct TiffBlockTable {
  std::uint64_t count = 0;
  std::uint64_t missing = 0;               ///< not stored (sparse file)
  std::uint64_t block_bytes = 0;           ///< of a whole block, decoded
  std::uint64_t largest_stored_bytes = 0;  ///< of a block in the file
};

/// A block or row that would decode to more is refused: no elevation raster has such, damaged headers do.
constexpr std::uint64_t kLargestBlock = std::uint64_t{1} << 30U;
/// Tables longer than this are checked at their ends only.
constexpr std::uint64_t kMostCheckedBlocks = 1U << 22U;

/// How many bytes one stored byte can become at most, with room to spare; 0 where no bound is known.
/// PackBits: 2 bytes for 128. DEFLATE: 258 bytes for 2 bits. LZW: at most 3838 bytes for one code of 12 bits.
std::uint64_t largest_expansion(std::uint16_t compression) {
  switch (compression) {
    case 1:
      return 1;
    case 32773:
      return 64;
    case 8:
    case 32946:
      return 1100;
    case 5:
      return 2600;
    default:
      return 0;
  }
}

std::uint64_t to_unsigned(std::int64_t value) {
  return static_cast<std::uint64_t>(value);
}

/// The number of blocks and the size of one, where they make sense.
TiffBlockTable check_sizes(const RawFile& file, const TiffLayout& layout) {
  const std::uint64_t pixel_bytes = to_unsigned(layout.interleaved() * layout.sample_bytes());
  // Sizes below stay under 2^63: each factor is a 32-bit number, and the products are checked one by one.
  const std::uint64_t row_bytes = to_unsigned(layout.block_width) * pixel_bytes;
  const auto too_large = [&](const std::string& what, std::uint64_t bytes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} would decode to {} bytes, at most {} are read", file.path(),
                                                 what, bytes, kLargestBlock));
  };
  if (row_bytes > kLargestBlock) too_large(layout.tiled ? "a row of a tile" : "a row", row_bytes);
  const std::uint64_t block_bytes = row_bytes * to_unsigned(layout.block_height);
  if (layout.tiled && block_bytes > kLargestBlock) too_large("a tile", block_bytes);
  const auto planes = to_unsigned(layout.separate ? layout.samples_per_pixel : 1);
  const std::uint64_t per_plane = to_unsigned(layout.blocks_across) * to_unsigned(layout.blocks_down);
  if (per_plane > std::numeric_limits<std::uint32_t>::max() / planes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} x {} blocks, more than a TIFF file can hold", file.path(),
                                                 layout.blocks_across, layout.blocks_down));
  }
  if (layout.table_entries < per_plane * planes) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the table of {} has {} entries, the image needs {}", file.path(),
                            layout.tiled ? "tiles" : "strips", layout.table_entries, per_plane * planes));
  }
  TiffBlockTable table;
  table.count = per_plane;
  table.block_bytes = block_bytes;
  return table;
}

/// Checks, before anything is allocated, that all blocks lie in the file and can hold what the layout says.
/// plane  of blocks, 0 where samples are interleaved
/// Throws Error{kCorrupt}: blocks outside of the file, too short for their samples, absurdly large, or too few.
TiffBlockTable check_tiff_blocks(const RawFile& file, const TiffLayout& layout, std::int64_t plane,
                                 TiffHandle& handle) {
  TiffBlockTable table = check_sizes(file, layout);
  const std::uint64_t first = layout.block_index(plane, 0, 0);
  const std::uint64_t expansion = largest_expansion(layout.compression);
  const std::uint64_t row_bytes =
      to_unsigned(layout.block_width) * to_unsigned(layout.interleaved() * layout.sample_bytes());
  const char* kind = layout.tiled ? "tile" : "strip";
  for (std::uint64_t i = 0; i < table.count; ++i) {
    if (table.count > kMostCheckedBlocks && i == kMostCheckedBlocks / 2) i = table.count - kMostCheckedBlocks / 2;
    const TiffBlockSpan span = handle.block_span(first + i);
    if (span.size_bytes == 0) {
      ++table.missing;
      continue;
    }
    const auto down = static_cast<std::int64_t>(i / to_unsigned(layout.blocks_across));
    const std::uint64_t decoded = row_bytes * to_unsigned(layout.stored_rows(down));
    // Writers may round a plain strip's size up; what counts is what its rows need.
    const std::uint64_t needed = layout.compression == 1 ? decoded : span.size_bytes;
    if (expansion == 1 && span.size_bytes < decoded) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} {} has {} bytes, its samples need {}", file.path(), kind, i,
                                                   span.size_bytes, decoded));
    }
    if (span.offset_bytes > file.size_bytes() || needed > file.size_bytes() - span.offset_bytes) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: truncated: {} {} of {} has {} bytes from byte {} on, the file has {} bytes in all",
                              file.path(), kind, i, table.count, needed, span.offset_bytes, file.size_bytes()));
    }
    if (expansion != 0 && decoded / expansion > span.size_bytes) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: {} {} has {} bytes ({}), which cannot hold its {} samples' {} bytes", file.path(),
                              kind, i, span.size_bytes, tiff_compression_name(layout.compression),
                              decoded / to_unsigned(layout.sample_bytes()), decoded));
    }
    table.largest_stored_bytes = std::max(table.largest_stored_bytes, span.size_bytes);
  }
  return table;
}

constexpr std::uint64_t kMiB = 1U << 20U;
/// Strips that decode to more are decoded row by row.
constexpr std::uint64_t kLargestBufferedStrip = 16 * kMiB;
/// Compressed strips beyond this are mapped instead of read.
constexpr std::uint64_t kLargestReadStrip = 64 * kMiB;
constexpr std::uint64_t kSmallestCache = 16 * kMiB;
constexpr std::uint64_t kLargestCache = 1024 * kMiB;
/// Bytes per pread when pixels are picked apart or rows are not contiguous.
constexpr std::uint64_t kChunk = 1 * kMiB;

template <typename Word>
void pick(const std::byte* pixels, std::byte* out, std::int64_t count, std::int64_t stride, std::int64_t first) {
  const std::byte* in = pixels + first * static_cast<std::int64_t>(sizeof(Word));
  for (std::int64_t i = 0; i < count; ++i) {
    std::memcpy(out + i * static_cast<std::int64_t>(sizeof(Word)),
                in + i * stride * static_cast<std::int64_t>(sizeof(Word)), sizeof(Word));
  }
}

}  // namespace

/// One entry of the cache: a block, or some rows of a large strip.
struct TiffBlocks::Unit {
  std::int64_t across = 0;
  std::int64_t down = 0;
  std::byte* bytes = nullptr;
  bool decoded = false;
  std::string error;  // in parallel decoding each unit keeps its own; the first in raster order is reported
  ErrorCode code = ErrorCode::kCorrupt;
};

TiffBlocks::TiffBlocks(const RawFile& file, const TiffLayout& layout, TiffMainImage image, int channel)
    : file_(file),
      layout_(layout),
      directory_(image.directories.main),
      channel_(channel),
      plane_(layout.separate ? channel : 0),
      sample_bytes_(static_cast<std::size_t>(layout.sample_bytes())),
      handles_(file, directory_) {
  const TiffBlockTable table = check_tiff_blocks(file_, layout_, plane_, *image.handle);
  block_count_ = table.count;
  missing_ = table.missing;
  map_strips_ = table.largest_stored_bytes > kLargestReadStrip;
  choose_mode(table.block_bytes);
  handles_.give_back(std::move(image.handle));
}

void TiffBlocks::choose_mode(std::uint64_t largest_block_bytes) {
  unit_rows_ = layout_.block_height;
  if (!layout_.tiled && layout_.plain()) {
    mode_ = Mode::kDirect;
    return;
  }
  const std::uint64_t unit_row_bytes = to_unsigned(layout_.block_width) * sample_bytes_;
  if (!layout_.tiled && largest_block_bytes > kLargestBufferedStrip) {
    mode_ = Mode::kRows;
    unit_rows_ = static_cast<std::int64_t>(std::max<std::uint64_t>(1, kChunk / unit_row_bytes));
    unit_rows_ = std::min(unit_rows_, layout_.height);
  }
  const std::uint64_t unit_bytes = unit_row_bytes * to_unsigned(unit_rows_);
  const std::uint64_t two_rows = 2 * unit_bytes * to_unsigned(layout_.blocks_across);
  const std::uint64_t bound = std::clamp(two_rows, kSmallestCache, std::max(kLargestCache, 2 * unit_bytes));
  cache_.emplace(unit_bytes, std::max<std::uint64_t>(2, bound / unit_bytes));
}

void TiffBlocks::limit_cache(std::uint64_t bytes) {
  if (cache_ && cache_bytes(bytes) < cache_bytes(UINT64_MAX)) {
    const std::size_t unit_bytes = cache_->block_bytes();
    cache_.emplace(unit_bytes, static_cast<std::size_t>(cache_bytes(bytes)) / unit_bytes);
  }
}

std::uint64_t TiffBlocks::cache_bytes(std::uint64_t limit) const {
  if (!cache_) return 0;
  const std::uint64_t all = std::uint64_t{cache_->capacity()} * cache_->block_bytes();
  if (mode_ == Mode::kRows) return all;
  const std::uint64_t units = std::max<std::uint64_t>(2, limit / cache_->block_bytes());
  return std::min(
      {all, units * cache_->block_bytes(), std::max<std::uint64_t>(2, block_count_) * cache_->block_bytes()});
}

void TiffBlocks::set_fill(std::span<const std::byte> sample) {
  ISOHF_ASSERT(sample.size() == sample_bytes_);
  std::copy(sample.begin(), sample.end(), fill_.begin());
}

void TiffBlocks::fill(std::byte* out, std::int64_t count) const {
  for (std::int64_t i = 0; i < count; ++i) {
    std::memcpy(out + to_unsigned(i) * sample_bytes_, fill_.data(), sample_bytes_);
  }
}

void TiffBlocks::pick_channel(const std::byte* pixels, std::byte* out, std::int64_t count) const {
  const std::int64_t stride = layout_.interleaved();
  const std::int64_t first = layout_.separate ? 0 : channel_;
  switch (sample_bytes_) {
    case 1:
      return pick<std::uint8_t>(pixels, out, count, stride, first);
    case 2:
      return pick<std::uint16_t>(pixels, out, count, stride, first);
    case 4:
      return pick<std::uint32_t>(pixels, out, count, stride, first);
    default:
      return pick<std::uint64_t>(pixels, out, count, stride, first);
  }
}

void TiffBlocks::read(const Window& window, std::span<std::byte> samples) {
  ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0);
  ISOHF_ASSERT(window.column + window.columns <= layout_.width && window.row + window.rows <= layout_.height);
  ISOHF_ASSERT(samples.size() == to_unsigned(window.columns * window.rows) * sample_bytes_);
  if (samples.empty()) return;
  mode_ == Mode::kDirect ? read_direct(window, samples) : read_units(window, samples);
}

// --- Plain strips
// -----------------------------------------------------------------------------------------------------

void TiffBlocks::read_direct(const Window& window, std::span<std::byte> samples) {
  const std::size_t out_row_bytes = to_unsigned(window.columns) * sample_bytes_;
  const std::int64_t end = window.row + window.rows;
  std::unique_ptr<TiffHandle> handle = handles_.take();
  for (std::int64_t row = window.row; row < end;) {
    const std::int64_t strip = row / layout_.block_height;
    const std::int64_t first = strip * layout_.block_height;
    const std::int64_t rows = std::min(end, first + layout_.block_height) - row;
    std::byte* out = samples.data() + to_unsigned(row - window.row) * out_row_bytes;
    const TiffBlockSpan span = handle->block_span(layout_.block_index(plane_, 0, strip));
    if (span.size_bytes == 0) {
      fill(out, rows * window.columns);
    } else {
      read_strip_rows({window.column, row, window.columns, rows}, span, row - first, out, handle->scratch);
    }
    row += rows;
  }
  handles_.give_back(std::move(handle));
}

void TiffBlocks::read_strip_rows(const Window& part, TiffBlockSpan strip, std::int64_t first_strip_row, std::byte* out,
                                 std::vector<std::byte>& scratch) {
  const std::uint64_t pixel_bytes = to_unsigned(layout_.interleaved()) * sample_bytes_;
  const std::uint64_t row_bytes = to_unsigned(layout_.width) * pixel_bytes;
  const std::uint64_t begin = strip.offset_bytes + to_unsigned(first_strip_row) * row_bytes;
  const bool whole_rows = part.columns == layout_.width;
  const std::size_t out_bytes = to_unsigned(part.columns * part.rows) * sample_bytes_;
  if (whole_rows && pixel_bytes == sample_bytes_) {
    file_.read(begin, {out, out_bytes});
  } else {
    // Whole rows go in chunks of many; parts of rows one by one, each in chunks of columns.
    const std::int64_t run = whole_rows ? part.columns * part.rows : part.columns;
    const auto chunk = static_cast<std::int64_t>(std::max<std::uint64_t>(1, kChunk / pixel_bytes));
    for (std::int64_t row = 0; row < (whole_rows ? 1 : part.rows); ++row) {
      const std::uint64_t at = begin + to_unsigned(row) * row_bytes + to_unsigned(part.column) * pixel_bytes;
      for (std::int64_t i = 0; i < run; i += chunk) {
        const std::int64_t count = std::min(chunk, run - i);
        scratch.resize(to_unsigned(count) * pixel_bytes);
        file_.read(at + to_unsigned(i) * pixel_bytes, scratch);
        pick_channel(scratch.data(), out + to_unsigned(row * run + i) * sample_bytes_, count);
      }
    }
  }
  if (layout_.big_endian) swap_byte_order({out, out_bytes}, sample_bytes_);
}

// --- Decoded blocks
// ---------------------------------------------------------------------------------------------------

void TiffBlocks::read_units(const Window& window, std::span<std::byte> samples) {
  const std::int64_t unit_columns = layout_.block_width;
  const std::int64_t across0 = window.column / unit_columns;
  const std::int64_t across1 = (window.column + window.columns - 1) / unit_columns;
  const std::int64_t down0 = window.row / unit_rows_;
  const std::int64_t down1 = (window.row + window.rows - 1) / unit_rows_;
  const auto batch = static_cast<std::int64_t>(cache_->capacity() / 2);
  const std::int64_t count = (across1 - across0 + 1) * (down1 - down0 + 1);
  std::vector<Unit> units;
  for (std::int64_t begin = 0; begin < count; begin += batch) {
    units.clear();
    for (std::int64_t i = begin; i < std::min(begin + batch, count); ++i) {
      Unit unit;
      unit.across = across0 + i % (across1 - across0 + 1);
      unit.down = down0 + i / (across1 - across0 + 1);
      unit.bytes = cache_->find(layout_.block_index(0, unit.across, unit.down));
      unit.decoded = unit.bytes != nullptr;
      units.push_back(std::move(unit));
    }
    // Claimed after all were found: at most half the cache is in use, so nothing of this batch is thrown out.
    for (Unit& unit : units) {
      if (!unit.decoded) unit.bytes = cache_->claim(layout_.block_index(0, unit.across, unit.down));
    }
    decode_units(units);
    for (const Unit& unit : units) {
      const std::int64_t left = std::max(window.column, unit.across * unit_columns);
      const std::int64_t right = std::min(window.column + window.columns, (unit.across + 1) * unit_columns);
      const std::int64_t top = std::max(window.row, unit.down * unit_rows_);
      const std::int64_t bottom = std::min(window.row + window.rows, (unit.down + 1) * unit_rows_);
      const std::size_t bytes = to_unsigned(right - left) * sample_bytes_;
      for (std::int64_t row = top; row < bottom; ++row) {
        const std::int64_t from = (row - unit.down * unit_rows_) * unit_columns + left - unit.across * unit_columns;
        const std::int64_t to = (row - window.row) * window.columns + left - window.column;
        std::memcpy(samples.data() + to_unsigned(to) * sample_bytes_, unit.bytes + to_unsigned(from) * sample_bytes_,
                    bytes);
      }
    }
  }
}

void TiffBlocks::decode_units(std::span<Unit> units) {
  try {
    if (mode_ == Mode::kRows) {
      for (const Unit& unit : units) {
        if (!unit.decoded) decode_rows(unit);
      }
      return;
    }
    std::vector<Unit*> missing;
    for (Unit& unit : units) {
      if (!unit.decoded) missing.push_back(&unit);
    }
    const auto decode = [&](std::size_t i) {
      Unit& unit = *missing[i];
      try {
        std::unique_ptr<TiffHandle> handle = handles_.take();
        decode_unit(unit, *handle);
        handles_.give_back(std::move(handle));
      } catch (const Error& error) {
        unit.error = error.what();
        unit.code = error.code();
      }
    };
    if (missing.size() == 1) {
      decode(0);
    } else if (!missing.empty()) {
      // Isolated: a thread that waits here does not start on unrelated work of the caller's.
      tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, missing.size(), decode); });
    }
    for (const Unit* unit : missing) {
      if (!unit->error.empty()) throw Error(unit->code, unit->error);
    }
  } catch (...) {
    cache_->clear();
    throw;
  }
}

void TiffBlocks::decode_unit(const Unit& unit, TiffHandle& handle) const {
  const std::uint64_t block = layout_.block_index(plane_, unit.across, unit.down);
  const std::int64_t rows = layout_.stored_rows(unit.down);
  const TiffBlockSpan span = handle.block_span(block);
  if (span.size_bytes == 0) return fill(unit.bytes, rows * layout_.block_width);
  const std::size_t plane_bytes = to_unsigned(rows * layout_.block_width) * sample_bytes_;
  const auto interleaved = to_unsigned(layout_.interleaved());
  std::span<std::byte> decoded = {unit.bytes, plane_bytes};
  if (interleaved > 1) {
    handle.scratch.resize(plane_bytes * interleaved);
    decoded = handle.scratch;
  }
  if (layout_.plain()) {
    file_.read(span.offset_bytes, decoded);
  } else {
    handle.decode_block(block, layout_.tiled, decoded);
  }
  if (interleaved > 1) pick_channel(decoded.data(), unit.bytes, rows * layout_.block_width);
  if (layout_.plain() && layout_.big_endian) swap_byte_order({unit.bytes, plane_bytes}, sample_bytes_);
}

// --- Large strips, row by row
// -----------------------------------------------------------------------------------------

void TiffBlocks::decode_rows(const Unit& unit) {
  const std::int64_t first = unit.down * unit_rows_;
  const std::int64_t end = std::min(first + unit_rows_, layout_.height);
  const std::size_t row_bytes = to_unsigned(layout_.width) * sample_bytes_;
  const auto interleaved = to_unsigned(layout_.interleaved());
  if (!in_order_) in_order_ = std::make_unique<TiffHandle>(file_, directory_, map_strips_);
  std::vector<std::byte>& pixels = in_order_->scratch;
  pixels.resize(row_bytes * interleaved);
  const std::int64_t strip_start = first / layout_.block_height * layout_.block_height;
  std::int64_t row = next_row_ >= strip_start && next_row_ <= first ? next_row_ : strip_start;
  next_row_ = -1;
  for (; row < end; ++row) {
    std::byte* out = row < first ? nullptr : unit.bytes + to_unsigned(row - first) * row_bytes;
    const std::int64_t strip = row / layout_.block_height;
    const bool stored = in_order_->block_span(layout_.block_index(plane_, 0, strip)).size_bytes != 0;
    if (!stored) {
      if (out != nullptr) fill(out, layout_.width);
      continue;
    }
    try {
      in_order_->decode_row(row, plane_, pixels);
    } catch (...) {
      in_order_.reset();
      throw;
    }
    if (out != nullptr) pick_channel(pixels.data(), out, layout_.width);
    since_forgotten_bytes_ += pixels.size();
    if (since_forgotten_bytes_ > kLargestBufferedStrip) {
      in_order_->forget_mapped();
      since_forgotten_bytes_ = 0;
    }
  }
  next_row_ = end;
}

std::unique_ptr<TiffHandle> TiffHandlePool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<TiffHandle> handle = std::move(idle_.back());
      idle_.pop_back();
      return handle;
    }
  }
  return std::make_unique<TiffHandle>(*file_, directory_, false);
}

void TiffHandlePool::give_back(std::unique_ptr<TiffHandle> handle) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(handle));
}

}  // namespace isohf
