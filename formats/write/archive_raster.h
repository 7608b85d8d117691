#pragma once

#include <optional>

#include "formats/write/raster_spec.h"
#include "isohf/surface.h"

namespace isohf {

/// The raster of an archive's elevations on a grid: size, georeference and units as far as they are known, and what its
/// raw numbers mean.
[[nodiscard]] RasterSpec spec_of(const Metadata& metadata, const SampleGrid& grid, const SampleMapping& mapping,
                                 std::optional<double> nodata);

}  // namespace isohf
