#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/decorate/cropped_source.h"
#include "formats/mosaic/mosaic_layout.h"
#include "isohf/raster.h"

namespace isohf {

/// Opens every file once, in parallel, and places it by its georeference. Its grid is the finest among the members';
/// coordinates, registration, reference system and units must agree. Members on both sides of the 180th meridian are
/// joined the shorter way.
/// Throws Error naming the file at fault: as open_raster does; kInvalidArgument for a file that is named twice, does
/// not say where it lies, lies off the grid of others of its resolution by more than kSnapTolerance, or disagrees.
/// box: the part that will be read; holes elsewhere do not matter.
[[nodiscard]] MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                                     const std::optional<BoundingBox>& box = std::nullopt);

}  // namespace isohf
