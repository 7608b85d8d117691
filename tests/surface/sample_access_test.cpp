#include "isohf/surface/source/sample_access.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace isohf::test {
namespace {

double half_from_bits(std::uint16_t bits) {
  return load_sample(SampleType::kFloat16)(reinterpret_cast<const std::byte*>(&bits));
}

TEST(SampleAccess, EveryHalfComesBack) {
  for (unsigned bits = 0; bits < 0x10000U; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const double value = half_from_bits(half);
    if (!std::isfinite(value)) continue;
    ASSERT_EQ(nearest_sample(SampleType::kFloat16, value), value) << bits;
    std::uint16_t stored = 0;
    store_sample(SampleType::kFloat16)(value, reinterpret_cast<std::byte*>(&stored));
    ASSERT_EQ(stored, half);
  }
}

TEST(SampleAccess, HalvesFollowEachOther) {
  // From the smallest to the largest, neighbours in bits are neighbours in size.
  for (std::uint16_t bits = 0; bits < 0x7BFFU; ++bits) {
    const double value = half_from_bits(bits);
    const double above = half_from_bits(static_cast<std::uint16_t>(bits + 1));
    ASSERT_EQ(next_sample(SampleType::kFloat16, value), above) << bits;
    ASSERT_EQ(previous_sample(SampleType::kFloat16, above), value) << bits;
    ASSERT_EQ(previous_sample(SampleType::kFloat16, -value), -above) << bits;
    ASSERT_EQ(next_sample(SampleType::kFloat16, -above), -value) << bits;
    // What lies between goes to the nearer one.
    ASSERT_EQ(nearest_sample(SampleType::kFloat16, value + 0.4 * (above - value)), value) << bits;
    ASSERT_EQ(nearest_sample(SampleType::kFloat16, value + 0.6 * (above - value)), above) << bits;
    ASSERT_EQ(nearest_sample(SampleType::kFloat16, -value - 0.6 * (above - value)), -above) << bits;
  }
  EXPECT_EQ(nearest_sample(SampleType::kFloat16, 1e9), 65504.0);
}

TEST(SampleAccess, IntegersRoundAndStopAtTheirEnds) {
  EXPECT_EQ(nearest_sample(SampleType::kInt16, -0.5), 0.0);
  EXPECT_EQ(nearest_sample(SampleType::kInt16, 2.5), 3.0);
  EXPECT_EQ(nearest_sample(SampleType::kInt16, -40000.0), -32768.0);
  EXPECT_EQ(nearest_sample(SampleType::kUint32, 1e12), 4294967295.0);
  EXPECT_EQ(next_sample(SampleType::kUint8, 255.0), 255.0);
  EXPECT_EQ(previous_sample(SampleType::kUint8, 0.0), 0.0);
  EXPECT_EQ(previous_sample(SampleType::kInt32, 0.0), -1.0);
}

TEST(SampleAccess, FloatsTakeTheNearest) {
  EXPECT_EQ(nearest_sample(SampleType::kFloat32, 0.1), static_cast<double>(0.1F));
  EXPECT_EQ(nearest_sample(SampleType::kFloat64, 0.1), 0.1);
  EXPECT_EQ(next_sample(SampleType::kFloat32, 1.0), 1.0 + 0x1p-23);
  EXPECT_EQ(previous_sample(SampleType::kFloat64, 1.0), 1.0 - 0x1p-53);
}

}  // namespace
}  // namespace isohf::test
