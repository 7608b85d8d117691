#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <vector>

#include "isohf/picture.h"

namespace isohf::test {

/// A photo held in memory. Counts the pixels that are read of it.
class MemoryPhoto final : public PhotoSource {
 public:
  MemoryPhoto(std::int64_t width, std::int64_t height, int channels,
              const std::function<int(std::int64_t column, std::int64_t row, int channel)>& sample)
      : samples_(static_cast<std::size_t>(width * height * channels)) {
    info_.path = "photo";
    info_.format = "memory";
    info_.width = width;
    info_.height = height;
    info_.channels = channels;
    info_.random_access = true;
    info_.pixel_bytes = static_cast<std::uint64_t>(channels);
    std::size_t i = 0;
    for (std::int64_t row = 0; row < height; ++row) {
      for (std::int64_t column = 0; column < width; ++column) {
        for (int c = 0; c < channels; ++c) samples_[i++] = static_cast<std::uint8_t>(sample(column, row, c));
      }
    }
  }

  [[nodiscard]] const PhotoInfo& info() const override { return info_; }
  [[nodiscard]] PhotoInfo& mutable_info() { return info_; }
  void set_cache_bytes(std::uint64_t bytes) override { cache_bytes = bytes; }

  void read_window(const Window& window, std::span<std::uint8_t> out) override {
    auto to = out.begin();
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      const auto from = samples_.begin() + (row * info_.width + window.column) * info_.channels;
      to = std::copy(from, from + window.columns * info_.channels, to);
    }
    pixels_read += window.columns * window.rows;
  }

  /// Column and row are moved to the border where they lie outside.
  [[nodiscard]] int at(std::int64_t column, std::int64_t row, int channel) const {
    column = std::clamp<std::int64_t>(column, 0, info_.width - 1);
    row = std::clamp<std::int64_t>(row, 0, info_.height - 1);
    return samples_[static_cast<std::size_t>((row * info_.width + column) * info_.channels + channel)];
  }

  std::atomic<std::int64_t> pixels_read = 0;
  std::uint64_t cache_bytes = 0;

 private:
  PhotoInfo info_;
  std::vector<std::uint8_t> samples_;
};

/// Noise of 0...255 from a place; the same on every machine.
inline int noise(std::int64_t column, std::int64_t row, int channel) {
  auto x = static_cast<std::uint64_t>(column * 7349 + row * 104729 + channel * 31 + 17);
  x ^= x >> 12U;
  x *= 0x9E3779B97F4A7C15U;
  return static_cast<int>((x >> 40U) & 255U);
}

inline std::vector<std::uint8_t> window_of(PhotoSource& photo, const Window& window) {
  std::vector<std::uint8_t> samples(static_cast<std::size_t>(window.columns * window.rows * photo.info().channels));
  photo.read_window(window, samples);
  return samples;
}

/// The photo is that noise, in each of these windows.
inline void expect_noise(PhotoSource& photo, std::initializer_list<Window> windows) {
  for (const Window& window : windows) {
    const auto samples = window_of(photo, window);
    std::size_t i = 0;
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      for (std::int64_t column = window.column; column < window.column + window.columns; ++column) {
        for (int c = 0; c < photo.info().channels; ++c)
          ASSERT_EQ(samples[i++], noise(column, row, c)) << column << " " << row;
      }
    }
  }
}

}  // namespace isohf::test
