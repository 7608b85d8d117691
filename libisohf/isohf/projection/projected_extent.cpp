#include "isohf/projection/projected_extent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace isohf {
namespace {

constexpr int kStepsPerSide = 1024;
constexpr int kPlacesPerSide = 33;

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

MapBounds image_bounds(const MapBounds& rectangle, const std::function<MapPoint(const MapPoint&)>& image,
                       int steps_per_side) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  MapBounds bounds{kInfinity, kInfinity, -kInfinity, -kInfinity};
  const std::array<MapPoint, 5> corners = {{{rectangle.west, rectangle.north},
                                            {rectangle.east, rectangle.north},
                                            {rectangle.east, rectangle.south},
                                            {rectangle.west, rectangle.south},
                                            {rectangle.west, rectangle.north}}};
  double bend = 0.0;
  bool is_whole = true;
  for (std::size_t side = 0; side < 4; ++side) {
    const MapPoint& from = corners[side];
    const MapPoint& to = corners[side + 1];
    MapPoint before;
    MapPoint last;
    for (int i = 0; i <= steps_per_side; ++i) {
      const MapPoint at = image(MapPoint{between(from.easting, to.easting, i, steps_per_side),
                                         between(from.northing, to.northing, i, steps_per_side)});
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
  // Between two places of a side the map is cut open.
  constexpr double kMostBend = 0.25;
  if (bend > kMostBend * std::max(bounds.east - bounds.west, bounds.north - bounds.south)) {
    return {NAN, NAN, NAN, NAN};
  }
  // An arc rises above its chord by an eighth of its second difference.
  const double rise = bend / 8.0;
  return {bounds.west - rise, bounds.south - rise, bounds.east + rise, bounds.north + rise};
}

MapBounds projected_bounds(const Projection& projection, const GeoExtent& ground) {
  // Sides of the extent may lie 360 degrees apart: longitudes are left as they are but for the first's sake.
  return image_bounds(
      {ground.west, ground.south, ground.east, ground.north},
      [&](const MapPoint& at) {
        return projection.forward({at.easting, at.northing});
      },
      kStepsPerSide);
}

MapBounds projected_bounds(const Projection& projection, const ReferenceMap& map, const MapBounds& rectangle) {
  return image_bounds(
      rectangle, [&](const MapPoint& at) { return projection.forward(map.geo_from_map(at)); }, kStepsPerSide);
}

ScaleError worst_scale_error(const Projection& projection, const GeoExtent& ground) {
  ScaleError found;
  found.place = ground.middle();
  for (int row = 0; row < kPlacesPerSide; ++row) {
    const double latitude = between(ground.north, ground.south, row, kPlacesPerSide - 1);
    for (int column = 0; column < kPlacesPerSide; ++column) {
      const GeoPoint place{between(ground.west, ground.east, column, kPlacesPerSide - 1), latitude};
      const double error = projection.scale(place).error();
      if (error > found.worst || std::isnan(error)) {
        found = {std::isnan(error) ? std::numeric_limits<double>::infinity() : error, place};
      }
    }
  }
  return found;
}

}  // namespace isohf
