#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "isohf/convert/frame/plan.h"

namespace isohf {
namespace {

SourceInfo posts(std::int64_t width, std::int64_t height, double spacing_x = 1.0, double spacing_y = 1.0) {
  SourceInfo info;
  info.path = "input.tif";
  info.width = width;
  info.height = height;
  info.sample_type = SampleType::kInt16;
  info.georeference.spacing_x = spacing_x;
  info.georeference.spacing_y = spacing_y;
  return info;
}

PlanRequest tiles(std::int64_t columns, std::int64_t rows) {
  PlanRequest request;
  request.tiles = {{columns, rows}};
  return request;
}

std::vector<Warning> warnings_of(const SourceInfo& info, const PlanRequest& request) {
  return plan_warnings(info, make_plan(info, request), request);
}

/// Of the triangles as they are drawn; 1 is equilateral.
double aspect(const Plan& plan) {
  return plan.grid.sigma_x() * std::sqrt(3.0) / plan.grid.sigma_z();
}

double share_beyond_the_source(const Plan& plan) {
  const WorldBounds ground = plan.frame.bounds();
  return plan.grid.world_width() * plan.grid.world_height() / (ground.x1 * ground.z1) - 1.0;
}

TEST(FittedLattice, ANumberOfTilesKeepsTheDensityNearOne) {
  for (const auto& [columns, rows] : std::vector<std::pair<int, int>>{{1, 1}, {2, 2}, {3, 7}, {4, 1}, {1, 5}, {9, 9}}) {
    const SourceInfo info = posts(1201, 1201, 66.27, 92.6);
    const Plan plan = make_plan(info, tiles(columns, rows));
    SCOPED_TRACE(testing::Message() << columns << "x" << rows);
    EXPECT_EQ(plan.grid.tile_columns(), columns);
    EXPECT_EQ(plan.grid.tile_rows(), rows);
    EXPECT_NEAR(plan.density, 1.0, 0.05);
    EXPECT_NEAR(aspect(plan), 1.0, 0.05);
    EXPECT_NEAR(share_beyond_the_source(plan), 0.0, 1e-12);
    EXPECT_THAT(warnings_of(info, tiles(columns, rows)), testing::IsEmpty());
  }
}

TEST(FittedLattice, TilesThatCannotBeSoLargeKeepTheirAspectAndAreWarnedOf) {
  const Plan plan = make_plan(posts(60000, 60000), tiles(1, 1));
  EXPECT_LE(plan.grid.shape().columns(), kMaxTileColumns);
  EXPECT_NEAR(aspect(plan), 1.0, 0.01);
  EXPECT_LT(plan.density, 0.5);
  EXPECT_THAT(warnings_of(posts(60000, 60000), tiles(1, 1)),
              testing::ElementsAre(testing::HasSubstr("ask for other `tiles`")));
}

TEST(FittedLattice, AShapeAndTilesThatThinOutTheSourceAreWarnedOfWithTheFigure) {
  PlanRequest request = tiles(2, 2);
  request.shape = {{52, 67}};
  const Plan plan = make_plan(posts(1201, 1201), request);
  EXPECT_EQ(plan.grid.shape(), TileShape::make(52, 67, 4)) << "what is asked for is done";
  const std::vector<Warning> warnings = warnings_of(posts(1201, 1201), request);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], testing::HasSubstr("0.00853 vertices for one of the input's samples"));
  EXPECT_THAT(warnings[0], testing::HasSubstr("leave out `shape` or `tiles`"));
  request.shape.reset();
  request.budget = ShapeBudget{ShapeBudget::Kind::kTriangles, 1000000};
  EXPECT_THAT(warnings_of(posts(201, 201), request), testing::SizeIs(1)) << "far more than there are samples";
}

TEST(FittedLattice, ADensityOrSpacingThatIsAskedForIsNotWarnedOf) {
  PlanRequest request;
  request.density = 0.01;
  EXPECT_THAT(warnings_of(posts(1201, 1201), request), testing::IsEmpty());
  request = {};
  request.spacing = 50.0;
  EXPECT_THAT(warnings_of(posts(1201, 1201), request), testing::IsEmpty());
}

TEST(FittedLattice, EndsOnTheSourcesEdgeWithEquilateralTriangles) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<std::int64_t> side(150, 9000);
  std::uniform_real_distribution<double> stretch(0.5, 2.0);
  for (int i = 0; i < 300; ++i) {
    const std::int64_t width = side(random);
    const std::int64_t height = side(random);
    const double spacing_y = stretch(random);
    const Plan plan = make_plan(posts(width, height, 1.0, spacing_y), {});
    SCOPED_TRACE(testing::Message() << width << "x" << height << ", spacing 1 x " << spacing_y << ", seed " << kSeed);
    EXPECT_LE(share_beyond_the_source(plan), 1e-12);
    EXPECT_GE(plan.grid.world_width(), static_cast<double>(width - 1)) << "not short of it by a rounding";
    EXPECT_GE(plan.grid.world_height(), static_cast<double>(height - 1) * spacing_y);
    EXPECT_GE(plan.density, 0.97);
    EXPECT_LE(plan.density, 1.05);
    EXPECT_NEAR(aspect(plan), 1.0, 0.03);
    // Padding is the only thing that is stored twice, and tiles stay as large as the usual one.
    EXPECT_LT(static_cast<double>(plan.lattice_samples), 1.2 * static_cast<double>(width * height));
  }
}

TEST(FittedLattice, WhatIsAskedForKeepsItsSquareTiles) {
  PlanRequest density;
  density.density = 0.866;
  PlanRequest spacing;
  spacing.spacing = 1.3;
  PlanRequest shape;
  shape.shape = {{52, 67}};
  PlanRequest budget;
  budget.budget = ShapeBudget{ShapeBudget::Kind::kTriangles, 20000};
  for (const PlanRequest& request : {density, spacing, shape, budget}) {
    const Plan plan = make_plan(posts(1500, 1100), request);
    EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z());
  }
}

TEST(FittedLattice, TheLevelsAskedForAreKept) {
  for (const int levels : {1, 3, 6}) {
    PlanRequest request;
    request.levels = levels;
    EXPECT_EQ(make_plan(posts(2000, 2000), request).grid.shape().levels(), levels);
    request.tiles = {{2, 3}};
    EXPECT_EQ(make_plan(posts(2000, 2000), request).grid.shape().levels(), levels);
  }
}

}  // namespace
}  // namespace isohf
