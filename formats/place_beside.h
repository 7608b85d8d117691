#pragma once

#include <cstdint>

#include "formats/world_file.h"
#include "isohf/surface/heightmap.h"

namespace isohf {

/// Spacing and origin of a raster of `rows` rows; the origin is the northernmost row's, whichever the file has first.
void place_by(const WorldFile& world, std::int64_t rows, Georeference& place);

/// For pictures, which have nothing to say of their place: the world file beside, and then the .prj. Throws Error:
/// kUnsupported where the world file has the southernmost row first, and as world_file_beside does.
void read_place_beside(SourceInfo& info);

}  // namespace isohf
