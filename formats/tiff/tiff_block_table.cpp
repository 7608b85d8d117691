#include "formats/tiff/tiff_block_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <string>

#include "isohf/error.h"

namespace isohf {
namespace {

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

}  // namespace

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

}  // namespace isohf
