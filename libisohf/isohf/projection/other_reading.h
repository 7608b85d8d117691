#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/projection.h"
#include "isohf/projection/reference_map.h"

namespace isohf {

/// A way to read two numbers as a place.
struct PairReading {
  std::string order;    ///< "longitude, latitude"
  std::string swapped;  ///< "latitude, longitude"
  /// Where that is, in the coordinates that all readings share; NaN where there is no such place.
  std::function<MapPoint(MapPoint)> place;
};

/// Coordinates as they are: of degrees the longitudes that are next to those of `covered`.
[[nodiscard]] PairReading own_reading(const MapBounds& covered, bool in_degrees);
/// Longitude and latitude, of which `place` makes coordinates; latitudes beyond a pole name no place.
[[nodiscard]] PairReading geographic_reading(std::function<MapPoint(GeoPoint)> place);
/// Easting and northing in the UTM zone of WGS 84 around `middle`.
[[nodiscard]] PairReading utm_reading(GeoPoint middle, std::function<MapPoint(GeoPoint)> place);

/// Adds the last two, UTM on the Earth alone. `middle` is that of the ground that is covered; NaN: not known.
void add_geographic_readings(std::vector<PairReading>& readings, const std::string& body, GeoPoint middle,
                             const std::function<MapPoint(GeoPoint)>& place);

/// What numbers may have been meant as.
struct OtherReading {
  std::string words;      ///< "latitude, longitude"
  std::size_t index = 0;  ///< of the reading
  bool is_swapped = false;
  MapBounds bounds;  ///< in the shared coordinates
};

/// What numbers (a box, or a place: a box without a size) may have been meant as that name nothing of use in `covered` as
/// readings[0] has them: the first reading, as it is or swapped, by which they lie inside. If they lie inside as
/// readings[0] has them, too small to be of use, only the other readings count.
[[nodiscard]] std::optional<OtherReading> other_reading(const MapBounds& asked, const MapBounds& covered,
                                                        std::span<const PairReading> readings);

}  // namespace isohf
