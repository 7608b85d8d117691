#pragma once

#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "isohf/raster.h"

namespace isohf::test {

/// A source held in memory, sample type T, that counts what is read of it.
template <typename T>
class MemorySource : public HeightSource {
 public:
  MemorySource(SampleType type, std::int64_t width, std::int64_t height,
               const std::function<double(std::int64_t column, std::int64_t row)>& sample)
      : samples_(static_cast<std::size_t>(width * height)) {
    info_.path = "memory";
    info_.format = "memory";
    info_.width = width;
    info_.height = height;
    info_.sample_type = type;
    info_.block_width = width;
    for (std::int64_t row = 0; row < height; ++row) {
      for (std::int64_t column = 0; column < width; ++column) at(column, row) = static_cast<T>(sample(column, row));
    }
  }

  [[nodiscard]] SourceInfo& mutable_info() { return info_; }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  T& at(std::int64_t column, std::int64_t row) {
    return samples_[static_cast<std::size_t>(row * info_.width + column)];
  }

  [[nodiscard]] const std::vector<T>& samples() const { return samples_; }

  void read_window(const Window& window, std::span<std::byte> out) override {
    const auto row_bytes = static_cast<std::size_t>(window.columns) * sizeof(T);
    for (std::int64_t r = 0; r < window.rows; ++r) {
      std::memcpy(out.data() + static_cast<std::size_t>(r) * row_bytes, &at(window.column, window.row + r), row_bytes);
    }
    rows_read += window.rows;
  }

  std::int64_t rows_read = 0;

 private:
  SourceInfo info_;
  std::vector<T> samples_;
};

}  // namespace isohf::test
