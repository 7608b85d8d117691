#pragma once

#include "isohf/raster.h"

namespace isohf {

/// Reads NAME.EXT.aux.xml, in which GDAL keeps what a raster's format has no room for ("Persistent Auxiliary
/// Metadata"): where the raster lies, its reference system, and a void value, unit, scale and offset for each band.
/// `band` counts from 1; with 0 none of the latter is taken. Takes what `info` does not know yet, and leaves what it
/// knows; statistics and all else are passed over. No such file: nothing happens. Throws Error naming the file:
/// kCorrupt where it is not XML or its numbers are none, kUnsupported where it turns the raster or puts South on top.
void read_auxiliary_metadata(SourceInfo& info, int band);

}  // namespace isohf
