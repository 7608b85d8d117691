#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "isohf/raster.h"

/// Rasters that are stored from South to North, which are delivered from North to South.

namespace isohf {

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
