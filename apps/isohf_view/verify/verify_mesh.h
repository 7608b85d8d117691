#pragma once

#include "gl/tile_buffers.h"
#include "verify/verify_report.h"

namespace isohf::view {

/// Reads the index arrays back from the GPU and checks each level's mesh, strip and stitch together: every side that is
/// not on the tile's border must belong to two triangles that run along it in opposite directions, and what is left
/// over must be the full-detail border, counter-clockwise, each side once. With that no crack can open between tiles
/// whose border vertices agree, and no triangle faces down. Findings name tile (0, 0): all tiles share the arrays.
void verify_mesh(const SharedGeometry& shared, VerifyReport& report);

}  // namespace isohf::view
