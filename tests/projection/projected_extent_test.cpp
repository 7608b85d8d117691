#include "isohf/projection/projected_extent.h"

#include <gtest/gtest.h>

#include <cmath>

namespace isohf {
namespace {

TEST(ProjectedBounds, HoldEveryPlaceOfTheGroundAndLittleMore) {
  ProjectionSpec cone;
  cone.kind = ProjectionKind::kLambertConformal;
  cone.longitude_0 = 10.0;
  cone.latitude_0 = 50.0;
  cone.parallel_1 = 45.0;
  cone.parallel_2 = 55.0;
  ProjectionSpec cylinder;
  cylinder.kind = ProjectionKind::kTransverseMercator;
  cylinder.longitude_0 = 3.0;
  ProjectionSpec pole;
  pole.kind = ProjectionKind::kPolarStereographic;
  pole.parallel_1 = 75.0;
  for (const ProjectionSpec& spec : {cone, cylinder, pole}) {
    const Projection map(spec);
    const GeoExtent ground = spec.kind == ProjectionKind::kPolarStereographic ? GeoExtent{-180.0, 60.0, 180.0, 90.0}
                                                                              : GeoExtent{-5.0, 41.0, 22.0, 61.0};
    const MapBounds bounds = projected_bounds(map, ground);
    double most_east = -HUGE_VAL;
    double most_north = -HUGE_VAL;
    for (int row = 0; row <= 700; ++row) {
      for (int column = 0; column <= 700; ++column) {
        const MapPoint at = map.forward({ground.west + (ground.east - ground.west) * column / 700.0,
                                         ground.south + (ground.north - ground.south) * row / 700.0});
        ASSERT_GE(at.easting, bounds.west);
        ASSERT_LE(at.easting, bounds.east);
        ASSERT_GE(at.northing, bounds.south);
        ASSERT_LE(at.northing, bounds.north);
        most_east = std::max(most_east, at.easting);
        most_north = std::max(most_north, at.northing);
      }
    }
    const double size = bounds.east - bounds.west;
    EXPECT_LT(bounds.east - most_east, 1e-4 * size) << to_string(spec.kind);
    EXPECT_LT(bounds.north - most_north, 1e-4 * size) << to_string(spec.kind);
  }
}

TEST(WorstScaleError, IsFoundWhereItLies) {
  // A transverse Mercator map errs most on the meridian farthest from its own, at the latitude nearest to the equator:
  // on the sphere its scale is 1 / sqrt(1 - (sin(longitude) cos(latitude))^2).
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kTransverseMercator;
  spec.ellipsoid = {1737400.0, 0.0};
  const ScaleError error = worst_scale_error(Projection(spec), {-4.0, 10.0, 8.0, 30.0});
  EXPECT_DOUBLE_EQ(error.place.longitude, 8.0);
  EXPECT_DOUBLE_EQ(error.place.latitude, 10.0);
  const double b = std::sin(8.0 * M_PI / 180.0) * std::cos(10.0 * M_PI / 180.0);
  EXPECT_NEAR(error.worst, 1.0 / std::sqrt(1.0 - b * b) - 1.0, 1e-9);
}

TEST(WorstScaleError, HasNoBoundAtTheEndOfAnEquirectangularMap) {
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kEquirectangular;
  const ScaleError error = worst_scale_error(Projection(spec), {-180.0, -90.0, 180.0, 90.0});
  EXPECT_GT(error.worst, 1e9);
  EXPECT_DOUBLE_EQ(std::abs(error.place.latitude), 90.0);
}

}  // namespace
}  // namespace isohf
