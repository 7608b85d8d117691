#include "isohf/projection/other_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

namespace isohf {
namespace {

constexpr MapPoint kNoPlace{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};

/// The bounds of a box as one reading has it; nullopt where none of it lies inside of `covered`.
std::optional<MapBounds> bounds_inside(const MapBounds& asked, const MapBounds& covered, const PairReading& reading,
                                       bool is_swapped) {
  constexpr int kSteps = 4;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  MapBounds bounds{kInfinity, kInfinity, -kInfinity, -kInfinity};
  bool is_inside = false;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      MapPoint at{std::lerp(asked.west, asked.east, i / double{kSteps}),
                  std::lerp(asked.south, asked.north, j / double{kSteps})};
      if (is_swapped) std::swap(at.easting, at.northing);
      const MapPoint place = reading.place(at);
      if (!std::isfinite(place.easting) || !std::isfinite(place.northing)) continue;
      bounds = {std::min(bounds.west, place.easting), std::min(bounds.south, place.northing),
                std::max(bounds.east, place.easting), std::max(bounds.north, place.northing)};
      is_inside = is_inside || (place.easting >= covered.west && place.easting <= covered.east &&
                                place.northing >= covered.south && place.northing <= covered.north);
    }
  }
  return is_inside ? std::optional(bounds) : std::nullopt;
}

}  // namespace

PairReading geographic_reading(std::function<MapPoint(GeoPoint)> place) {
  return {"longitude, latitude", "latitude, longitude", [place = std::move(place)](MapPoint at) {
            return std::abs(at.northing) <= 90.0 && std::abs(at.easting) <= 360.0 ? place({at.easting, at.northing})
                                                                                  : kNoPlace;
          }};
}

PairReading own_reading(const MapBounds& covered, bool in_degrees) {
  if (!in_degrees) return {"easting, northing", "northing, easting", [](MapPoint at) { return at; }};
  return geographic_reading([middle = covered.middle().easting](GeoPoint at) {
    return MapPoint{middle + std::remainder(at.longitude - middle, 360.0), at.latitude};
  });
}

PairReading utm_reading(GeoPoint middle, std::function<MapPoint(GeoPoint)> place) {
  const double longitude = std::remainder(middle.longitude, 360.0);
  const int zone = std::clamp(static_cast<int>(std::floor(longitude / 6.0)) + 31, 1, 60);
  const bool is_south = middle.latitude < 0.0;
  const std::shared_ptr<const ReferenceMap> map =
      utm_map(fmt::format("EPSG:{}", (is_south ? 32700 : 32600) + zone), std::nullopt);
  const std::string name = fmt::format(" in UTM zone {}{}", zone, is_south ? 'S' : 'N');
  return {"easting, northing" + name, "northing, easting" + name, [map, place = std::move(place)](MapPoint at) {
            const GeoPoint there = map->geo_from_map(at);
            return std::isfinite(there.latitude) ? place(there) : kNoPlace;
          }};
}

void add_geographic_readings(std::vector<PairReading>& readings, const std::string& body, GeoPoint middle,
                             const std::function<MapPoint(GeoPoint)>& place) {
  readings.push_back(geographic_reading(place));
  const bool is_known = std::isfinite(middle.longitude) && std::isfinite(middle.latitude);
  if (body == "Earth" && is_known) readings.push_back(utm_reading(middle, place));
}

std::optional<OtherReading> other_reading(const MapBounds& asked, const MapBounds& covered,
                                          std::span<const PairReading> readings) {
  // What lies inside as it is has not been swapped.
  const std::size_t first = !readings.empty() && bounds_inside(asked, covered, readings[0], false) ? 1 : 0;
  for (std::size_t i = first; i < readings.size(); ++i) {
    for (const bool is_swapped : {false, true}) {
      if (i == 0 && !is_swapped) continue;
      if (const auto bounds = bounds_inside(asked, covered, readings[i], is_swapped)) {
        return OtherReading{is_swapped ? readings[i].swapped : readings[i].order, i, is_swapped, *bounds};
      }
    }
  }
  return std::nullopt;
}

}  // namespace isohf
