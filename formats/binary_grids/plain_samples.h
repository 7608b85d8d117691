#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/files/file_source.h"
#include "isohf/raster.h"

namespace isohf {

/// Where the samples of an uncompressed raster lie in its file: rows from North to South at equal distances.
struct PlainLayout {
  std::uint64_t offset_bytes = 0;  ///< of the first sample
  std::uint64_t row_bytes = 0;     ///< from a row's first sample to the next row's
  bool big_endian = false;
};

/// Reads `window` of the raster that `info` and `layout` describe, in host byte order. Throws Error{kIo, kCorrupt}.
inline void read_plain_samples(const RawFile& file, const SourceInfo& info, const PlainLayout& layout,
                               const Window& window, std::span<std::byte> samples) {
  const std::size_t size = size_bytes(info.sample_type);
  ISOHF_ASSERT(is_window_of(info, window, samples.size()));
  const std::size_t run_bytes = static_cast<std::size_t>(window.columns) * size;
  const std::uint64_t first = layout.offset_bytes + static_cast<std::uint64_t>(window.row) * layout.row_bytes +
                              static_cast<std::uint64_t>(window.column) * size;
  if (run_bytes == layout.row_bytes) {  // whole rows lie together in the file as in the window
    file.read(first, samples);
  } else {
    for (std::int64_t row = 0; row < window.rows; ++row) {
      file.read(first + static_cast<std::uint64_t>(row) * layout.row_bytes,
                samples.subspan(static_cast<std::size_t>(row) * run_bytes, run_bytes));
    }
  }
  if (layout.big_endian != (std::endian::native == std::endian::big)) swap_byte_order(samples, size);
}

/// A raster of nothing but such samples, behind a header perhaps.
class PlainSource : public FileSource {
 public:
  void read_window(const Window& window, std::span<std::byte> samples) override {
    read_plain_samples(*file_, info_, layout_, window, samples);
  }

 protected:
  using FileSource::FileSource;

  PlainLayout layout_;
};

// Rasters that are stored from South to North, which are delivered from North to South.

/// The rows of `window` as they are stored, of a raster of `height` rows.
[[nodiscard]] inline Window turned(const Window& window, std::int64_t height) {
  return {window.column, height - window.row - window.rows, window.columns, window.rows};
}

/// Turns rows of row_bytes each upside down.
inline void turn_rows(std::span<std::byte> samples, std::size_t row_bytes) {
  const std::size_t rows = row_bytes == 0 ? 0 : samples.size() / row_bytes;
  for (std::size_t row = 0; row < rows / 2; ++row) {
    std::byte* const upper = samples.data() + row * row_bytes;
    std::swap_ranges(upper, upper + row_bytes, samples.data() + (rows - 1 - row) * row_bytes);
  }
}

}  // namespace isohf
