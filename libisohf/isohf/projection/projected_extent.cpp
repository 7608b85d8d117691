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

bool is_shown(const MapPoint& at) {
  return std::isfinite(at.easting) && std::isfinite(at.northing);
}

double distance(const MapPoint& a, const MapPoint& b) {
  return std::hypot(a.easting - b.easting, a.northing - b.northing);
}

void include(MapBounds& bounds, const MapPoint& at) {
  if (!is_shown(at)) return;
  include(bounds.west, bounds.east, at.easting);
  include(bounds.south, bounds.north, at.northing);
}

constexpr MapBounds kNothing{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

}  // namespace

MapBounds image_bounds(const MapBounds& rectangle, const std::function<MapPoint(const MapPoint&)>& image,
                       int steps_per_side) {
  MapBounds bounds = kNothing;
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

bool surrounds(const MapBounds& bounds, const MapBounds& rectangle,
               const std::function<MapPoint(const MapPoint&)>& image) {
  constexpr int kSteps = 16;
  const double margin = 0.01 * std::max(bounds.east - bounds.west, bounds.north - bounds.south);
  for (int i = 0; i < (kSteps - 1) * (kSteps - 1); ++i) {
    const MapPoint at = image(MapPoint{between(rectangle.west, rectangle.east, 1 + i % (kSteps - 1), kSteps),
                                       between(rectangle.south, rectangle.north, 1 + i / (kSteps - 1), kSteps)});
    if (at.easting < bounds.west - margin || at.easting > bounds.east + margin || at.northing < bounds.south - margin ||
        at.northing > bounds.north + margin) {
      return false;
    }
  }
  return true;
}

ShownImage shown_image(const MapBounds& rectangle, const std::function<MapPoint(const MapPoint&)>& image,
                       const std::vector<MapPoint>& more) {
  constexpr int kSteps = 128;
  constexpr int kLine = kSteps + 1;
  constexpr int kHalvings = 50;
  constexpr double kMostJump = 0.25;  // of the image's size
  struct Place {
    MapPoint from;
    MapPoint at;
  };
  std::vector<Place> places;
  MapBounds bounds = kNothing;
  for (int i = 0; i < kLine * kLine; ++i) {
    const MapPoint from{between(rectangle.west, rectangle.east, i % kLine, kSteps),
                        between(rectangle.north, rectangle.south, i / kLine, kSteps)};
    places.push_back({from, image(from)});
    include(bounds, places.back().at);
  }
  for (const MapPoint& from : more) include(bounds, image(from));
  if (!(bounds.west <= bounds.east)) return {{NAN, NAN, NAN, NAN}};
  const double jump = kMostJump * std::max(bounds.east - bounds.west, bounds.north - bounds.south);
  const auto in_one_piece = [&](const Place& a, const Place& b) {
    return is_shown(a.at) && is_shown(b.at) && distance(a.at, b.at) <= jump;
  };
  const auto look_between = [&](Place a, Place b) {
    if (in_one_piece(a, b) || (!is_shown(a.at) && !is_shown(b.at))) return;
    for (int i = 0; i < kHalvings; ++i) {
      Place middle{{(a.from.easting + b.from.easting) / 2.0, (a.from.northing + b.from.northing) / 2.0}, {}};
      middle.at = image(middle.from);
      const bool like_a =
          is_shown(a.at) == is_shown(middle.at) && !(distance(b.at, middle.at) < distance(a.at, middle.at));
      (like_a ? a : b) = middle;
    }
    include(bounds, a.at);
    include(bounds, b.at);
  };
  double area = 0.0;
  int cells = 0;
  for (int row = 0; row < kLine; ++row) {
    for (int column = 0; column < kLine; ++column) {
      const Place* const place = &places[static_cast<std::size_t>(row * kLine + column)];
      if (column < kSteps) look_between(place[0], place[1]);
      if (row < kSteps) look_between(place[0], place[kLine]);
      if (row == kSteps || column == kSteps) continue;
      const std::array<const Place*, 4> corners = {place, place + 1, place + kLine + 1, place + kLine};
      if (!in_one_piece(*corners[0], *corners[1]) || !in_one_piece(*corners[1], *corners[2]) ||
          !in_one_piece(*corners[2], *corners[3]) || !in_one_piece(*corners[3], *corners[0])) {
        continue;
      }
      const MapPoint across{corners[2]->at.easting - corners[0]->at.easting,
                            corners[2]->at.northing - corners[0]->at.northing};
      const MapPoint down{corners[3]->at.easting - corners[1]->at.easting,
                          corners[3]->at.northing - corners[1]->at.northing};
      area += std::abs(across.easting * down.northing - across.northing * down.easting) / 2.0;
      ++cells;
    }
  }
  const double of_cells = (rectangle.east - rectangle.west) * (rectangle.north - rectangle.south) * cells /
                          (static_cast<double>(kSteps) * kSteps);
  if (cells == 0) return {{NAN, NAN, NAN, NAN}};
  return {bounds, area / of_cells};
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

MapBounds globe_bounds(const Projection& projection, const GeoExtent& ground) {
  const auto image = [&](const MapPoint& at) { return projection.forward({at.easting, at.northing}); };
  // Most maps are cut open at the 180th meridian.
  for (const GeoExtent& all : {GeoExtent{-180.0, ground.south, 180.0, ground.north}, ground}) {
    const MapBounds bounds = projected_bounds(projection, all);
    if (std::isfinite(bounds.west) && surrounds(bounds, {all.west, all.south, all.east, all.north}, image))
      return bounds;
  }
  for (const double latitude : {ground.south, ground.north}) {
    if (!is_shown(image({ground.west, latitude}))) return {NAN, NAN, NAN, NAN};
  }
  return shown_image({ground.west, ground.south, ground.east, ground.north}, image, {}).bounds;
}

MapBounds projected_bounds(const Projection& projection, const ReferenceMap& map, const MapBounds& rectangle) {
  const auto image = [&](const MapPoint& at) {
    GeoPoint geo = map.geo_from_map(at);
    // Areas end at the poles, whose rounded coordinates may lie beyond.
    geo.latitude = std::clamp(geo.latitude, -90.0, 90.0);
    return projection.forward(geo);
  };
  return image_bounds(rectangle, image, kStepsPerSide);
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
