#include "isohf/verify/accuracy/plain_coding.h"

#include <gtest/gtest.h>

#include <vector>

#include "isohf/archive/deflate/deflate.h"

namespace isohf {
namespace {

std::uint64_t deflated(const std::vector<int>& values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value & 0xff));
  return deflate_bytes(bytes, 6).size();
}

TEST(PlainCoding, CodesAreDifferencesAlongRowsOfAnyWidth) {
  TileCodes samples;
  samples.codes = {1000, 1001, 999, 5, 5};  // rows of 3 and 2
  EXPECT_EQ(plainly_coded_bytes(samples, std::vector<std::int64_t>{3, 2}),
            deflated({1000 & 0xff, 1000 >> 8, 1, 0, 0xfe, 0xff, 5, 0, 0, 0}));
  samples.type = CodeType::kU8;
  samples.codes = {10, 7, 200};
  EXPECT_EQ(plainly_coded_bytes(samples, std::vector<std::int64_t>{3}), deflated({10, -3, 193}));
}

TEST(PlainCoding, FloatsAreDifferencesOfBytePlanes) {
  TileCodes samples;
  samples.type = CodeType::kF32;
  samples.heights = {1.0F, 2.0F};  // 3f800000, 40000000
  EXPECT_EQ(plainly_coded_bytes(samples, std::vector<std::int64_t>{2}),
            deflated({0x3f, 0x01, 0x80 - 0x40, -0x80, 0, 0, 0, 0}));
}

TEST(PlainCoding, RampsTakeLessThanNoise) {
  TileCodes ramp;
  TileCodes noise;
  std::uint32_t state = 1;
  for (std::uint32_t i = 0; i < 10000; ++i) {
    ramp.codes.push_back(static_cast<std::uint16_t>(3 * (i % 100)));
    state = state * 1664525U + 1013904223U;
    noise.codes.push_back(static_cast<std::uint16_t>(state >> 16U));
  }
  const std::vector<std::int64_t> widths(100, 100);
  EXPECT_LT(plainly_coded_bytes(ramp, widths), 500U);
  EXPECT_GT(plainly_coded_bytes(noise, widths), 19000U);
}

}  // namespace
}  // namespace isohf
