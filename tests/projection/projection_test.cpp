#include "isohf/projection/projection.h"

#include <gtest/gtest.h>

#include <GeographicLib/Geodesic.hpp>
#include <GeographicLib/PolygonArea.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <cmath>
#include <random>

#include "isohf/error.h"
#include "isohf/projection/choose_projection.h"

namespace isohf {
namespace {

constexpr Ellipsoid kEarth{};
constexpr Ellipsoid kMars{3396190.0, 169.894447223612};
constexpr Ellipsoid kMoon{1737400.0, 0.0};

constexpr ProjectionKind kMaps[] = {
    ProjectionKind::kEquirectangular,    ProjectionKind::kLocal,
    ProjectionKind::kTransverseMercator, ProjectionKind::kUtm,
    ProjectionKind::kLambertConformal,   ProjectionKind::kPolarStereographic,
};

ProjectionRequest request_of(ProjectionKind kind) {
  ProjectionRequest request;
  request.is_auto = false;
  request.kind = kind;
  return request;
}

struct Ground {
  Ellipsoid ellipsoid;
  GeoExtent extent;
};

const Ground kGrounds[] = {{kEarth, {6.0, 44.0, 7.0, 45.0}},     {kEarth, {-75.0, -55.0, -66.0, -49.0}},
                           {kEarth, {178.5, 61.0, 184.0, 66.0}}, {kEarth, {18.0, 74.0, 27.0, 80.0}},
                           {kMars, {-60.0, -14.0, -50.0, -4.0}}, {kMars, {137.0, 80.0, 147.0, 85.0}},
                           {kMoon, {350.0, -45.0, 360.0, -40.0}}};

/// All kinds that suit a ground, with their stated error.
template <typename Test>
void for_each_map(const Test& test) {
  for (const Ground& ground : kGrounds) {
    for (const ProjectionKind kind : kMaps) {
      if (kind == ProjectionKind::kUtm && !(ground.ellipsoid == kEarth)) continue;
      const ProjectionChoice choice =
          choose_projection(request_of(kind), {"dem.tif", "", ground.ellipsoid, ground.extent, false, false});
      SCOPED_TRACE(to_string(kind) + " at longitude " + std::to_string(ground.extent.west) + ", latitude " +
                   std::to_string(ground.extent.south));
      test(ground, Projection(choice.spec), choice.error);
    }
  }
}

TEST(Projection, InverseLeadsBack) {
  for_each_map([](const Ground& ground, const Projection& map, const ScaleError&) {
    for (int row = 0; row <= 8; ++row) {
      for (int column = 0; column <= 8; ++column) {
        const GeoPoint place{ground.extent.west + (ground.extent.east - ground.extent.west) * column / 8.0,
                             ground.extent.south + (ground.extent.north - ground.extent.south) * row / 8.0};
        const GeoPoint back = map.inverse(map.forward(place));
        // GeographicLib's series are good to nanometres; a nanodegree is a tenth of a millimetre.
        EXPECT_NEAR(std::remainder(back.longitude - place.longitude, 360.0), 0.0, 1e-9);
        EXPECT_NEAR(back.latitude, place.latitude, 1e-9);
        EXPECT_LE(std::abs(back.longitude), 180.0);
      }
    }
  });
}

TEST(Projection, LengthsAreThoseOfGeodesicsWithinTheStatedScale) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for_each_map([&](const Ground& ground, const Projection& map, const ScaleError& stated) {
    const GeographicLib::Geodesic geodesic(ground.ellipsoid.semi_major_axis_m, ground.ellipsoid.flattening());
    const GeoExtent& e = ground.extent;
    for (int i = 0; i < 300; ++i) {
      // The inner 98 %, so that a length of 200 m does not leave the ground.
      const GeoPoint from{e.west + (e.east - e.west) * (0.01 + 0.98 * uniform(random)),
                          e.south + (e.north - e.south) * (0.01 + 0.98 * uniform(random))};
      GeoPoint to;
      const double length = 200.0;
      geodesic.Direct(from.latitude, from.longitude, 360.0 * uniform(random), length, to.latitude, to.longitude);
      const MapPoint a = map.forward(from);
      const MapPoint b = map.forward(to);
      const double ratio = std::hypot(b.easting - a.easting, b.northing - a.northing) / length;
      // Over 200 m a scale of these maps changes by less than 1e-4: 200 m / radius times 3.
      constexpr double kChange = 2e-4;
      const MapScale scale = map.scale(from);
      EXPECT_GE(ratio, scale.least - kChange);
      EXPECT_LE(ratio, scale.most + kChange);
      EXPECT_LE(std::abs(ratio - 1.0), stated.worst + kChange);
    }
  });
}

TEST(Projection, AreasAreThoseOfGeodesicTrianglesWithinTheStatedScale) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for_each_map([&](const Ground& ground, const Projection& map, const ScaleError& stated) {
    const GeographicLib::Geodesic geodesic(ground.ellipsoid.semi_major_axis_m, ground.ellipsoid.flattening());
    const GeoExtent& e = ground.extent;
    for (int i = 0; i < 100; ++i) {
      const GeoPoint middle{e.west + (e.east - e.west) * (0.02 + 0.96 * uniform(random)),
                            e.south + (e.north - e.south) * (0.02 + 0.96 * uniform(random))};
      GeographicLib::PolygonArea polygon(geodesic);
      MapPoint corners[3];
      const double turn = 360.0 * uniform(random);
      for (int k = 0; k < 3; ++k) {
        GeoPoint corner;
        geodesic.Direct(middle.latitude, middle.longitude, turn - 120.0 * k, 300.0, corner.latitude, corner.longitude);
        polygon.AddPoint(corner.latitude, corner.longitude);
        corners[k] = map.forward(corner);
      }
      double perimeter = 0.0;
      double area = 0.0;
      polygon.Compute(false, true, perimeter, area);
      const double mapped =
          0.5 * std::abs((corners[1].easting - corners[0].easting) * (corners[2].northing - corners[0].northing) -
                         (corners[2].easting - corners[0].easting) * (corners[1].northing - corners[0].northing));
      const double ratio = mapped / std::abs(area);
      const MapScale scale = map.scale(middle);
      constexpr double kChange = 6e-4;  // as above, over 600 m
      EXPECT_NEAR(ratio, scale.least * scale.most, kChange);
      EXPECT_LE(ratio, (1.0 + stated.worst) * (1.0 + stated.worst) + kChange);
      EXPECT_GE(ratio, (1.0 - stated.worst) * (1.0 - stated.worst) - kChange);
    }
  });
}

