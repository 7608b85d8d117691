#include "isohf/projection/reference_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace isohf {
namespace {

constexpr int kPlaces = 33;
constexpr double kRadiansPerDegree = M_PI / 180.0;
/// Half of the step of differences, for the body's axis: of 40 m on the Earth. Their error is a square of it.
constexpr double kStep = 3e-6;

using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// From the body's middle, metres: what lies next to each other on the ground does so here, at poles and across the
/// 180th meridian as well.
Vector place_in_space(const Ellipsoid& body, GeoPoint place) {
  const double f = body.flattening();
  const double e2 = f * (2.0 - f);
  const double sine = std::sin(place.latitude * kRadiansPerDegree);
  const double normal = body.semi_major_axis_m / std::sqrt(1.0 - e2 * sine * sine);
  const double from_axis = normal * std::cos(place.latitude * kRadiansPerDegree);
  return {from_axis * std::cos(place.longitude * kRadiansPerDegree),
          from_axis * std::sin(place.longitude * kRadiansPerDegree), normal * (1.0 - e2) * sine};
}

/// To this many digits nothing shows the last bits in which mathematical libraries differ: 1 mm, and 1 mm in 10 km.
double rounded(double value, double grain) {
  return std::round(value / grain) * grain;
}
constexpr double kDegreeGrain = 1e-8;
constexpr double kScaleGrain = 1e-7;
/// Of a scale: more is that of a place that the map draws as a line.
constexpr double kBoundless = 1e6;

GeoPoint rounded(const GeoPoint& place) {
  return {rounded(place.longitude, kDegreeGrain), rounded(place.latitude, kDegreeGrain)};
}

double between(double a, double b, int step) {
  return step == kPlaces - 1 ? b : a + (b - a) * (static_cast<double>(step) / (kPlaces - 1));
}

/// Grows by longitudes on the turn nearest to the first one's, and by latitudes.
void include(GeoExtent& extent, const GeoPoint& middle, const GeoPoint& place) {
  const double longitude = middle.longitude + std::remainder(place.longitude - middle.longitude, 360.0);
  extent.west = std::min(extent.west, longitude);
  extent.east = std::max(extent.east, longitude);
  extent.south = std::min(extent.south, place.latitude);
  extent.north = std::max(extent.north, place.latitude);
}

/// Rows of a map that go on beyond a pole, as half an area may, count as the pole.
GeoPoint on_the_body(GeoPoint place) {
  return {place.longitude, std::clamp(place.latitude, -90.0, 90.0)};
}

bool holds(const MapBounds& bounds, const MapPoint& place) {
  return place.easting >= bounds.west && place.easting <= bounds.east && place.northing >= bounds.south &&
         place.northing <= bounds.north;
}

}  // namespace

double PlaceScale::error() const {
  return std::max(std::abs(least - 1.0), std::abs(most - 1.0));
}

double PlaceScale::mean() const {
  return std::sqrt(areal);
}

PlaceScale scale_at(const ReferenceMap& map, MapPoint place) {
  const double metres = map.metres_per_unit();
  const double step = kStep * map.ellipsoid().semi_major_axis_m / metres;
  const auto along = [&](double easting, double northing) {
    const Vector a =
        place_in_space(map.ellipsoid(), map.geo_from_map({place.easting - easting, place.northing - northing}));
    const Vector b =
        place_in_space(map.ellipsoid(), map.geo_from_map({place.easting + easting, place.northing + northing}));
    const double length = 2.0 * std::hypot(easting, northing);
    return Vector{(b[0] - a[0]) / length, (b[1] - a[1]) / length, (b[2] - a[2]) / length};
  };
  const Vector east = along(step, 0.0);
  const Vector north = along(0.0, step);
  // The ground's metres for a unit of the map: g = J^T J, whose eigenvalues are squares of 1 / scale.
  const double g11 = dot(east, east);
  const double g12 = dot(east, north);
  const double g22 = dot(north, north);
  const double half_trace = (g11 + g22) / 2.0;
  const double spread = std::hypot((g11 - g22) / 2.0, g12);
  PlaceScale scale;
  scale.ground_m_per_easting = std::sqrt(g11);
  scale.ground_m_per_northing = std::sqrt(g22);
  scale.least = metres / std::sqrt(half_trace + spread);
  const double determinant = g11 * g22 - g12 * g12;
  scale.areal = metres * metres / std::sqrt(determinant);
  scale.most = scale.areal / scale.least;
  scale.angular_deg = 2.0 * std::asin((scale.most - scale.least) / (scale.most + scale.least)) / kRadiansPerDegree;
  // A direction of the ground is J times one of the map.
  const GeoPoint geo = map.geo_from_map(place);
  const double sine = std::sin(geo.latitude * kRadiansPerDegree);
  const Vector to_east = {-std::sin(geo.longitude * kRadiansPerDegree), std::cos(geo.longitude * kRadiansPerDegree),
                          0.0};
  const Vector to_north = {-sine * std::cos(geo.longitude * kRadiansPerDegree),
                           -sine * std::sin(geo.longitude * kRadiansPerDegree),
                           std::cos(geo.latitude * kRadiansPerDegree)};
  const auto scale_towards = [&](const Vector& direction) {
    const double a = dot(east, direction);
    const double b = dot(north, direction);
    return metres * std::hypot((g22 * a - g12 * b) / determinant, (g11 * b - g12 * a) / determinant);
  };
  scale.meridional = scale_towards(to_north);
  scale.parallel = scale_towards(to_east);
  if (std::isfinite(scale.areal + scale.meridional + scale.parallel)) return scale;
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  return {kNoNumber, kNoNumber, kNoNumber, kNoNumber, kNoNumber, kNoNumber, kNoNumber, kNoNumber};
}

