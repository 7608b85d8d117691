/// Ortho to iso and back by the code that is shipped, against the marks of a reference implementation.

#include <gtest/gtest.h>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/trigonometric_field.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

constexpr int kSize = 128;
constexpr int kMargin = 24;  // 0.43^24, the quintic's slower pole, hides the mirrored edge below 1e-8

/// PSNR in dB, relative to the samples' peak-to-peak range, of the field's samples after isohf's own conversion to an
/// archive and restoring from it: floats, 5 x 6 small tiles, column step 1 and row step 26/30 = 0.8667 (sqrt(3)/2 =
/// 0.8660), 15.4 % more vertices than samples. Only samples at least `margin` from the square's edge count.
double psnr_of_restoring(Filter filter, const TrigonometricField& field, int margin, RestoreMethod method) {
  const int n = field.n();
  const std::vector<float> samples = field.samples();
  const auto sample_at = [&](std::int64_t c, std::int64_t r) { return samples[static_cast<std::size_t>(r * n + c)]; };
  test::MemorySource<float> source(
      SampleType::kFloat32, n, n, [&](std::int64_t c, std::int64_t r) { return static_cast<double>(sample_at(c, r)); });
  ConvertOptions options;
  options.filter = filter;
  options.code_type = CodeType::kF32;
  options.plan.shape = {30, 33};
  options.plan.levels = 1;
  options.plan.spacing = 1.0;
  const test::TemporaryFolder folder;
  (void)convert(source, folder / "field.isohf", options);

  const ArchiveReader archive(folder / "field.isohf");
  RowReader surface(archive, source_grid(archive.metadata().source), method);
  std::vector<double> restored(samples.size());
  surface.read(0, n, restored);
  double squares = 0.0;
  std::int64_t count = 0;
  for (int r = margin; r < n - margin; ++r) {
    for (int c = margin; c < n - margin; ++c) {
      const double error = restored[static_cast<std::size_t>(r * n + c)] - static_cast<double>(sample_at(c, r));
      squares += error * error;
      ++count;
    }
  }
  return psnr(samples, squares, count);
}

double mean_psnr(Filter filter, double rho, RestoreMethod method) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    sum += psnr_of_restoring(filter, TrigonometricField(kSize, 1.8, rho, seed), kMargin, method);
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
