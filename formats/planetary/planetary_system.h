#pragma once

#include <optional>
#include <string>

#include "isohf/projection.h"
#include "isohf/raster.h"

namespace isohf {

/// A map of a planet or moon, as its agencies' labels describe it. Degrees, East positive.
struct PlanetaryMap {
  std::string name;        ///< of the system
  std::string projection;  ///< "SimpleCylindrical", "POLAR STEREOGRAPHIC", ...: any case, blanks or not; empty: degrees
  std::string target;      ///< "Mars"
  std::optional<double> equatorial_radius_m;
  std::optional<double> polar_radius_m;
  bool planetographic = false;  ///< latitudes are those of normals on the ellipsoid; else of a sphere
  double latitude = 0.0;        ///< of the centre, which is that of true scale on cylinders
  double longitude = 0.0;
  double parallel_1 = 0.0;
  double parallel_2 = 0.0;
  double scale = 1.0;
  GeoPoint pole = {0.0, 90.0};  ///< of an oblique cylinder
  double pole_rotation = 0.0;
  double distance_m = 0.0;  ///< of a perspective's viewpoint, from the body's centre
};

/// Gives `info` the reference system, unit and body of a map, as GDAL understands the labels: maps of planetocentric
/// latitudes lie on a sphere of the equatorial radius, polar ones on that of the polar radius. The system is left out,
/// with a warning, for a map that is not known, or that PROJ does not take.
void take_planetary_map(const PlanetaryMap& map, SourceInfo& info);

}  // namespace isohf
