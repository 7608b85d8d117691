#include "isohf/sampling/source/source_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <utility>
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

/// Land of 40 x 40 samples with `values` in its first places.
std::vector<float> land_with(const std::vector<float>& values, const std::function<float(int)>& land) {
  std::vector<float> samples;
  for (int i = 0; i < 1600; ++i) samples.push_back(land(i));
  std::ranges::copy(values, samples.begin());
  return samples;
}

TEST(SourceSurvey, FindsValuesFarFromAllOthersInAnyPartsAndOrder) {
  const auto hills = [](int i) { return 300.0F + static_cast<float>(i * 7 % 1501); };
  const auto plain = [](int) { return 5.0F; };
  const auto cliff = [](int i) { return i % 3 == 0 ? 0.0F : 400.0F + static_cast<float>(i % 100); };
  struct Case {
    std::vector<float> values;
    std::function<float(int)> land;
    std::vector<std::pair<double, std::int64_t>> found;
  };
  const std::vector<Case> cases = {{{}, hills, {}},
                                   {{}, plain, {}},
                                   {{}, cliff, {}},
                                   {{1e20F, 1e20F}, hills, {{1e20F, 2}}},
                                   {{-1e10F}, hills, {{-1e10F, 1}}},
                                   {{-1e6F, -1e6F, -1e6F}, hills, {{-1e6, 3}}},
                                   {{1e10F}, plain, {{1e10F, 1}}},
                                   {{-9999, 1e10F, -9999, -32768}, hills, {{-32768, 1}, {-9999, 2}, {1e10F, 1}}},
                                   {{-3.4e38F, 9999}, hills, {{-3.4e38F, 1}, {9999, 1}}},
                                   {{9999, 32767}, hills, {{9999, 1}, {32767, 1}}},
                                   {{8849, -430}, hills, {}},  // on the Earth
                                   {{16000}, hills, {}},       // a spike, perhaps, but not ten times as far
                                   {{-2000, -9999}, hills, {{-9999, 1}}}};
  SourceInfo info;
  info.sample_type = SampleType::kFloat32;
  for (const Case& each : cases) {
    const std::vector<float> samples = land_with(each.values, each.land);
    for (const std::size_t part : {std::size_t{1600}, std::size_t{400}, std::size_t{7}, std::size_t{1}}) {
      for (const bool backwards : {false, true}) {
        std::vector<SourceSurvey> surveys;
        for (std::size_t at = 0; at < samples.size(); at += part) {
          surveys.emplace_back(info, false)
              .add(std::as_bytes(std::span(samples)).subspan(4 * at, 4 * std::min(part, samples.size() - at)));
        }
        if (backwards) std::ranges::reverse(surveys);
        for (std::size_t i = 1; i < surveys.size(); ++i) surveys[0].add(surveys[i]);
        std::vector<std::pair<double, std::int64_t>> found;
        const SourceSurvey::Outliers outliers = surveys[0].outliers();
        for (const UndeclaredVoid& value : outliers.voids) found.emplace_back(value.value, value.count);
        EXPECT_EQ(found, each.found) << "parts of " << part;
        EXPECT_EQ(surveys[0].warning().empty(), each.found.empty());
        EXPECT_EQ(surveys[0].scan().valid, 1600);
      }
    }
  }
}

}  // namespace
}  // namespace isohf::test
