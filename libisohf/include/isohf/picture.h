// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isohf {

/// A picture of 8-bit sRGB samples, row by row from the top, channels interleaved: 1 grey, 3 RGB, 4 RGBA with straight
/// alpha.
struct Picture {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> samples;  ///< [width * height * channels]

  Picture() = default;
  Picture(int columns, int rows, int channel_count)
      : width(columns),
        height(rows),
        channels(channel_count),
        samples(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
                static_cast<std::size_t>(channel_count)) {}

  [[nodiscard]] std::size_t row_bytes() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  }
  [[nodiscard]] const std::uint8_t* row(int r) const {
    return samples.data() + static_cast<std::size_t>(r) * row_bytes();
  }
  [[nodiscard]] std::uint8_t* row(int r) { return samples.data() + static_cast<std::size_t>(r) * row_bytes(); }
  /// The first channel of a pixel.
  [[nodiscard]] const std::uint8_t* pixel(int column, int r) const {
    return row(r) + static_cast<std::size_t>(column) * static_cast<std::size_t>(channels);
  }
  friend bool operator==(const Picture&, const Picture&) = default;
};

}  // namespace isohf
