#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/light/shadow.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

constexpr double kSlope = 14.0;  ///< steepest, of hills of 40 * sin, cos and noise of 1, over samples 1 apart

/// Hills with a hole in tiles of 20 x 19.
class PointShadow : public testing::TestWithParam<CodeType> {
 protected:
  PointShadow() {
    test::MemorySource<float> source(SampleType::kFloat32, 120, 90, [](std::int64_t c, std::int64_t r) {
      if (c > 50 && c < 62 && r > 30 && r < 45) return std::nan("");
      const auto mixed = static_cast<std::uint64_t>(c * 7919 + r * 104729 + 17) * 0x9E3779B97F4A7C15U;
      const double noise = static_cast<double>(mixed >> 40U) / (1U << 24U);
      return 500.0 + 40.0 * std::sin(static_cast<double>(c) * 0.2) * std::cos(static_cast<double>(r) * 0.1) + noise;
    });
    ConvertOptions options;
    options.code_type = GetParam();
    options.plan.shape = {20, 19};
    options.plan.levels = 1;
    (void)convert(source, folder / "a.isohf", options);
  }

  static std::vector<WorldPoint> places() {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> x_of(-3.0, 123.0);
    std::uniform_real_distribution<double> z_of(-3.0, 93.0);
    std::vector<WorldPoint> all = {{0.0, 0.0}, {std::nan(""), 5.0}, {60.0, 40.0}};
    for (int i = 0; i < 300; ++i) all.push_back({x_of(random), z_of(random)});
    return all;
  }

  test::TemporaryFolder folder;
};

TEST_P(PointShadow, ReachesAsHighAsTheSurfaceTowardsTheSunSays) {
  const ArchiveReader archive(folder / "a.isohf");
  Surface surface(archive);
  const std::vector<WorldPoint> points = places();
  const WorldBounds& ground = archive.metadata().valid;
  int in_shadow = 0;
  for (const double azimuth : {0.0, 37.0, 90.0, 151.0, 180.0, 233.3, 270.0, 300.0}) {
    for (const double altitude : {3.0, 20.0, 60.0}) {
      Sun sun;
      sun.azimuth_deg = azimuth;
      sun.elevation_deg = altitude;
      std::vector<SunSample> found(points.size());
      surface.sample(points, sun, 0.0, found);
      const double radians = std::numbers::pi / 180.0;
      const double fall = std::tan(altitude * radians);
      // Along the line the surface rises by no more than its steepest slope between two looks at it.
      constexpr double kStep = 0.01;
      for (std::size_t i = 0; i < points.size(); i += 7) {
        std::vector<WorldPoint> line;
        for (int k = 0; k < 16000; ++k) {
          const WorldPoint at{points[i].x + k * kStep * std::sin(azimuth * radians),
                              points[i].z - k * kStep * std::cos(azimuth * radians)};
          const bool casts = at.x >= ground.x0 && at.x <= ground.x1 && at.z >= ground.z0 && at.z <= ground.z1;
          line.push_back(k == 0 || casts ? at : WorldPoint{-1e9, 0.0});
        }
        std::vector<double> heights(line.size());
        surface.sample(line, std::span(heights));
        ASSERT_EQ(std::isnan(heights[0]), std::isnan(found[i].shadow_height)) << i;
        ASSERT_EQ(std::isnan(heights[0]), std::isnan(found[i].share)) << i;
        if (std::isnan(heights[0])) continue;
        double expected = heights[0];
        for (std::size_t k = 0; k < heights.size(); ++k) {
          const double height = heights[k] - static_cast<double>(k) * kStep * fall;
          if (height > expected) expected = height;
        }
        ASSERT_GE(found[i].shadow_height, expected - 1e-9) << azimuth << " " << altitude << " " << i;
        ASSERT_LE(found[i].shadow_height, expected + kStep * kSlope) << azimuth << " " << altitude << " " << i;
        if (found[i].shadow_height > heights[0] + 1.0) ++in_shadow;
      }
    }
  }
  EXPECT_GT(in_shadow, 100);
}

