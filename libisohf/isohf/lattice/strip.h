#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"

/// The triangle strip that draws a tile's body at one level of detail (paper sections 3.3-3.4, Eqs. 3-4, appendix).
///
/// Level λ sees the tile as a coarse copy of level 0 whose steps are s = 2^λ columns and rows. A "flush" row of that
/// copy has its vertices at x = 0, 2s, 4s, ..., W; the "shifted" rows between them at x = 0, s, 3s, ..., W-s, W, the
/// first and last of them on the straight edges. (x and z are object space, W = 2(C-4).)
///
///            z             n = (C-4)/s cells
///   flush    0     F0 <-- F1 <-- F2 ... <-- Fn        Red row, from East to West: S(n+1), Fn, Sn, ... F0, S0,
///                  | \   / \   / \        / |         then S0 twice more;
///   shifted  s     S0--S1 -- S2 -- S3 .. Sn-S(n+1)
///                  | /   \ /   \ /        \ |         blue row, from West to East: G0, S1, G1, S2, ... Gn, S(n+1),
///   flush    2s    G0 --> G1 --> G2 ... --> Gn        then S(n+1) again and twice the next pair's S(n+1).
///
/// The repeated vertices make triangles with two equal indices and no area, and keep each row starting at an even place
/// of the strip, so that every visible triangle winds counter-clockwise seen from above (+y).
///
/// Level 0 takes its shifted rows from the even grid rows, which hold C-2 visible vertices. A coarser level only meets
/// odd grid rows: its shifted vertices are the ones half a stride between, and its edges are the columns 1 and C-3.

namespace isohf {

/// Vertex indices c + r*C of the strip of `level`, in drawing order.
/// level  0 <= level < shape.levels()
/// Returns shape.strip_index_count(level) indices (Eq. 3); shape.strip_triangle_count(level) of the triangles have
/// three different vertices (Eq. 4), they cover the visible square exactly once. O(result); throws only std::bad_alloc.
[[nodiscard]] std::vector<std::uint32_t> strip_indices(const TileShape& shape, int level);

}  // namespace isohf
