#include "isohf/sampling/source/source_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace isohf::test {
namespace {

constexpr std::size_t kCount = 9001;  // two whole runs and a part of one

template <typename T>
std::vector<T> random_samples() {
  std::mt19937 random(5);
  std::vector<T> samples(kCount);
  for (T& sample : samples) sample = static_cast<T>(random());
  samples[3] = std::numeric_limits<T>::max();
  samples[4] = std::numeric_limits<T>::lowest();
  return samples;
}

/// One sample after the other, of integers small enough that doubles hold every sum.
template <typename T>
double plain_sum(const SourceInfo& info, const std::vector<T>& samples) {
  double total = 0.0;
  for (const T sample : samples) {
    const auto number = static_cast<double>(sample);
    bool is_valid = number >= info.valid_min && number <= info.valid_max;
    for (const double value : info.void_values) is_valid = is_valid && number != value;
    if (is_valid) total += number;
  }
  return total;
}

template <typename T>
void expect_sums(SampleType type) {
  const std::vector<T> samples = random_samples<T>();
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<std::vector<double>> voids = {{}, {static_cast<double>(samples[0])}, {1e9}, {-0.5}, {NAN}, {7, 9}};
  const std::vector<std::pair<double, double>> bounds = {{-inf, inf}, {-20.5, 100.5}, {10.25, 10.75}, {-1e38, 1e38},
                                                         {1e6, 2e6},  {-2e6, -1e6},   {50, 40}};
  for (const auto& void_values : voids) {
    for (const auto& [low, high] : bounds) {
      SourceInfo info;
      info.sample_type = type;
      info.void_values = void_values;
      info.valid_min = low;
      info.valid_max = high;
      EXPECT_EQ(sum_of_samples(info, std::as_bytes(std::span(samples))), plain_sum(info, samples))
          << to_string(type) << ", valid " << low << " to " << high << ", " << void_values.size() << " void values";
    }
  }
}

TEST(SourceScan, SumsSmallIntegersWithoutRounding) {
  expect_sums<std::uint8_t>(SampleType::kUint8);
  expect_sums<std::int8_t>(SampleType::kInt8);
  expect_sums<std::uint16_t>(SampleType::kUint16);
  expect_sums<std::int16_t>(SampleType::kInt16);
}

TEST(SourceScan, SumsARunOfTheLargestSamples) {
  const std::vector<std::uint16_t> samples(2 * 4096, 65535);
  SourceInfo info;
  info.sample_type = SampleType::kUint16;
  EXPECT_EQ(sum_of_samples(info, std::as_bytes(std::span(samples))), 2.0 * 4096 * 65535);
}

}  // namespace
}  // namespace isohf::test
