#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "isohf/projection.h"

namespace isohf {

/// "EPSG:32601" to "EPSG:32760": the UTM zones of WGS 84, the commonest maps of elevations, by GeographicLib. nullptr
/// for any other text.
[[nodiscard]] std::shared_ptr<const ReferenceMap> utm_map(const std::string& text,
                                                          std::optional<double> metres_per_unit);

/// The rectangle of a map that a raster covers, in the map's units.
struct MapBounds {
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;

  [[nodiscard]] MapPoint middle() const { return {(west + east) / 2.0, (south + north) / 2.0}; }
};

/// Scales at a place of a map: length on the map for length on the ground.
struct PlaceScale {
  double least = 1.0;  ///< over all directions
  double most = 1.0;
  double meridional = 1.0;
  double parallel = 1.0;
  double areal = 1.0;
  double angular_deg = 0.0;           ///< the largest change of an angle between two directions, twice over
  double ground_m_per_easting = 1.0;  ///< metres on the ground along one unit of easting, and of northing
  double ground_m_per_northing = 1.0;

  /// Of a length, the larger of the two's deviations from 1.
  [[nodiscard]] double error() const;
  /// Of lengths, over all directions.
  [[nodiscard]] double mean() const;
};
/// NaN in every member where the map shows no place, or ends.
[[nodiscard]] PlaceScale scale_at(const ReferenceMap& map, MapPoint place);

/// Eastings once round the body on a map whose meridians are evenly spaced columns and whose parallels are rows, Mercator's
/// and equidistant cylindrical ones; nullopt on any other. `near` is a place that the map shows.
[[nodiscard]] std::optional<double> turn_of(const ReferenceMap& map, MapPoint near);

/// Looks at 33 x 33 places, the sides included, and rounds to 1e-8 degrees and scales to 1e-7. Places that the map does
/// not show are passed over; nullopt where it shows none of them.
[[nodiscard]] std::optional<MapGround> ground_under(const ReferenceMap& map, const MapBounds& bounds);

}  // namespace isohf