// Snyder 1987, Map Projections: A Working Manual, appendix A, pages 269, 296 and 315; printed to a decimetre.
TEST(Projection, AgreesWithSnydersExamples) {
  const Ellipsoid clarke{6378206.4, 294.978698213898};
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kLambertConformal;
  spec.ellipsoid = clarke;
  spec.longitude_0 = -96.0;
  spec.latitude_0 = 23.0;
  spec.parallel_1 = 33.0;
  spec.parallel_2 = 45.0;
  MapPoint at = Projection(spec).forward({-75.0, 35.0});
  EXPECT_NEAR(at.easting, 1894410.9, 0.1);
  EXPECT_NEAR(at.northing, 1564649.5, 0.1);

  spec = {};
  spec.kind = ProjectionKind::kTransverseMercator;
  spec.ellipsoid = clarke;
  spec.longitude_0 = -75.0;
  spec.scale_0 = 0.9996;
  at = Projection(spec).forward({-73.5, 40.5});
  EXPECT_NEAR(at.easting, 127106.5, 0.1);
  EXPECT_NEAR(at.northing, 4484124.4, 0.1);

  spec = {};
  spec.kind = ProjectionKind::kPolarStereographic;
  spec.ellipsoid = {6378388.0, 297.0};
  spec.longitude_0 = -100.0;
  spec.parallel_1 = -71.0;
  at = Projection(spec).forward({150.0, -75.0});
  EXPECT_NEAR(at.easting, -1540033.6, 0.1);
  EXPECT_NEAR(at.northing, -560526.4, 0.1);
}

TEST(Projection, UtmIsUtm) {
  for (const GeoExtent& extent : {GeoExtent{6.0, 44.0, 7.0, 45.0}, GeoExtent{145.0, -36.0, 146.0, -35.0}}) {
    const ProjectionChoice choice =
        choose_projection(request_of(ProjectionKind::kUtm), {"dem.tif", "Earth", kEarth, extent, false, false});
    int zone = 0;
    bool is_north = false;
    double x = 0.0;
    double y = 0.0;
    GeographicLib::UTMUPS::Forward(extent.south, extent.west, zone, is_north, x, y);
    EXPECT_EQ(choice.spec.utm_zone, is_north ? zone : -zone);
    const MapPoint at = Projection(choice.spec).forward({extent.west, extent.south});
    EXPECT_NEAR(at.easting, x, 1e-6);
    EXPECT_NEAR(at.northing, y, 1e-6);
  }
}

TEST(Projection, ALengthOfAnotherBodyIsThatBodys) {
  // A degree of the meridian of a sphere.
  const ProjectionChoice choice = choose_projection(request_of(ProjectionKind::kLocal),
                                                    {"moon.img", "Moon", kMoon, {10.0, 0.0, 11.0, 1.0}, false, false});
  const Projection map(choice.spec);
  EXPECT_NEAR(map.forward({10.5, 1.0}).northing - map.forward({10.5, 0.0}).northing, 1737400.0 * M_PI / 180.0, 1e-6);
}

TEST(Projection, PlacesOffTheBodyAreNowhere) {
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kLocal;
  const Projection map(spec);
  EXPECT_TRUE(std::isnan(map.forward({0.0, 90.1}).easting));
  EXPECT_TRUE(std::isnan(map.forward({NAN, 0.0}).easting));
}

TEST(Projection, ParametersThatMakeNoMapAreRefused) {
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kLambertConformal;
  spec.parallel_1 = 40.0;
  spec.parallel_2 = 50.0;
  spec.ellipsoid.semi_major_axis_m = -1.0;
  EXPECT_THROW(Projection{spec}, Error);
  EXPECT_THROW(Projection{ProjectionSpec{}}, Error);
}

}  // namespace
}  // namespace isohf
