#include "isohf/convert/frame/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "isohf/error.h"

namespace isohf {
namespace {

SourceInfo raster(std::int64_t width, std::int64_t height) {
  SourceInfo info;
  info.path = "input.tif";
  info.width = width;
  info.height = height;
  info.sample_type = SampleType::kInt16;
  return info;
}

SourceInfo degrees(std::int64_t size, double spacing, double north) {
  SourceInfo info = raster(size, size);
  info.georeference.unit = HorizontalUnit::kDegree;
  info.georeference.registration = Registration::kPoint;
  info.georeference.spacing_x = info.georeference.spacing_y = spacing;
  info.georeference.has_origin = true;
  info.georeference.origin_y = north;
  return info;
}

TEST(SourceFrame, DegreesBecomeMetresAtTheMiddleLatitude) {
  // WGS 84 at 44.5 N: one degree is 79.53 km along the parallel and 111.12 km along the meridian (published tables).
  const SourceFrame frame = make_source_frame(degrees(1201, 1.0 / 1200.0, 45.0));
  EXPECT_NEAR(frame.spacing_x * 1200.0, 79530.0, 60.0);
  EXPECT_NEAR(frame.spacing_z * 1200.0, 111120.0, 30.0);
  EXPECT_TRUE(frame.in_metres);
}

TEST(SourceFrame, AnotherBodyHasItsOwnDegrees) {
  SourceInfo info = degrees(721, 0.25, 90.0);
  info.georeference.system.semi_major_axis_m = 3396190.0;  // Mars, a sphere where no flattening is declared
  const SourceFrame frame = make_source_frame(info);
  EXPECT_NEAR(frame.spacing_x, 3396190.0 * 0.25 * M_PI / 180.0, 1e-6);
  EXPECT_NEAR(frame.spacing_z, frame.spacing_x, 1e-6);
}

TEST(SourceFrame, APoleIsRefused) {
  EXPECT_THROW((void)make_source_frame(degrees(3, 0.01, 90.0)), Error);
}

TEST(SourceFrame, AreaStartsHalfASpacingInPointAtTheFirstSample) {
  SourceInfo info = raster(100, 50);
  info.georeference.registration = Registration::kArea;
  info.georeference.spacing_x = info.georeference.spacing_y = 30.0;
  const SourceFrame area = make_source_frame(info);
  EXPECT_DOUBLE_EQ(area.first_sample_x, 15.0);
  EXPECT_DOUBLE_EQ(area.bounds().x1, 3000.0);
  EXPECT_DOUBLE_EQ(area.bounds().z1, 1500.0);
  info.georeference.registration = Registration::kPoint;
  const SourceFrame point = make_source_frame(info);
  EXPECT_DOUBLE_EQ(point.first_sample_x, 0.0);
  EXPECT_DOUBLE_EQ(point.bounds().x1, 2970.0);
}

TEST(Plan, CoversTheSourceWithSquareTilesOfNearlyEquilateralTriangles) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<std::int64_t> side(2, 9000);
  std::uniform_real_distribution<double> stretch(0.5, 2.0);
  for (int i = 0; i < 300; ++i) {
    SourceInfo info = raster(side(random), side(random));
    info.georeference.spacing_y = stretch(random);
    const Plan plan = make_plan(info, {});
    SCOPED_TRACE(testing::Message() << info.width << "x" << info.height << ", spacing 1 x "
                                    << info.georeference.spacing_y << ", seed " << kSeed);
    const WorldBounds ground = plan.frame.bounds();
    EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z());
    EXPECT_NEAR(plan.grid.shape().aspect(), 1.0, 0.02);
    EXPECT_GE(plan.density, 0.97 - 1e-9);
    EXPECT_LE(plan.density, 1.05 + 1e-9);
    EXPECT_GE(plan.grid.world_width(), ground.x1 * (1.0 - 1e-9));
    EXPECT_GE(plan.grid.world_height(), ground.z1 * (1.0 - 1e-9));
    EXPECT_LT(plan.grid.world_width() - plan.grid.extent_x(), ground.x1) << "no column of tiles has nothing";
    EXPECT_LT(plan.grid.world_height() - plan.grid.extent_z(), ground.z1);
    EXPECT_EQ(plan.grid.shape().levels(), info.width > 500 && info.height > 500 ? 4 : plan.grid.shape().levels());
  }
}

