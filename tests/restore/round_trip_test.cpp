/// Ortho to iso and back by the code that is shipped, against the marks of a reference implementation.

#include <gtest/gtest.h>

#include "support/rasters/restored_field.h"

namespace isohf {
namespace {

constexpr int kSize = 128;
constexpr int kMargin = 24;  // 0.43^24, the quintic's slower pole, hides the mirrored edge below 1e-8

double mean_psnr(Filter filter, double rho, RestoreMethod method) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    sum += test::psnr_of_restoring(filter, TrigonometricField(kSize, 1.8, rho, seed), kMargin, method);
  }
  return sum / 4.0;
}

struct Mark {
  Filter filter;
  double full_band_db;     ///< rho = 1
  double seven_tenths_db;  ///< rho = 0.7
};

class RoundTripTest : public testing::TestWithParam<Mark> {};

TEST_P(RoundTripTest, OnTheLatticeThatHoldsTheSquareBandReachesTheReference) {
  const Mark& mark = GetParam();
  EXPECT_GE(mean_psnr(mark.filter, 1.0, RestoreMethod::kHex), mark.full_band_db);
  EXPECT_GE(mean_psnr(mark.filter, 0.7, RestoreMethod::kHex), mark.seven_tenths_db);
}

INSTANTIATE_TEST_SUITE_P(RoundTrip, RoundTripTest,
                         testing::Values(Mark{Filter::kBilinear, 46.1, 47.9}, Mark{Filter::kBspline3, 56.4, 67.6}),
                         [](const auto& tested) { return to_string(tested.param.filter); });

TEST(RoundTrip, TrianglesAloneLoseAllAboveTheLinear) {
  EXPECT_LT(mean_psnr(Filter::kBspline3, 0.7, RestoreMethod::kBarycentric), 60.0);
}

}  // namespace
}  // namespace isohf
