#include "isohf/convert/frame/plan.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(Plan, CoversTheSourceWithSquareTilesAtTheDensityAskedFor) {
  for (const double density : {0.866, 1.0, 2.0}) {
    PlanRequest request;
    request.density = density;
    const Plan plan = make_plan(raster(16384, 8192), request);
    EXPECT_EQ(plan.grid.shape(), TileShape::make(212, 243, 4));
    EXPECT_DOUBLE_EQ(plan.grid.extent_x(), plan.grid.extent_z());
    EXPECT_NEAR(plan.density, density, 1e-12);
    EXPECT_GE(plan.grid.world_width(), 16383.0);
    EXPECT_LT(plan.grid.world_width(), 16383.0 + plan.grid.extent_x());
    EXPECT_GE(plan.grid.world_height(), 8191.0);
  }
}

TEST(Plan, SpacingIsTheColumnStep) {
  PlanRequest request;
  request.spacing = 2.0;
  const Plan plan = make_plan(raster(3000, 3000), request);
  EXPECT_DOUBLE_EQ(2.0 * plan.grid.sigma_x(), 2.0);
}

TEST(Plan, FitEndsOnTheSourcesEdge) {
  PlanRequest request;
  request.fit = true;
  const Plan plan = make_plan(raster(5000, 3333), request);
  EXPECT_NEAR(plan.grid.world_width(), 4999.0, 1e-9);
  EXPECT_NEAR(plan.grid.world_height(), 3332.0, 1e-9);
  EXPECT_NEAR(plan.density, 1.0, 0.15);
}

TEST(Plan, SmallSourcesGetTilesThatFitThem) {
  for (const int size : {2, 3, 42, 100, 200, 256, 348, 513, 1000, 1201}) {
    const Plan plan = make_plan(raster(size, size), {});
    EXPECT_NEAR(plan.grid.sigma_x() * std::sqrt(3.0) / plan.grid.sigma_z(), 1.0, 0.16) << size;
    // Padding and the last tiles' overhang cost less than 60 % of the samples, once there are enough to speak of.
    if (size >= 42) {
      EXPECT_LT(static_cast<double>(plan.lattice_samples), 1.6 * size * size) << size;
    }
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
  PlanRequest none;
  none.tiles = {{0, 4}};
  EXPECT_THROW((void)make_plan(raster(100, 100), none), Error);
  EXPECT_THROW((void)make_plan(raster(1, 100), {}), Error);
  EXPECT_THROW((void)make_plan(raster(100, 1), {}), Error);
}

}  // namespace
}  // namespace isohf
