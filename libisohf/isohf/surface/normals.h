#pragma once

#include <array>
#include <span>

#include "isohf/base/view.h"
#include "isohf/lattice/tile_grid.h"

namespace isohf {

/// Vertex normals of a whole tile: the area-weighted sum over the real fan of triangles around each visible vertex
/// (paper Eqs. 10-11, errata E7-E10), in world space.
///
/// Three cases, with heights named after the compass and the tile's own spacings σx (half a column step), σz (a row):
///   inside            6 neighbours:  dh/dx = (2(E-W) + (SE-SW) + (NE-NW)) / 12σx    dh/dz = ((SE+SW)-(NE+NW)) / 4σz
///   edge, odd rows    8 neighbours:  dh/dx as inside                   dh/dz = ((SE+S+SW)-(NE+N+NW)) / 6σz
///   edge, even rows   4 neighbours:  dh/dx = (E-W) / 2σx                            dh/dz = (S-N) / 2σz
/// normal = (-dh/dx, 1, -dh/dz), normalised. Exact for planes; two tiles that share a vertex compute the same bits.
///
/// elevations [C x R]  world units, padding included; NaN is void
/// normals    [C x R]  out, unit vectors (x, y up, z); (0, 0, 0) at vertices that are not visible, and (0, 1, 0) where
///                     the vertex or one of its neighbours is void
struct Normal {
  float x;
  float y;
  float z;
  friend bool operator==(const Normal&, const Normal&) = default;
};

void tile_normals(const TileGrid& grid, View2D<const float> elevations, View2D<Normal> normals);

/// The normal at one visible vertex; the same bits as tile_normals gives.
[[nodiscard]] Normal vertex_normal(const TileGrid& grid, View2D<const float> elevations, GridVertex vertex);

}  // namespace isohf
