#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"
#include "isohf/mesh.h"

/// The triangle list that joins a coarse strip to the full-detail border (paper section 3.5, Eqs. 5-6, appendix), so
/// that tiles of any two levels meet without T-junctions.
///
/// Going from level k-1 to level k removes every second vertex of the border. For each one removed, a triangle joins it
/// to the two that stay. Seen from above it has no area; standing upright it fills the crack.
///
///      level k-1    a ----- m ----- b        a, b kept, m removed
///      level k      a ------------- b        stitch triangle a m b, or a b m on the East and North edges
///
/// The strip's border runs counter-clockwise seen from above (down the West edge, along the South edge to the East, up,
/// and back). Each stitch triangle holds the strip's edge in the other direction and leaves the two finer edges in the
/// strip's own, so strip and stitch together have exactly the full-detail border.

namespace isohf {

/// Vertex indices c + r*C of the stitch triangles of all levels, three a triangle. The list of a level is the front of
/// the list of the next: level λ draws the first shape.stitch_index_count(λ) indices (none at level 0).
/// Returns shape.stitch_index_count(shape.levels() - 1) indices. O(result); throws only std::bad_alloc.
[[nodiscard]] std::vector<std::uint32_t> stitch_indices(const TileShape& shape);

/// The triangles that a tile draws on one side beside a tile of the next coarser plane, with whatever level's strip and
/// its whole stitch list: the stitch triangles of strides 2 to `stride` of that side, wound the other way, so that they
/// leave the coarser tile's border. Indices c + r*C, finest first.
/// stride  allows_planes(shape, stride)
[[nodiscard]] std::vector<std::uint32_t> side_stitch_indices(const TileShape& shape, TileSide side, int stride);

}  // namespace isohf
