#include "isohf/sampling/source/read_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>

namespace isohf {
namespace {

/// 16-bit samples in blocks; counts how often each block is read and refuses windows that cut one.
class BlockSource : public HeightSource {
 public:
  BlockSource(std::int64_t width, std::int64_t height, std::int64_t block_width, std::int64_t block_height) {
    info_.width = width;
    info_.height = height;
    info_.sample_type = SampleType::kUint16;
    info_.block_width = block_width;
    info_.block_height = block_height;
  }

  static std::uint16_t sample(std::int64_t column, std::int64_t row) {
    return static_cast<std::uint16_t>(column * 31 + row * 1009);
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const auto whole = [](std::int64_t first, std::int64_t count, std::int64_t block, std::int64_t size) {
      return first % block == 0 && ((first + count) % block == 0 || first + count == size);
    };
    EXPECT_TRUE(whole(window.column, window.columns, info_.block_width, info_.width)) << window.column;
    EXPECT_TRUE(whole(window.row, window.rows, info_.block_height, info_.height)) << window.row;
    std::byte* out = samples.data();
    for (std::int64_t r = window.row; r < window.row + window.rows; ++r) {
      for (std::int64_t c = window.column; c < window.column + window.columns; ++c, out += 2) {
        const std::uint16_t value = sample(c, r);
        std::memcpy(out, &value, 2);
        ++reads[{c, r}];
      }
    }
    largest = std::max<std::uint64_t>(largest, samples.size());
  }

  std::map<std::pair<std::int64_t, std::int64_t>, int> reads;
  std::uint64_t largest = 0;

 private:
  SourceInfo info_;
};

TEST(ReadStep, WindowsAreWholeBlocksAndCoverARasterOnce) {
  for (const auto& [block_width, block_height] :
       {std::pair<std::int64_t, std::int64_t>{500, 1}, {500, 7}, {16, 16}, {64, 32}, {333, 5}, {3, 200}, {500, 90}}) {
    for (const std::uint64_t bytes : {1U, 1000U, 5000U, 40000U, 1000000U}) {
      BlockSource source(500, 90, block_width, block_height);
      const ReadStep step = ReadStep::make(source.info(), bytes);
      // A strip that is larger than a read is read in part; its reader keeps what it has decoded.
      const bool in_part = block_width == 500 && bytes < 1000U * static_cast<std::uint64_t>(block_height);
      if (in_part) {
        EXPECT_EQ(step.columns, 500);
        EXPECT_LE(step.rows, std::max<std::int64_t>(1, static_cast<std::int64_t>(bytes) / 1000));
        continue;
      }
      std::vector<std::byte> raw;
      for (std::int64_t row = 0; row < 90; row += step.rows) {
        for (const Window& window : step.windows(source.info(), row)) {
          EXPECT_EQ(window.row, row);
          raw.resize(static_cast<std::size_t>(window.columns * window.rows) * 2);
          source.read_window(window, raw);
        }
      }
      EXPECT_EQ(source.reads.size(), 500U * 90U);
      for (const auto& [place, count] : source.reads) ASSERT_EQ(count, 1) << place.first << " " << place.second;
      EXPECT_LE(source.largest, step.most_bytes(source.info()));
    }
  }
}

}  // namespace
}  // namespace isohf
