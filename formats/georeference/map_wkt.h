#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/error.h"
#include "isohf/projection.h"

namespace isohf {

/// The parameters of a map: degrees, and units of the map.
struct MapParameters {
  double latitude = 0.0;  ///< of the origin or the centre
  double longitude = 0.0;
  double parallel_1 = 0.0;
  double parallel_2 = 0.0;
  double scale = 1.0;
  double azimuth = 0.0;
  double grid_angle = 0.0;
  double easting = 0.0;
  double northing = 0.0;
  double height = 0.0;  ///< of a viewpoint, metres
};

/// What the code of a method in GeoTIFF's keys (1.0, section 6.3.3.3) is called in WKT 1; empty for an unknown one.
[[nodiscard]] std::string_view method_of_code(int code);

/// A projected system in WKT 1 as GDAL writes it; of the parameters those that the method has. `method` is one of
/// method_of_code() or "Mercator_2SP"; `geographic` the WKT of the system beneath.
[[nodiscard]] std::string map_wkt(const std::string& name, const std::string& geographic, std::string_view method,
                                  const MapParameters& parameters, double metres_per_unit);

/// What PROJ and GDAL call the meridian that longitudes are counted from on a body of this size.
[[nodiscard]] const char* meridian_of(double semi_major_axis_m);

/// A geographic system on an ellipsoid (inverse flattening 0: a sphere). `meridian` empty: meridian_of().
[[nodiscard]] std::string geographic_wkt(const std::string& name, const std::string& datum,
                                         const std::string& ellipsoid, double semi_major_axis_m,
                                         double inverse_flattening, const std::string& meridian = {},
                                         double degrees_per_unit = 1.0);

/// A map of a planet or moon, as its agencies' labels describe it.
struct PlanetaryMap {
  std::string
      projection;  ///< "SimpleCylindrical", "POLAR STEREOGRAPHIC", ...: in any case, with and without blanks; empty: degrees
  std::string target;  ///< "Mars"
  double equatorial_radius_m = 0.0;
  double polar_radius_m = 0.0;
  bool planetographic = false;  ///< latitudes are those of normals on the ellipsoid; else of a sphere
  MapParameters parameters;
  GeoPoint pole = {};          ///< of an oblique cylinder
  double pole_rotation = 0.0;  ///< degrees
  double distance_m = 0.0;     ///< of a perspective's viewpoint, from the body's centre
};

/// Its WKT, as GDAL understands the labels: maps of planetocentric latitudes lie on a sphere of the equatorial radius,
/// polar ones on that of the polar radius. Empty, with a warning, for a map that is not known.
[[nodiscard]] std::string planetary_wkt(const PlanetaryMap& map, std::vector<Warning>& warnings);

}  // namespace isohf
