#include "raster_meshes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isohf/convert.h"
#include "isohf/verify.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf::experiment {
namespace {

using Source = test::MemorySource<float>;

RasterComparison compared(Source& source, double density = 1.0) {
  const test::TemporaryFolder folder;
  ConvertOptions options;
  options.plan.density = density;
  options.code_type = CodeType::kF32;
  (void)convert(source, folder / "a.isohf", options);
  const ArchiveReader archive(folder / "a.isohf");
  return compare_with_squares(archive, source, compare_with_source(archive, source).rms);
}

/// Waves of 12 samples, in several directions.
double waves(std::int64_t c, std::int64_t r) {
  double sum = 0.0;
  for (const double angle : {0.2, 0.9, 1.5, 2.3, 2.9}) {
    sum += 20.0 * std::sin(2.0 * M_PI / 12.0 *
                           (static_cast<double>(c) * std::cos(angle) + static_cast<double>(r) * std::sin(angle)));
  }
  return sum;
}

// A plane is one in every mesh.
TEST(RasterMeshes, PlanesHaveNoError) {
  Source source(SampleType::kFloat32, 90, 80, [](std::int64_t c, std::int64_t r) {
    return 3.0 * static_cast<double>(c) - 2.0 * static_cast<double>(r);
  });
  const RasterComparison found = compared(source);
  EXPECT_LT(found.squares.one_diagonal, 1e-3);
  EXPECT_LT(found.squares.best, 1e-3);
  EXPECT_LT(found.regular_rms, 1e-3);
}

TEST(RasterMeshes, LatticesErrLessThanSquaresCutOneWayAndMoreThanThoseCutByTheSource) {
  Source source(SampleType::kFloat32, 200, 180, waves);
  const RasterComparison found = compared(source);
  EXPECT_LT(found.regular_rms, 0.95 * found.squares.one_diagonal);
  EXPECT_LT(found.squares.best, found.squares.least_curvature);
  EXPECT_LT(found.squares.least_curvature, found.squares.one_diagonal);
  ASSERT_TRUE(found.triangles_of_equal_rms.has_value());
  EXPECT_GT(*found.triangles_of_equal_rms, 1.02);
  EXPECT_LT(*found.triangles_of_equal_rms, 1.5);
}

// Folds along falling diagonals: squares cut along them follow them, and rising ones are not taken.
TEST(RasterMeshes, TakesTheDiagonalThatSuitsTheGround) {
  for (const std::int64_t sign : {-1, 1}) {
    Source source(SampleType::kFloat32, 160, 160, [sign](std::int64_t c, std::int64_t r) {
      return 30.0 * std::sin(2.0 * M_PI / 24.0 * static_cast<double>(c + sign * r));
    });
    const RasterComparison found = compared(source, 0.25);
    EXPECT_LT(found.squares.one_diagonal, 1.15 * found.squares.best) << sign;
  }
}

TEST(RasterMeshes, VoidsAreLeftOut) {
  Source source(SampleType::kFloat32, 150, 140, [](std::int64_t c, std::int64_t r) {
    return c > 60 && c < 80 && r > 50 && r < 70 ? std::nan("") : waves(c, r);
  });
  const RasterComparison found = compared(source);
  EXPECT_TRUE(std::isfinite(found.squares.one_diagonal));
  EXPECT_GT(found.squares.one_diagonal, 0.0);
}

}  // namespace
}  // namespace isohf::experiment
