#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
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

PlanRequest fit() {
  PlanRequest request;
  request.fit = true;
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

TEST(FittedLattice, EndsOnTheSourcesEdgeWithEquilateralTriangles) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<std::int64_t> side(150, 9000);
  std::uniform_real_distribution<double> stretch(0.5, 2.0);
  for (int i = 0; i < 300; ++i) {
    const std::int64_t width = side(random);
    const std::int64_t height = side(random);
    const double spacing_y = stretch(random);
    const Plan plan = make_plan(posts(width, height, 1.0, spacing_y), fit());
    SCOPED_TRACE(testing::Message() << width << "x" << height << ", spacing 1 x " << spacing_y << ", seed " << kSeed);
    EXPECT_LE(share_beyond_the_source(plan), 1e-12);
    EXPECT_GE(plan.grid.world_width(), static_cast<double>(width - 1)) << "not short of it by a rounding";
    EXPECT_GE(plan.grid.world_height(), static_cast<double>(height - 1) * spacing_y);
    EXPECT_GE(plan.density, 0.97);
    EXPECT_LE(plan.density, 1.05);
    EXPECT_NEAR(aspect(plan), 1.0, 0.03);
    const double square = plan.grid.extent_x() / plan.grid.extent_z();
    EXPECT_LE(std::max(square, 1.0 / square), 1.125 * 1.03) << "an eighth, of nearly equilateral triangles";
    // Padding is the only thing that is stored twice, and tiles stay as large as the usual one.
    EXPECT_LT(static_cast<double>(plan.lattice_samples), 1.2 * static_cast<double>(width * height));
  }
}

TEST(FittedLattice, ADensityOrSpacingThatIsAskedForIsKeptToAFewPerCent) {
  for (const double density : {0.25, 0.866, 2.0}) {
    PlanRequest request = fit();
    request.density = density;
    const Plan plan = make_plan(posts(1500, 1100), request);
    EXPECT_LE(share_beyond_the_source(plan), 1e-12);
    EXPECT_NEAR(plan.density / density, 1.01, 0.041);
    EXPECT_NEAR(aspect(plan), 1.0, 0.03);
  }
  PlanRequest request = fit();
  request.spacing = 1.7;
  const Plan plan = make_plan(posts(1500, 1100), request);
  EXPECT_LE(share_beyond_the_source(plan), 1e-12);
  EXPECT_NEAR(2.0 * plan.grid.sigma_x(), 1.7, 0.1);
}

TEST(FittedLattice, TilesOfAShapeAreStretchedByAnEighthAtMost) {
  for (std::int64_t width = 60; width < 2000; width += 37) {
    PlanRequest request = fit();
    request.shape = {{52, 67}};
    const SourceInfo info = posts(width, 777);
    const Plan plan = make_plan(info, request);
    EXPECT_EQ(plan.grid.shape(), TileShape::make(52, 67, 4));
    const std::vector<Warning> warnings = warnings_of(info, request);
    if (share_beyond_the_source(plan) > 1e-12) {
      EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z()) << width;
      EXPECT_THAT(warnings, testing::ElementsAre(testing::HasSubstr("ask for smaller tiles")));
      EXPECT_LT(width, 250) << "of many tiles each is stretched by little";
    } else {
      EXPECT_NEAR(plan.grid.extent_x() / plan.grid.extent_z(), 1.0, 0.27) << width;
      EXPECT_THAT(warnings, testing::IsEmpty());
    }
  }
}

TEST(FittedLattice, ARasterTooSmallForItGetsSquareTilesAndAWarning) {
  const Plan plan = make_plan(posts(3, 2), fit());
  EXPECT_EQ(plan.grid.extent_x(), plan.grid.extent_z());
  EXPECT_THAT(warnings_of(posts(3, 2), fit()), testing::ElementsAre(testing::HasSubstr("reach beyond its edge")));
  EXPECT_THAT(warnings_of(posts(3, 2), {}), testing::IsEmpty());
}

TEST(FittedLattice, TheLevelsAskedForAreKept) {
  for (const int levels : {1, 3, 6}) {
    PlanRequest request = fit();
    request.levels = levels;
    EXPECT_EQ(make_plan(posts(2000, 2000), request).grid.shape().levels(), levels);
  }
}

}  // namespace
}  // namespace isohf