// Eq. 18 along a row of vertices, and the answer at each of them.
TEST_P(PointShadow, IsTheSweepsAtVerticesWithTheSunInTheWest) {
  const ArchiveReader archive(folder / "a.isohf");
  const TileGrid& grid = archive.grid();
  const TileShape& shape = grid.shape();
  Surface surface(archive);
  const Sun sun{270.0, 12.0, {}};
  const double fall = std::tan(12.0 * std::numbers::pi / 180.0);
  const WorldBounds& ground = archive.metadata().valid;
  int compared = 0;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    std::vector<double> edge(static_cast<std::size_t>(shape.rows() - 2), kNoShadow);
    for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
      const std::vector<double> exact = archive.read_elevations({column, row});
      std::vector<float> heights(exact.begin(), exact.end());
      std::vector<float> shadow(heights.size());
      tile_shadow(grid, {heights.data(), shape.columns(), shape.rows()}, {LightTravel::kEastward, fall}, edge,
                  {shadow.data(), shape.columns(), shape.rows()}, edge);
      for (int r = 1; r + 1 < shape.rows(); r += 2) {
        for (int c = 1; c + 1 < shape.columns(); ++c) {
          if (!is_visible(shape, {c, r})) continue;
          const WorldPoint at = grid.world_from_lattice(grid.lattice_vertex({column, row}, {c, r}));
          if (at.x > ground.x1 || at.z > ground.z1) continue;
          SunSample found{};
          surface.sample({&at, 1}, sun, 0.0, {&found, 1});
          const auto i = static_cast<std::size_t>(r * shape.columns() + c);
          if (std::isnan(heights[i])) continue;
          ASSERT_NEAR(found.shadow_height, static_cast<double>(shadow[i]), 2e-4) << at.x << " " << at.z;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 3000);
}

TEST_P(PointShadow, SharesFollowEquation16AboveTheSurfaceAndItsDoubleOnIt) {
  const ArchiveReader archive(folder / "a.isohf");
  Surface surface(archive);
  const std::vector<WorldPoint> points = places();
  std::vector<double> heights(points.size());
  surface.sample(points, std::span(heights));
  const Sun sun{200.0, 8.0, 3.0};
  double lit = 0.0;
  for (const double above : {0.0, 1e-3, 0.5, 4.0, 30.0, 80.0}) {
    std::vector<SunSample> found(points.size());
    surface.sample(points, sun, above, found);
    double sum = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (std::isnan(heights[i])) continue;
      const double depth = found[i].shadow_height - heights[i] - above;
      const double expected = above > 0.0 ? 0.5 - depth / 3.0 : 1.0 - 2.0 * depth / 3.0;
      ASSERT_NEAR(found[i].share, std::clamp(expected, 0.0, 1.0), 1e-9);
      sum += found[i].share;
    }
    if (above >= 4.0) {
      EXPECT_GE(sum, lit);
    }
    lit = sum;
  }
  // Nothing on this ground casts a shadow 90 above it.
  std::vector<SunSample> high(points.size());
  surface.sample(points, sun, 90.0, high);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    EXPECT_EQ(high[i].share, 1.0);
  }
}

TEST_P(PointShadow, DoesNotDependOnThreadsOrMemory) {
  const ArchiveReader archive(folder / "a.isohf");
  const std::vector<WorldPoint> points = places();
  const Sun sun{123.0, 5.0, {}};
  std::vector<SunSample> first(points.size());
  Surface(archive).sample(points, sun, 2.0, first);
  for (const int threads : {1, 5}) {
    Job job;
    job.threads = threads;
    job.memory_bytes = 1;
    std::vector<SunSample> again(points.size());
    Surface(archive, job).sample(points, sun, 2.0, again);
    EXPECT_EQ(std::memcmp(first.data(), again.data(), first.size() * sizeof(SunSample)), 0) << threads;
  }
}

TEST_P(PointShadow, RefusesSunsAndHeightsOutOfRange) {
  const ArchiveReader archive(folder / "a.isohf");
  Surface surface(archive);
  const WorldPoint at{5.0, 5.0};
  SunSample found{};
  const double nan = std::nan("");
  for (const Sun& sun :
       {Sun{nan, 5.0, {}}, Sun{0.0, 0.0, {}}, Sun{0.0, 90.0, {}}, Sun{0.0, nan, {}}, Sun{0.0, 5.0, 0.0}}) {
    EXPECT_THROW(surface.sample({&at, 1}, sun, 0.0, {&found, 1}), Error);
  }
  for (const double above : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(surface.sample({&at, 1}, Sun{}, above, {&found, 1}), Error);
  }
}

INSTANTIATE_TEST_SUITE_P(Codes, PointShadow, testing::Values(CodeType::kU16, CodeType::kF32));

}  // namespace
}  // namespace isohf
