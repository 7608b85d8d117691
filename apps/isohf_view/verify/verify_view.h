#pragma once

#include "gl/index_arrays.h"
#include "paging/tile_source.h"
#include "verify/verify_report.h"

namespace isohf::view {

/// Draws every tile at every level, whole and fractional, through the buffers, shaders and index arrays that pictures
/// are drawn with, and compares what comes back with the library's own arithmetic. A GL context must be current.
///
/// arrays  what SharedGeometry uploads; make_index_arrays(shape) unless a fault is wanted
/// The oracles never look at the arrays: level λ is the barycentric surface of a coarse tile. A tile that cannot be
/// read is a finding; Errors of GL are thrown.
[[nodiscard]] VerifyReport verify_view(const TileSource& source, const IndexArrays& arrays,
                                       const VerifyOptions& options = {});

}  // namespace isohf::view