std::optional<double> turn_of(const ReferenceMap& map, MapPoint near) {
  const double longitude = map.geo_from_map(near).longitude;
  if (!std::isfinite(longitude)) return std::nullopt;
  constexpr double kReach = 30.0;
  const auto sixth_of_turn = [&](double middle) -> std::optional<double> {
    std::optional<double> sixth;
    for (const double latitude : {0.0, 40.0, -65.0}) {
      const auto at = [&](double degrees) {
        return map.map_from_geo({std::remainder(middle + degrees, 360.0), latitude});
      };
      const MapPoint west = at(-kReach);
      const MapPoint here = at(0.0);
      const MapPoint east = at(kReach);
      const double length = east.easting - west.easting;
      const double least = 1e-9 * std::abs(length);
      if (!sixth) sixth = length;
      if (!(length > 0.0) || !(std::abs(length - *sixth) <= least) ||
          !(std::abs(here.easting - west.easting - 0.5 * length) <= least) ||
          !(std::abs(west.northing - here.northing) <= least) || !(std::abs(east.northing - here.northing) <= least)) {
        return std::nullopt;
      }
    }
    return sixth;
  };
  // One of them is not where the map is cut open.
  auto sixth = sixth_of_turn(longitude);
  if (!sixth) sixth = sixth_of_turn(longitude + 90.0);
  return sixth ? std::optional(6.0 * *sixth) : std::nullopt;
}

std::optional<MapGround> ground_under(const ReferenceMap& map, const MapBounds& bounds) {
  MapGround ground;
  ground.centre = on_the_body(map.geo_from_map(bounds.middle()));
  GeoPoint first = ground.centre;
  ground.extent = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  ground.least_scale = HUGE_VAL;
  ground.most_scale = 0.0;
  ground.worst_error = -1.0;
  double sum = 0.0;
  int count = 0;
  bool goes_round = false;
  for (int row = 0; row < kPlaces; ++row) {
    double turned = 0.0;
    double before = NAN;
    for (int column = 0; column < kPlaces; ++column) {
      const MapPoint place{between(bounds.west, bounds.east, column), between(bounds.north, bounds.south, row)};
      const GeoPoint geo = map.geo_from_map(place);
      if (column > 0) turned += std::remainder(geo.longitude - before, 360.0);
      before = geo.longitude;
      if (!std::isfinite(geo.longitude) || !std::isfinite(geo.latitude)) continue;
      if (!std::isfinite(first.longitude)) first = geo;
      include(ground.extent, first, on_the_body(geo));
      if (std::abs(geo.latitude) > 90.0) continue;
      const PlaceScale scale = scale_at(map, place);
      if (!(scale.most < kBoundless)) continue;  // a pole that is a line
      ++count;
      sum += scale.mean();
      ground.least_scale = std::min(ground.least_scale, scale.least);
      ground.most_scale = std::max(ground.most_scale, scale.most);
      // Of places that are alike but for last bits the first one.
      if (scale.error() <= ground.worst_error + kScaleGrain) continue;
      ground.worst_error = scale.error();
      ground.worst_place = geo;
    }
    goes_round = goes_round || std::abs(turned) >= 360.0 - kDegreeGrain;
  }
  if (count == 0) return std::nullopt;
  ground.mean_scale = rounded(sum / count, kScaleGrain);
  ground.least_scale = rounded(ground.least_scale, kScaleGrain);
  ground.most_scale = rounded(ground.most_scale, kScaleGrain);
  ground.worst_error = rounded(ground.worst_error, kScaleGrain);
  ground.worst_place = rounded(ground.worst_place);
  ground.centre = rounded(ground.centre);
  for (double* const side : {&ground.extent.west, &ground.extent.south, &ground.extent.east, &ground.extent.north}) {
    *side = rounded(*side, kDegreeGrain);
  }
  if (goes_round) ground.extent.east = ground.extent.west + 360.0;
  for (const double pole : {90.0, -90.0}) {
    const MapPoint here = map.map_from_geo({first.longitude, pole});
    if (!holds(bounds, here)) continue;
    (pole > 0.0 ? ground.extent.north : ground.extent.south) = pole;
    // Around a pole that is a point lie all longitudes, under one that is a line those that are found.
    const MapPoint there = map.map_from_geo({first.longitude + 90.0, pole});
    const double apart = std::hypot(there.easting - here.easting, there.northing - here.northing);
    if (apart * map.metres_per_unit() > kStep * map.ellipsoid().semi_major_axis_m) continue;
    ground.extent.west = first.longitude - 180.0;
    ground.extent.east = first.longitude + 180.0;
  }
  return ground;
}

}  // namespace isohf
