#include "isohf/projection/projected_extent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace isohf {
namespace {

constexpr int kStepsPerSide = 1024;
constexpr int kPlaces = 33;

double between(double a, double b, int step, int steps) {
  // Ends exactly on b: a + (b - a) need not.
  return step == steps ? b : a + (b - a) * (static_cast<double>(step) / steps);
}

void include(double& low, double& high, double value) {
  // A NaN stays.
  if (!(value >= low)) low = value;
  if (!(value <= high)) high = value;
}

}  // namespace

MapBounds projected_bounds(const Projection& projection, const GeoExtent& ground) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  MapBounds bounds{kInfinity, kInfinity, -kInfinity, -kInfinity};
  const std::array<GeoPoint, 5> corners = {{{ground.west, ground.north},
                                            {ground.east, ground.north},
                                            {ground.east, ground.south},
                                            {ground.west, ground.south},
                                            {ground.west, ground.north}}};
  double bend = 0.0;
  bool is_whole = true;
  for (std::size_t side = 0; side < 4; ++side) {
    const GeoPoint& from = corners[side];
    const GeoPoint& to = corners[side + 1];
    MapPoint before;
    MapPoint last;
    for (int i = 0; i <= kStepsPerSide; ++i) {
      // Sides of the extent may lie 360 degrees apart: longitudes are left as they are but for the first's sake.
      const MapPoint at = projection.forward({between(from.longitude, to.longitude, i, kStepsPerSide),
                                              between(from.latitude, to.latitude, i, kStepsPerSide)});
      is_whole = is_whole && std::isfinite(at.easting) && std::isfinite(at.northing);
      include(bounds.west, bounds.east, at.easting);
      include(bounds.south, bounds.north, at.northing);
      if (i >= 2) {
        const double dx = at.easting - 2.0 * last.easting + before.easting;
        const double dy = at.northing - 2.0 * last.northing + before.northing;
        bend = std::max(bend, std::hypot(dx, dy));
      }
      before = last;
      last = at;
    }
  }
  if (!is_whole) return {NAN, NAN, NAN, NAN};
  // An arc rises above its chord by an eighth of its second difference.
  const double rise = bend / 8.0;
  return {bounds.west - rise, bounds.south - rise, bounds.east + rise, bounds.north + rise};
}

ScaleError worst_scale_error(const Projection& projection, const GeoExtent& ground) {
  ScaleError found;
  found.place = ground.middle();
  for (int row = 0; row < kPlaces; ++row) {
    const double latitude = between(ground.north, ground.south, row, kPlaces - 1);
    for (int column = 0; column < kPlaces; ++column) {
      const GeoPoint place{between(ground.west, ground.east, column, kPlaces - 1), latitude};
      const double error = projection.scale(place).error();
      if (error > found.worst || std::isnan(error)) {
        found = {std::isnan(error) ? std::numeric_limits<double>::infinity() : error, place};
      }
    }
  }
  return found;
}

}  // namespace isohf
