#include "isohf/base/sample.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

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

TEST(HalfFromDouble, RoundsTiesToEvenAndKeepsNansAndInfinities) {
  for (unsigned bits = 0; bits < 0x10000U; ++bits) {
    const float value = float_from_half(static_cast<std::uint16_t>(bits));
    if (std::isnan(value)) continue;
    ASSERT_EQ(half_from_double(double{value}), bits);
  }
  for (unsigned bits = 0; bits < 0x7BFFU; ++bits) {
    const double low = double{float_from_half(static_cast<std::uint16_t>(bits))};
    const double high = double{float_from_half(static_cast<std::uint16_t>(bits + 1))};
    ASSERT_EQ(half_from_double((low + high) / 2.0), bits + bits % 2) << bits;
    ASSERT_EQ(half_from_double(-(low + high) / 2.0), 0x8000U + bits + bits % 2) << bits;
  }
  EXPECT_EQ(half_from_double(65519.9), 0x7BFF);
  EXPECT_EQ(half_from_double(65520.0), 0x7C00);
  EXPECT_EQ(half_from_double(-HUGE_VAL), 0xFC00);
  EXPECT_TRUE(std::isnan(float_from_half(half_from_double(std::nan("")))));
}

TEST(RoundedSample, IsNothingBeyondTheType) {
  EXPECT_EQ(rounded_sample(SampleType::kUint8, 2.5), 3.0);
  EXPECT_EQ(rounded_sample(SampleType::kUint8, -0.5), 0.0);
  EXPECT_EQ(rounded_sample(SampleType::kUint8, -0.6), std::nullopt);
  EXPECT_EQ(rounded_sample(SampleType::kUint8, 255.5), std::nullopt);
  EXPECT_EQ(rounded_sample(SampleType::kFloat16, 65519.0), 65504.0);
  EXPECT_EQ(rounded_sample(SampleType::kFloat16, 65520.0), std::nullopt);
  EXPECT_EQ(rounded_sample(SampleType::kFloat32, 1e39), std::nullopt);
  EXPECT_EQ(rounded_sample(SampleType::kFloat32, std::nan("")), std::nullopt);
}

TEST(SampleRange, IsWhatTheTypeHolds) {
  EXPECT_EQ(sample_range(SampleType::kInt16), std::pair(-32768.0, 32767.0));
  EXPECT_EQ(sample_range(SampleType::kFloat16), std::pair(-65504.0, 65504.0));
  EXPECT_EQ(sample_range(SampleType::kFloat32).second, double{std::numeric_limits<float>::max()});
}

}  // namespace
}  // namespace isohf::test