TEST(Plan, ADensityOrSpacingAskedForIsKept) {
  for (const double density : {0.866, 1.0, 2.0}) {
    PlanRequest request;
    request.density = density;
    const Plan plan = make_plan(raster(16384, 8192), request);
    EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z());
    EXPECT_NEAR(plan.density, density, 1e-12);
  }
  PlanRequest request;
  request.spacing = 2.0;
  EXPECT_DOUBLE_EQ(2.0 * make_plan(raster(3000, 3000), request).grid.sigma_x(), 2.0);
}

TEST(Plan, ARasterThatOneUsualTileCoversIsOneTile) {
  for (const auto& [width, height] : {std::pair{50, 40}, {3, 2}, {8, 23}, {200, 224}, {42, 42}, {224, 9}}) {
    const Plan plan = make_plan(raster(width, height), {});
    EXPECT_EQ(plan.grid.tile_count(), 1) << width << "x" << height;
    EXPECT_LE(plan.lattice_samples, 66000) << width << "x" << height;
  }
}

TEST(Plan, TheExtentOfAJoinedGlobeIsItsCircumferenceOverAWholeNumber) {
  for (const int rows : {12, 180, 1234}) {
    SourceInfo info = raster(2 * rows, rows);
    info.georeference.unit = HorizontalUnit::kDegree;
    info.georeference.registration = Registration::kArea;
    info.georeference.spacing_x = info.georeference.spacing_y = 180.0 / rows;
    info.georeference.has_origin = true;
    info.georeference.origin_x = -180.0 + 90.0 / rows;
    info.georeference.origin_y = 90.0 - 90.0 / rows;
    const Plan plan = make_plan(info, {});
    ASSERT_TRUE(plan.frame.wraps_x);
    EXPECT_DOUBLE_EQ(plan.grid.world_width(), plan.frame.bounds().x1) << rows;
    EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z()) << rows;
    EXPECT_GE(plan.grid.world_height(), plan.frame.bounds().z1 * (1.0 - 1e-9)) << rows;
  }
}

TEST(Plan, TheLevelsAskedForAreKept) {
  for (const int levels : {1, 3, 6, 9, 14}) {
    PlanRequest request;
    request.levels = levels;
    EXPECT_EQ(make_plan(raster(2000, 2000), request).grid.shape().levels(), levels);
  }
}

TEST(Plan, SmallSourcesGetTilesThatFitThem) {
  for (const int size : {42, 100, 200, 256, 348, 513, 1000, 1201}) {
    const Plan plan = make_plan(raster(size, size), {});
    // Padding and the last tiles' ground beyond the edge cost less than 60 % of the samples.
    EXPECT_LT(static_cast<double>(plan.lattice_samples), 1.6 * size * size) << size;
  }
}

TEST(Plan, ContradictionsAndNonsenseAreRefused) {
  const std::optional<double> usual;
  for (const auto& [density, spacing] : {std::pair{std::optional(1.0), std::optional(1.0)},
                                         {-1.0, usual},
                                         {1e9, usual},
                                         {usual, std::nan("")},
                                         {usual, 1e-12}}) {
    PlanRequest request;
    request.density = density;
    request.spacing = spacing;
    EXPECT_THROW((void)make_plan(raster(100, 100), request), Error);
  }
  EXPECT_THROW((void)make_plan(raster(1, 100), {}), Error);
  EXPECT_THROW((void)make_plan(raster(100, 1), {}), Error);
}

}  // namespace
}  // namespace isohf
