#include "isohf/sampling/resample/kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::array<Filter, 4> kAll = {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

/// Positions over several samples, integers and halves among them.
std::vector<double> positions() {
  std::vector<double> u;
  for (int i = -3 * 96; i <= 5 * 96; ++i) u.push_back(i / 96.0);
  u.push_back(std::nextafter(2.0, 0.0));
  u.push_back(std::nextafter(0.5, 0.0));
  u.push_back(-std::numeric_limits<double>::min());
  u.push_back(std::numeric_limits<double>::min());
  u.push_back(1e6 + 1.0 / 3.0);
  return u;
}

double weighted(const Kernel& kernel, double u, int power) {
  const TapWeights taps = kernel.at(u);
  double sum = 0.0;
  for (int i = 0; i < kernel.taps(); ++i) {
    sum += static_cast<double>(taps.weights[static_cast<std::size_t>(i)]) *
           std::pow(static_cast<double>(taps.first + i) - u, power);
  }
  return sum;
}

TEST(Filter, NamesRoundTripAndOthersAreRefused) {
  for (const Filter filter : kAll) EXPECT_EQ(filter_from_string(to_string(filter)), filter);
  for (const char* text : {"", "Bilinear", "bspline4", "bspline3 ", "lanczos3"}) {
    EXPECT_THROW((void)filter_from_string(text), Error) << text;
  }
}

TEST(Kernel, WeightsSumToOneAroundThePositionAreZeroBeyondTheTapsAndTheKernelsValues) {
  for (const Filter filter : kAll) {
    const Kernel kernel = Kernel::make(filter);
    for (const double u : positions()) {
      SCOPED_TRACE(testing::Message() << to_string(filter) << " " << u);
      // Each of up to 4 weights, at most 1 in size, is off by at most half a unit of its last place: 4 * 2^-25.
      EXPECT_NEAR(weighted(kernel, u, 0), 1.0, 1.2e-7);
      const TapWeights taps = kernel.at(u);
      const auto first = static_cast<double>(taps.first);
      EXPECT_LE(u - first, kernel.support() + 0.5 * (kernel.taps() - 1));
      EXPECT_LE(std::abs(u - (first + 0.5 * (kernel.taps() - 1))), 0.5);
      for (int i = 0; i < kMaxTaps; ++i) {
        const float weight = taps.weights[static_cast<std::size_t>(i)];
        if (i >= kernel.taps()) {
          EXPECT_EQ(weight, 0.0F);
        } else if (std::abs(u) <= 100.0) {
          EXPECT_NEAR(kernel.value(u - static_cast<double>(taps.first + i)), weight, 1e-7);
        }
      }
    }
    EXPECT_EQ(kernel.value(kernel.support()), 0.0);
    EXPECT_EQ(kernel.value(-7.0), 0.0);
  }
}

TEST(Kernel, FirstMomentsVanishSoThatSlopesAreReproduced) {
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    const Kernel kernel = Kernel::make(filter);
    for (const double u : positions()) EXPECT_NEAR(weighted(kernel, u, 1), 0.0, 1e-6) << to_string(filter) << " " << u;
  }
}

TEST(Kernel, SecondMomentOfTheCubicSplineIsThatOfItsDegree) {
  // The sampled moments 2...n of the B-spline of degree n do not depend on the position: the second is (n + 1) / 12.
  const Kernel kernel = Kernel::make(Filter::kBspline3);
  for (const double u : positions()) EXPECT_NEAR(weighted(kernel, u, 2), 4.0 / 12.0, 1e-6);
}

TEST(Kernel, InterpolatingOnesReturnTheSampleExactly) {
  for (const Filter filter : kAll) {
    if (filter == Filter::kBspline3) continue;
    const Kernel kernel = Kernel::make(filter);
    for (int u = -2; u <= 3; ++u) {
      const TapWeights taps = kernel.at(u);
      for (int i = 0; i < kernel.taps(); ++i) {
        EXPECT_EQ(taps.weights[static_cast<std::size_t>(i)], taps.first + i == u ? 1.0F : 0.0F) << to_string(filter);
      }
    }
  }
}

