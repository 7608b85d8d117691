#pragma once

#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// Reads what isohf uses of a reference system written as WKT (OGC 01-009, ESRI's dialect of it, ISO 19162): name, EPSG
/// code, horizontal unit, ellipsoid, body, and the text itself, into `place`. False, and nothing changed, where the
/// text is not the WKT of a projected or geographic system.
[[nodiscard]] bool read_wkt(std::string_view text, Georeference& place);

/// Reads the .prj beside info.path, where there is one, with read_wkt; a text that is no WKT becomes a
/// warning, and so do coordinates that look like degrees without one.
void read_prj_beside(SourceInfo& info);

}  // namespace isohf
