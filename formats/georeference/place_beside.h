#pragma once

#include <cstdint>

#include "formats/georeference/world_file.h"
#include "isohf/raster.h"

namespace isohf {

/// Spacing and origin of a raster of `rows` rows; the origin is the northernmost row's, whichever the file has first.
void place_by(const WorldFile& world, std::int64_t rows, Georeference& place);

/// Whether the file has said what its coordinates are.
[[nodiscard]] bool has_reference_system(const Georeference& place);

/// For pictures, which have nothing to say of their place: GDAL's .aux.xml beside, or else the world file, and the
/// .prj. `band` as read_auxiliary_metadata has it. Throws Error: kUnsupported where the world file has the southernmost
/// row first, and as world_file_beside and read_auxiliary_metadata do.
void read_place_beside(SourceInfo& info, int band);

}  // namespace isohf