TEST(Kernel, NearestGivesTiesToTheNextSample) {
  const Kernel nearest = Kernel::make(Filter::kNearest);
  EXPECT_EQ(nearest.at(0.5).first, 1);
  EXPECT_EQ(nearest.at(-0.5).first, 0);
  EXPECT_EQ(nearest.at(std::nextafter(0.5, 0.0)).first, 0);
}

TEST(Kernel, MirroredPositionsGiveMirroredWeights) {
  for (const Filter filter : kAll) {
    const Kernel kernel = Kernel::make(filter);
    for (const double u : {0.125, 0.25, 0.375, 0.625, 0.875}) {
      const TapWeights a = kernel.at(u);
      const TapWeights b = kernel.at(-u);
      for (int i = 0; i < kernel.taps(); ++i) {
        EXPECT_NEAR(a.weights[static_cast<std::size_t>(i)], b.weights[static_cast<std::size_t>(kernel.taps() - 1 - i)],
                    1e-7F)
            << to_string(filter) << " " << u;
      }
    }
  }
}

TEST(Kernel, LimitedCubicAddsFourThirdsOfWhatCatmullRomAddsToAStraightLine) {
  const auto line = Kernel::make(Filter::kBilinear);
  const auto smooth = [](double x) {  // Keys 1981, a = -1/2
    const double d = std::abs(x);
    return d < 1.0 ? (1.5 * d - 2.5) * d * d + 1.0 : d < 2.0 ? ((-0.5 * d + 2.5) * d - 4.0) * d + 2.0 : 0.0;
  };
  const auto limited = Kernel::make(Filter::kLimitedCubic);
  for (double x = -2.5; x <= 2.5; x += 0.01) {
    EXPECT_NEAR(limited.value(x), line.value(x) + 4.0 / 3.0 * (smooth(x) - line.value(x)), 1e-12) << x;
  }
}

TEST(Edges, NamesRoundTripAndOthersAreRefused) {
  for (const Edges edges : {Edges::kOdd, Edges::kHeld}) EXPECT_EQ(edges_from_string(to_string(edges)), edges);
  for (const Filter filter : {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic}) {
    EXPECT_EQ(usual_edges(filter), Edges::kOdd) << to_string(filter);
  }
  EXPECT_EQ(usual_edges(Filter::kBspline3), Edges::kHeld);
  EXPECT_THROW((void)edges_from_string("Odd"), Error);
}

TEST(ContinueRow, GoesOnWithAPlane) {
  for (const std::int64_t count : {2, 3, 5, 9}) {
    for (std::int64_t k = -25; k <= 25; ++k) {
      const auto plane = [](std::int64_t at) { return 7 * at - 3; };
      std::int64_t height = 0;
      continue_row(k, count, [&](std::int64_t at, int weight) {
        ASSERT_TRUE(at >= 0 && at < count) << at;
        height += weight * plane(at);
      });
      EXPECT_EQ(height, plane(k)) << k << " of " << count;
    }
  }
  continue_row(-4, 1, [](std::int64_t at, int weight) { EXPECT_TRUE(at == 0 && weight == 1); });
  int terms = 0;
  continue_row(-2, 9, [&](std::int64_t at, int weight) {  // s[-2] = 2 s[0] - s[2]
    EXPECT_EQ(at, terms == 0 ? 0 : 2);
    EXPECT_EQ(weight, terms++ == 0 ? 2 : -1);
  });
  EXPECT_EQ(terms, 2);
}

TEST(MirrorIndex, ReflectsAboutTheEndSamples) {
  const std::vector<std::int64_t> expected = {0, 1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0};
  for (std::int64_t k = -6; k <= 6; ++k) EXPECT_EQ(mirror_index(k, 4), expected[static_cast<std::size_t>(k + 6)]) << k;
  for (std::int64_t k = -5; k <= 5; ++k) EXPECT_EQ(mirror_index(k, 1), 0);
  for (std::int64_t k = -5; k <= 5; ++k) EXPECT_EQ(mirror_index(k, 2), k & 1);
}

}  // namespace
}  // namespace isohf
