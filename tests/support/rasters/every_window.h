#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "support/rasters/samples.h"

namespace isohf::test {

/// The samples of a raster of type T, as a reader delivers them.
template <typename T, typename ValueAt>
std::vector<std::byte> stored(std::int64_t width, std::int64_t height, const ValueAt& value_at) {
  std::vector<T> samples;
  for (std::int64_t r = 0; r < height; ++r) {
    for (std::int64_t c = 0; c < width; ++c) samples.push_back(static_cast<T>(value_at(c, r)));
  }
  const auto bytes = std::as_bytes(std::span(samples));
  return {bytes.begin(), bytes.end()};
}

/// Reads every window of a small source, the last rows first, and holds it against the samples that it must have.
inline void expect_every_window(HeightSource& source, std::span<const std::byte> whole) {
  const std::int64_t width = source.info().width;
  const std::int64_t height = source.info().height;
  const std::size_t size = size_bytes(source.info().sample_type);
  ASSERT_EQ(whole.size(), static_cast<std::size_t>(width * height) * size);
  for (std::int64_t row = height - 1; row >= 0; --row) {
    for (std::int64_t rows = 1; rows <= height - row; ++rows) {
      for (std::int64_t column = 0; column < width; ++column) {
        for (std::int64_t columns = 1; columns <= width - column; ++columns) {
          const auto part = read_window(source, {column, row, columns, rows});
          const std::size_t row_bytes = static_cast<std::size_t>(columns) * size;
          for (std::int64_t r = 0; r < rows; ++r) {
            const auto wanted = whole.subspan(static_cast<std::size_t>((row + r) * width + column) * size, row_bytes);
            ASSERT_TRUE(std::equal(wanted.begin(), wanted.end(), part.begin() + r * std::ssize(wanted)))
                << "row " << r << " of " << columns << " x " << rows << " at " << column << ", " << row;
          }
        }
      }
    }
  }
}

}  // namespace isohf::test
