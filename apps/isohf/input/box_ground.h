#pragma once

#include "formats/adapters/cropped_source.h"
#include "isohf/archive.h"
#include "isohf/restore/sample_grids.h"

namespace isohf::cli {

/// The part of an archive's world in --bbox, as world_bounds() has it. Throws Error{kInvalidArgument} naming the
/// option, also if it lies outside of what the archive covers. Has a source that was projected from another map
/// understood.
[[nodiscard]] WorldBounds ground_in_box(ArchiveReader& archive, const BoundingBox& box, AcrossEnds across);

}  // namespace isohf::cli
