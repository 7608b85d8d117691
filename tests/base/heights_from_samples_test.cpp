/// heights_from_samples against its definition, one sample at a time in doubles.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "isohf/base/sample.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr SampleType kTypes[] = {SampleType::kUint8,   SampleType::kInt8,    SampleType::kUint16,
                                 SampleType::kInt16,   SampleType::kUint32,  SampleType::kInt32,
                                 SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};

/// Samples of any bits, and among them the values given where the type has them.
std::vector<std::byte> make_samples(SampleType type, std::size_t count, const std::vector<double>& among) {
  std::mt19937 random(static_cast<std::uint32_t>(count));
  std::vector<std::byte> raw(count * size_bytes(type));
  for (std::byte& byte : raw) byte = static_cast<std::byte>(random());
  for (std::size_t i = 0; i < count; ++i) {
    const double value = among[i % among.size()];
    if (i % 3 != 0 || std::isnan(value) || nearest_sample(type, value) != value) continue;
    store_sample(type)(value, raw.data() + i * size_bytes(type));
  }
  return raw;
}

float height_of(const SourceInfo& info, double datum, double raw) {
  bool is_void = !std::isfinite(raw) || raw < info.valid_min || raw > info.valid_max;
  for (const double value : info.void_values) is_void = is_void || raw == value;
  EXPECT_EQ(info.is_nodata(raw), is_void) << raw;
  const double offset = info.z_offset - datum;
  const auto height = static_cast<float>(info.z_scale == 1.0 && offset == 0.0 ? raw : raw * info.z_scale + offset);
  return is_void || !std::isfinite(height) ? std::numeric_limits<float>::quiet_NaN() : height;
}

void check(const SourceInfo& info, double datum) {
  std::vector<double> among = info.void_values;
  among.insert(among.end(), {info.valid_min, info.valid_max, 0.0, 1.0, 255.0, 40000.0});
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{17}, std::size_t{1000}}) {
    const std::vector<std::byte> raw = make_samples(info.sample_type, count, among);
    std::vector<float> heights(count);
    heights_from_samples(info, datum, raw, heights);
    for (std::size_t i = 0; i < count; ++i) {
      const double sample = load_sample(info.sample_type)(raw.data() + i * size_bytes(info.sample_type));
      ASSERT_EQ(std::bit_cast<std::uint32_t>(heights[i]), std::bit_cast<std::uint32_t>(height_of(info, datum, sample)))
          << to_string(info.sample_type) << " " << sample << " at " << i << ", range " << info.valid_min << ".."
          << info.valid_max;
    }
  }
}

TEST(HeightsFromSamples, MakesVoidsOfVoidValues) {
  for (const SampleType type : kTypes) {
    SourceInfo info;
    info.sample_type = type;
    for (const std::vector<double>& values : std::vector<std::vector<double>>{{},
                                                                              {-32768.0},
                                                                              {255.0},
                                                                              {-9999.0, 0.0, 1.0},
                                                                              {0.5},
                                                                              {1e10, -1e10},
                                                                              {kNan},
                                                                              {kInfinity, -kInfinity},
                                                                              {4294967295.0},
                                                                              {4294967296.0},
                                                                              {-2147483649.0},
                                                                              {-3.4028234663852886e38},
                                                                              {1e-300}}) {
      info.void_values = values;
      info.z_scale = 1.0;
      check(info, 0.0);
      check(info, 1000.0);
      info.z_scale = 0.1;
      check(info, 0.0);
    }
  }
}

TEST(HeightsFromSamples, MakesVoidsOfWhatLiesOutsideTheValidRange) {
  for (const SampleType type : kTypes) {
    SourceInfo info;
    info.sample_type = type;
    for (const auto& [low, high] : std::vector<std::pair<double, double>>{{0.0, 255.0},
                                                                          {0.5, 100.5},
                                                                          {-1e10, 12.0},
                                                                          {-kInfinity, 40000.0},
                                                                          {1.0, kInfinity},
                                                                          {0.1, 0.2},
                                                                          {5e9, 6e9},
                                                                          {-6e9, -5e9},
                                                                          {7.0, 3.0},
                                                                          {1e300, kInfinity},
                                                                          {127.0, 4294967295.5}}) {
      info.valid_min = low;
      info.valid_max = high;
      info.void_values = {};
      check(info, 0.0);
      info.void_values = {100.0, 40000.0};
      check(info, 3.0);
    }
  }
}

}  // namespace
}  // namespace isohf
