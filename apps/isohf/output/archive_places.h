#pragma once

#include <string>
#include <vector>

#include "formats/decorate/cropped_source.h"
#include "isohf/archive.h"
#include "isohf/raster.h"
#include "raster/output_grid.h"

namespace isohf::cli {

/// Has the reference system understood that the archive's source lies on (SourceRecord::map), where that is a map.
/// Throws Error, naming the archive, where it cannot be.
void understand_source(ArchiveReader& archive);

/// The part of the world in a box of the source's coordinates. Longitudes are compared modulo 360 degrees; West above
/// East crosses the 180th meridian.
/// Throws Error{kInvalidArgument} where the archive does not know where its source lay, where West is not less than
/// East in a source that is not in degrees, and where the ground lies at both ends of the archive, so that it is no
/// rectangle there.
[[nodiscard]] WorldBounds world_bounds(const Metadata& metadata, const BoundingBox& box);

/// The grid of another raster of elevations, in the archive's world or, where the archive's input was projected, in
/// degrees. By the origins of both, also where one has no unit that is known and their grounds meet; else from the
/// North-West corner, but never so through a projection: there it is in degrees, or on the archive's own map. A warning
/// says what was taken for granted.
/// Throws Error{kInvalidArgument} where the two are known to be in different units, reference systems or bodies.
[[nodiscard]] OutputGrid grid_like(const Metadata& metadata, const SourceInfo& other,
                                   std::vector<std::string>& warnings);

}  // namespace isohf::cli
