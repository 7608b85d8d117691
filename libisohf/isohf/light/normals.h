#pragma once

#include "isohf/base/view.h"
#include "isohf/lattice.h"

namespace isohf {

/// A unit vector, x eastwards, y up, z southwards.
struct Normal {
  float x;
  float y;
  float z;
  friend bool operator==(const Normal&, const Normal&) = default;
};

/// Vertex normals of a whole tile: the area-weighted sum over the real fan of triangles around each visible vertex
/// (paper Eqs. 10-11, errata E7-E10), in world space.
///
/// Four kinds of fan, with heights named after the compass and the grid's σx (half a column step) and σz (a row):
///
///      NW    NE           NW  N  NE              N                NW   NE
///        \  /               \ | /                |                |   /
///    W -- o -- E        W --- o --- E        W - o - E        W - o ---- E      (mirrored beside the East edge)
///        /  \               / | \                |                |   \    .
///      SW    SE           SW  S  SE              S                SW   SE
///     inside             edge, odd row      edge, even row     even row, next to the edge
///
///   inside           dh/dx = (2(E-W) + (SE-SW) + (NE-NW)) / 12σx       dh/dz = ((SE-NE) + (SW-NW)) / 4σz
///   edge, odd rows   dh/dx as inside                                   dh/dz = ((SE+S+SW) - (NE+N+NW)) / 6σz
///   edge, even rows  dh/dx = (E-W) / 2σx                               dh/dz = (S-N) / 2σz
///   next to an edge  dh/dx = (2(E-W) + (SE-SW) + (NE-NW)) / 10σx       dh/dz = (3(SE-NE) + 2(SW-NW)) / 10σz
///
/// The last kind's W is the slid vertex, half as far away as E. In a tile of one cell both sides are near: 8 in place
/// of 10, and 2 in place of 3. normal = (-dh/dx, 1, -dh/dz), normalised. Exact for planes; tiles that share a vertex
/// compute the same bits, since the kind and the heights around it are the same for all of them.
///
/// elevations [C x R]  world units, padding included; NaN and infinities are void
/// normals    [C x R]  out; (0, 0, 0) at vertices that are not visible, and (0, 1, 0) where the vertex or one of its
///                     neighbours is void. Must not overlap elevations
/// O(C R), no allocation, cannot fail.
void tile_normals(const TileGrid& grid, View2D<const float> elevations, View2D<Normal> normals);

/// The normal at one stored vertex; the same bits as tile_normals gives.
[[nodiscard]] Normal vertex_normal(const TileGrid& grid, View2D<const float> elevations, GridVertex vertex);

}  // namespace isohf
