#pragma once

#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// Reads what isohf uses of a reference system written as WKT (OGC 01-009, ESRI's dialect of it, ISO 19162): name, EPSG
/// code, horizontal unit, ellipsoid, body, and the text itself, into `place`. False, and nothing changed, where the
/// text is not the WKT of a projected or geographic system.
[[nodiscard]] bool read_wkt(std::string_view text, Georeference& place);

/// The same of a .prj, which may be older than WKT ("Projection GEOGRAPHIC").
[[nodiscard]] bool read_prj(std::string_view text, Georeference& place);

}  // namespace isohf
