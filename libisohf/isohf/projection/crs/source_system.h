#pragma once

#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Takes the reference system that `text` names, as Crs::parse understands it, into info.georeference: unit, name, code
/// or text, ellipsoid, body; and of heights what it says. Coordinates stay as they are. Throws what Crs::parse throws,
/// and Error{kUnsupported} for longitudes and latitudes that are no degrees from Greenwich, and for depths.
void take_system(const std::string& text, SourceInfo& info);

/// Unit and name of the heights of a vertical system by its code; a warning where PROJ does not know it.
void take_heights(int vertical_epsg, SourceInfo& info);

/// Whether a code of EPSG's is that of a system of longitudes, latitudes and heights (EPSG:4979).
[[nodiscard]] bool gives_heights_above_ellipsoid(int epsg);

/// For messages: "degrees", "metres", "units of 0.3048 m".
[[nodiscard]] std::string unit_name(const Georeference& place);
/// For messages: "EPSG:2154", the system's name in quotes, else unit_name().
[[nodiscard]] std::string name_of(const Georeference& place);

/// WGS 84 in degrees, on the Earth.
[[nodiscard]] ReferenceSystem wgs84_system();

}  // namespace isohf
