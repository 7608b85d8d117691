#include "isohf/sampling/resample/prefilter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/rasters/trigonometric_field.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
constexpr Filter kAll[] = {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

struct Raster {
  std::int64_t columns;
  std::int64_t rows;
  std::vector<float> heights;
  [[nodiscard]] View2D<float> view() { return {heights.data(), columns, rows}; }
  [[nodiscard]] View2D<const float> view() const { return {heights.data(), columns, rows}; }
};

Raster random_raster(std::int64_t columns, std::int64_t rows, std::uint64_t seed, double void_share = 0.0) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  Raster raster{columns, rows, {}};
  for (std::int64_t i = 0; i < columns * rows; ++i) {
    const auto height = static_cast<float>(4000.0 * uniform());
    raster.heights.push_back(uniform() < void_share ? kVoid : height);
  }
  return raster;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

Prefilter make(Filter filter, const char* acquisition = "point") {
  return Prefilter::make(filter, acquisition_from_string(acquisition));
}

/// Unser's recursion as in textbooks, of the row continued far beyond both ends: the reference for the truncated impulse
/// response.
std::vector<double> recursive_prefilter(std::span<const float> row, const std::vector<double>& poles) {
  constexpr std::int64_t kBeyond = 200;
  const auto count = static_cast<std::int64_t>(row.size());
  std::vector<double> s;
  for (std::int64_t k = -kBeyond; k < count + kBeyond; ++k) {
    double height = 0.0;
    continue_row(k, count,
                 [&](std::int64_t at, int weight) { height += weight * double{row[static_cast<std::size_t>(at)]}; });
    s.push_back(height);
  }
  const auto n = static_cast<std::int64_t>(s.size());
  for (const double z : poles) {
    double start = 0.0;
    for (std::int64_t k = 0; k < 200; ++k) {
      start += std::pow(z, static_cast<double>(k)) * s[static_cast<std::size_t>(mirror_index(k, n))];
    }
    for (double& value : s) value *= (1.0 - z) * (1.0 - 1.0 / z);
    s[0] = start * (1.0 - z) * (1.0 - 1.0 / z);
    for (std::size_t k = 1; k < s.size(); ++k) s[k] += z * s[k - 1];
    s.back() = z / (z * z - 1.0) * (s.back() + z * s[s.size() - 2]);
    for (std::size_t k = s.size() - 1; k-- > 0;) s[k] = z * (s[k + 1] - s[k]);
  }
  return {s.begin() + kBeyond, s.end() - kBeyond};
}

TEST(Prefilter, OfInterpolatingKernelsAndPointsIsTheIdentity) {
  for (const Filter filter : kAll) {
    const Prefilter prefilter = make(filter);
    EXPECT_EQ(prefilter.is_identity(), filter != Filter::kBspline3) << to_string(filter);
  }
  EXPECT_TRUE(make(Filter::kNearest, "box").is_identity());
  EXPECT_EQ(make(Filter::kNearest, "box").halo(), 0);
}

TEST(Prefilter, ImpulseResponseOfTheCubicIsItsGeometricSeries) {
  const double z = std::sqrt(3.0) - 2.0;
  const std::vector<double> p = make(Filter::kBspline3).impulse_response();
  for (std::size_t k = 0; k < p.size(); ++k) {
    EXPECT_NEAR(p[k], -6.0 * z / (1.0 - z * z) * std::pow(z, static_cast<double>(k)), 1e-13) << k;
  }
  EXPECT_EQ(make(Filter::kBspline3).halo(), 16 + 4);
}

TEST(Prefilter, AgreesWithUnsersRecursion) {
  struct Case {
    Filter filter;
    const char* acquisition;
    std::vector<double> poles;
  };
  const double quartic_slow = -0.36134122590022018;
  const double quartic_fast = -0.01372542929733912;
  // Degree n + 1 for a box.
  for (const Case& c : {Case{Filter::kBspline3, "point", {std::sqrt(3.0) - 2.0}},
                        Case{Filter::kBilinear, "box", {std::sqrt(8.0) - 3.0}},
                        Case{Filter::kBspline3, "box", {quartic_slow, quartic_fast}}}) {
    for (const std::int64_t count : {2, 3, 5, 16, 17, 40, 100}) {
      Raster raster = random_raster(count, 1, 7);
      const std::vector<double> expected = recursive_prefilter(raster.heights, c.poles);
      make(c.filter, c.acquisition).filter_rows(raster.view());
      for (std::size_t k = 0; k < expected.size(); ++k) {
        // Half a unit in the last place of coefficients up to 2^14, and 1e-9 of 4000 left out of the response.
        EXPECT_NEAR(raster.heights[k], expected[k], 5e-4 + 4e-6) << to_string(c.filter) << c.acquisition << count;
      }
    }
  }
}

TEST(Prefilter, LevelGroundStaysExactlyLevel) {
  for (const Filter filter : kAll) {
    for (const char* acquisition : {"point", "box", "gaussian:0.7"}) {
      Raster raster{70, 41, std::vector<float>(70 * 41, 1234.567F)};
      const std::vector<float> before = raster.heights;
      make(filter, acquisition).filter(raster.view());
      EXPECT_TRUE(same_bits(raster.heights, before)) << to_string(filter) << " " << acquisition;
    }
  }
}

TEST(Prefilter, PlanesAreTheirOwnCoefficientsUpToTheRimAndNextToVoids) {
  for (const double void_share : {0.0, 0.02, 0.3}) {
    const Raster voids = random_raster(40, 35, 4, void_share);
    const auto plane = [](std::int64_t c, std::int64_t r) {
      return 300.0 + 3.0 * static_cast<double>(c) - 5.0 * static_cast<double>(r);
    };
    Raster raster = voids;
    for (std::int64_t r = 0; r < 35; ++r) {
      for (std::int64_t c = 0; c < 40; ++c) {
        if (!std::isnan(voids.view()(c, r))) raster.view()(c, r) = static_cast<float>(plane(c, r));
      }
    }
    make(Filter::kBspline3).filter(raster.view());
    for (std::int64_t r = 0; r < 35; ++r) {
      for (std::int64_t c = 0; c < 40; ++c) {
        if (std::isnan(voids.view()(c, r))) continue;
        // Floats below 512 through a gain of at most 7.5 along either axis.
        ASSERT_NEAR(raster.view()(c, r), plane(c, r), 512 * 56 * 0x1p-24) << c << "," << r;
      }
    }
  }
}

/// A coefficient, beyond the raster's ends as well.
double continued(View2D<const float> c, std::int64_t column, std::int64_t row) {
  double height = 0.0;
  continue_row(row, c.rows(), [&](std::int64_t r, int row_weight) {
    continue_row(column, c.columns(),
                 [&](std::int64_t i, int weight) { height += row_weight * weight * static_cast<double>(c(i, r)); });
  });
  return height;
}

/// What a reading at (column, row) through the acquisition gives: its separable response applied to coefficients.
double acquire(const std::vector<double>& response, View2D<const float> c, std::int64_t column, std::int64_t row) {
  const auto reach = static_cast<std::int64_t>(response.size()) - 1;
  double sum = 0.0;
  for (std::int64_t j = -reach; j <= reach; ++j) {
    double along = 0.0;
    for (std::int64_t i = -reach; i <= reach; ++i) {
      along += response[static_cast<std::size_t>(std::abs(i))] * continued(c, column + i, row + j);
    }
    sum += response[static_cast<std::size_t>(std::abs(j))] * along;
  }
  return sum;
}

TEST(Prefilter, ReacquiringTheReconstructionReturnsTheSource) {
  // The responses are closed forms, tested against one-sided powers and error functions in acquisition_test. The field
  // falls off as 1/k^1.8, as terrain does, and fills the whole band.
  const TrigonometricField field(96, 1.8, 1.0, 5);
  const std::vector<float> source = field.samples();
  const auto [low, high] = std::minmax_element(source.begin(), source.end());
  const double range = static_cast<double>(*high) - static_cast<double>(*low);
  const Acquisition taps = with_taps(acquisition_from_string("1,2,6,2,1"));
  for (const Filter filter : kAll) {
    for (const Acquisition& acquisition :
         {Acquisition{}, acquisition_from_string("box"), acquisition_from_string("gaussian:0.3"),
          acquisition_from_string("gaussian:0.5"), acquisition_from_string("gaussian:0.7"), taps}) {
      Raster raster{96, 96, source};
      Prefilter::make(filter, acquisition).filter(raster.view());
      const std::vector<double> response = sampled_response(Kernel::make(filter), acquisition);
      double worst = 0.0;
      for (std::int64_t r = 0; r < 96; ++r) {
        for (std::int64_t c = 0; c < 96; ++c) {
          const auto height = static_cast<double>(source[static_cast<std::size_t>(r * 96 + c)]);
          worst = std::max(worst, std::abs(acquire(response, raster.view(), c, r) - height));
        }
      }
      EXPECT_LE(worst, 1e-6 * range) << to_string(filter) << " " << to_string(acquisition);
    }
  }
}

TEST(Prefilter, IllPosedInversionsAreRefusedWithTheirGain) {
  const auto refusal = [](Filter filter, const char* acquisition) -> std::string {
    const Error error = test::error_of([&] { (void)make(filter, acquisition); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  };
  EXPECT_NO_THROW((void)make(Filter::kBspline3, "gaussian:0.9"));
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    EXPECT_THAT(refusal(filter, "gaussian:1.2"), testing::HasSubstr("times is allowed"));
    (void)refusal(filter, "gaussian:100");
    // Its spectrum falls to 0 at the Nyquist frequency, or below it.
    (void)refusal(filter, "1,2,1");
    EXPECT_THAT(refusal(filter, "1,1,1"), testing::HasSubstr("without bound"));
  }
  EXPECT_THAT(refusal(Filter::kBspline3, "gaussian:1.2"), testing::HasSubstr("waves of 2 samples"));
}

TEST(Prefilter, CoefficientsGoOnIntoVoidsByTheBorderAndNoFurther) {
  for (const double void_share : {0.01, 0.5, 0.97, 1.0}) {
    Raster source = random_raster(90, 75, 5, void_share);
    Raster raster = source;
    const Prefilter prefilter = make(Filter::kBspline3, "box");
    const std::int64_t border = prefilter.border();
    EXPECT_EQ(border, 2);
    prefilter.filter(raster.view());
    for (std::int64_t r = 0; r < raster.rows; ++r) {
      for (std::int64_t c = 0; c < raster.columns; ++c) {
        bool near = false;  // a kernel at the nearest sample, or next to it, reads this coefficient
        bool far = true;    // neither within the border of a sample nor in a gap of twice that between two
        for (std::int64_t j = -2 * border; j <= 2 * border; ++j) {
          for (std::int64_t i = -2 * border; i <= 2 * border; ++i) {
            if (c + i < 0 || c + i >= raster.columns || r + j < 0 || r + j >= raster.rows) continue;
            if (std::isnan(source.view()(c + i, r + j))) continue;
            far = false;
            near |= std::max(std::abs(i), std::abs(j)) <= border;
          }
        }
        if (near) {
          ASSERT_FALSE(std::isnan(raster.view()(c, r))) << c << " " << r;
        }
        if (far) {
          ASSERT_TRUE(std::isnan(raster.view()(c, r))) << c << " " << r;
        }
        // Largest possible: 5^2 per unit of range.
        if (near) {
          ASSERT_LT(std::abs(raster.view()(c, r)), 4000.0F * 25.0F);
        }
      }
    }
  }
}

TEST(Prefilter, EverySampleKeepsItsHeightAlsoAmongVoids) {
  for (const double void_share : {0.0, 0.01, 0.2, 0.6, 0.95}) {
    Raster source = random_raster(60, 50, 9, void_share);
    Raster raster = source;
    make(Filter::kBspline3).filter(raster.view());
    const Kernel kernel = Kernel::make(Filter::kBspline3);
    for (std::int64_t r = 0; r < source.rows; ++r) {
      for (std::int64_t c = 0; c < source.columns; ++c) {
        const auto height = static_cast<double>(source.view()(c, r));
        if (std::isnan(height)) continue;
        const TapWeights across = kernel.at(static_cast<double>(c));
        const TapWeights down = kernel.at(static_cast<double>(r));
        double sum = 0.0;
        for (int j = 0; j < kernel.taps(); ++j) {
          for (int i = 0; i < kernel.taps(); ++i) {
            sum += static_cast<double>(across.weights[static_cast<std::size_t>(i)]) *
                   static_cast<double>(down.weights[static_cast<std::size_t>(j)]) *
                   continued(raster.view(), across.first + i, down.first + j);
          }
        }
        // White noise is the worst case: coefficients are up to 7.5^2 times the range, and rounded to float.
        ASSERT_NEAR(sum, height, 4000.0 * 56.0 * 0x1p-23) << c << " " << r;
      }
    }
  }
}

struct NextToVoids {
  double worst_error = 0.0;  ///< of a vertex within three samples of a void
  double worst_beyond =
      0.0;  ///< how far one whose taps are voids leaves the samples around it, in shares of their range
};

/// In fields with round voids; errors as shares of the field's range.
NextToVoids next_to_voids(const Kernel& kernel, std::uint64_t seed) {
  const TrigonometricField field(128, 1.8, 0.7, seed);
  const Raster exact{128, 128, field.samples()};
  const auto [low, high] = std::minmax_element(exact.heights.begin(), exact.heights.end());
  Raster holed = exact;
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  for (int disc = 0; disc < 40; ++disc) {
    const auto column = static_cast<std::int64_t>(random() % 128);
    const auto row = static_cast<std::int64_t>(random() % 128);
    const auto radius = static_cast<std::int64_t>(2 + random() % 6);
    for (std::int64_t r = 0; r < 128; ++r) {
      for (std::int64_t c = 0; c < 128; ++c) {
        const std::int64_t x = c - column;
        const std::int64_t z = r - row;
        if (x * x + z * z <= radius * radius) holed.view()(c, r) = kVoid;
      }
    }
  }
  Raster coefficients = holed;
  Prefilter::make(kernel.filter(), {}).filter(coefficients.view());
  NextToVoids found;
  for (double v = 6.3; v < 121.0; v += 0.93) {
    const std::vector<double> truth = field.row(v, 6.4, 1.07, 107);
    for (int i = 0; i < 107; ++i) {
      const double u = 6.4 + 1.07 * i;
      const double height = evaluate(kernel, coefficients.view(), holed.view(), u, v);
      if (std::isnan(height)) continue;
      const auto sample = [&](std::int64_t c, std::int64_t r) {
        return static_cast<double>(holed.view()(static_cast<std::int64_t>(u) + c, static_cast<std::int64_t>(v) + r));
      };
      bool is_near = false;
      bool has_void = false;
      double least = HUGE_VAL;
      double most = -HUGE_VAL;
      for (std::int64_t r = -3; r <= 4; ++r) {
        for (std::int64_t c = -3; c <= 4; ++c) {
          const auto reach = static_cast<std::int64_t>(kernel.taps() / 2);
          const bool is_tap = c > -reach && c <= reach && r > -reach && r <= reach;
          if (std::isnan(sample(c, r))) {
            is_near = true;
            has_void = has_void || is_tap;
          } else if (c >= 0 && c <= 1 && r >= 0 && r <= 1) {
            least = std::min(least, sample(c, r));
            most = std::max(most, sample(c, r));
          }
        }
      }
      if (is_near) {
        found.worst_error = std::max(found.worst_error, std::abs(height - truth[static_cast<std::size_t>(i)]));
      }
      if (has_void && most > least) {
        found.worst_beyond = std::max(found.worst_beyond, std::max(height - most, least - height) / (most - least));
      }
    }
  }
  found.worst_error /= static_cast<double>(*high - *low);
  return found;
}

TEST(Prefilter, NextToVoidsSplinesStayNearTheSamplesAroundThem) {
  for (const std::uint64_t seed : {3U, 6U}) {
    const NextToVoids found = next_to_voids(Kernel::make(Filter::kBspline3), seed);
    EXPECT_LE(found.worst_beyond, 0.25 + 1e-3);  // samples are floats, and cells nearly level
    EXPECT_LT(found.worst_error, 0.031);
    const NextToVoids free = next_to_voids(Kernel::make(Filter::kBspline3, Edges::kOdd), seed);
    EXPECT_GT(free.worst_beyond, 1.0) << "there is nothing to hold";
  }
}

TEST(Prefilter, NothingIsSeenAcrossAWallOfVoids) {
  const Prefilter prefilter = make(Filter::kBspline3);
  const std::int64_t thickness = 2 * prefilter.border() + 1;  // thinner ones are bridged
  Raster a = random_raster(60, 60, 1);
  Raster b = random_raster(60, 60, 2);
  for (std::int64_t r = 0; r < 60; ++r) {
    for (std::int64_t c = 0; c < 60; ++c) {
      float& other = b.view()(c, r);
      if (c < 30 && r < 30) other = a.view()(c, r);
      if ((c >= 30 && c < 30 + thickness) || (r >= 30 && r < 30 + thickness)) other = a.view()(c, r) = kVoid;
    }
  }
  prefilter.filter(a.view());
  prefilter.filter(b.view());
  for (std::int64_t r = 0; r < 30; ++r) {
    EXPECT_EQ(std::memcmp(a.view().row(r), b.view().row(r), 30 * sizeof(float)), 0) << r;
  }
}

TEST(Prefilter, LoneSamplesAreLevelGround) {
  Raster raster{9, 9, std::vector<float>(81, kVoid)};
  raster.view()(4, 4) = 77.25F;
  make(Filter::kBspline3, "gaussian:0.7").filter(raster.view());
  for (std::int64_t r = 0; r < 9; ++r) {
    for (std::int64_t c = 0; c < 9; ++c) {
      const bool within = std::max(std::abs(c - 4), std::abs(r - 4)) <= 2;
      EXPECT_TRUE(within ? raster.view()(c, r) == 77.25F : std::isnan(raster.view()(c, r))) << c << " " << r;
    }
  }
  Raster one{1, 1, {3.5F}};
  make(Filter::kBspline3).filter(one.view());
  EXPECT_EQ(one.heights[0], 3.5F);
}

TEST(Prefilter, RowsThatWrapAreTheMiddleOfManyTurns) {
  for (const std::int64_t columns : {5, 37, 90}) {
    for (const double voids : {0.0, 0.05}) {
      const Prefilter prefilter = make(Filter::kBspline3);
      Raster once = random_raster(columns, 6, 5, voids);
      // Enough turns for the middle one to know nothing of the ends.
      const std::int64_t turns = 2 * (prefilter.halo() / columns + 1) + 1;
      Raster many{columns * turns, 6, {}};
      for (std::int64_t r = 0; r < 6; ++r) {
        for (std::int64_t c = 0; c < many.columns; ++c) many.heights.push_back(once.view()(c % columns, r));
      }
      prefilter.filter_rows(once.view(), true);
      prefilter.filter_rows(many.view());
      for (std::int64_t r = 0; r < 6; ++r) {
        for (std::int64_t c = 0; c < columns; ++c) {
          const float expected = many.view()(turns / 2 * columns + c, r);
          const float found = once.view()(c, r);
          ASSERT_EQ(std::isnan(found), std::isnan(expected)) << c << "," << r;
          if (std::isnan(found)) continue;
          ASSERT_EQ(found, expected) << c << "," << r;
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
