#pragma once

#include <cstdint>

#include "isohf/lattice/tile_shape.h"

/// Grid space <-> object space inside one tile (paper Eq. 1, errata E5, E6, E12).
///
///            c=0   1     2     3    ...       C-3   C-2   C-1
///   r=0       p    s     p     p               p     s     p        p  padding, only read for normals
///   r=1       p    #-----o-----o---- ... -------#     p     u       #  on the straight West or East edge
///                  | \  / \  / \                |                   s  slid: moved by one unit onto the edge
///   r=2       p    s---o-----o----- ...  ---o---s     p             o  ordinary visible vertex
///                  | /  \  / \               \  |                   u  unused
///   r=3       p    #-----o-----o---- ... -------#     p     u
///
/// Object-space x counts half lattice steps from the West edge, 0..2(C-4) on visible vertices; z counts rows of
/// triangles from the North edge, 0..R-3. Both are integers at vertices and fit 16 bits.

namespace isohf {

/// A stored vertex: column and row in the C x R elevation array.
struct GridVertex {
  int column;
  int row;
  friend bool operator==(const GridVertex&, const GridVertex&) = default;
};

/// A position in grid space, fractional; integer at vertices.
struct GridPoint {
  double column;
  double row;
};

/// A vertex in a tile's object space.
struct ObjectVertex {
  int x;
  int z;
  friend bool operator==(const ObjectVertex&, const ObjectVertex&) = default;
};

/// A position in a tile's object space.
struct ObjectPoint {
  double x;
  double z;
};

/// True for the vertices that Eq. 1 slides onto the straight West and East edges (column 1 or C-2 of even rows): they
/// lie half a lattice step off the infinite lattice and are sampled where they lie (errata E6).
[[nodiscard]] bool is_slid(const TileShape& shape, GridVertex vertex);

/// True for vertices on visible triangles.
[[nodiscard]] bool is_visible(const TileShape& shape, GridVertex vertex);

/// Eq. 1 with the padding of errata E5: the object-space place of a stored vertex, 0 <= column < C, 0 <= row < R.
[[nodiscard]] ObjectVertex object_from_grid(const TileShape& shape, GridVertex vertex);

/// Eq. 1's x alone, for loops over a row.
[[nodiscard]] inline int object_x(int tile_columns, int column, int row) {
  const int even = 1 - (row & 1);
  int slide = 0;
  if (even != 0) {
    if (column == 0) slide = 2;  // E5: the neighbour's vertex beside the edge
    if (column == 1) slide = 1;
    if (column == tile_columns - 2) slide = -1;
    if (column == tile_columns - 1) slide = -2;  // E5
  }
  return 2 * column + (row & 1) + slide - 3;
}

/// The exact inverse of Eq. 1 on the tile's visible square, extended piecewise linearly inside each triangle (errata
/// E12): a point in a triangle maps to the point with the same barycentric weights in the grid-space triangle.
/// x in [0, 2(C-4)], z in [0, R-3]; points outside are moved to the nearest point of the square, NaN to any.
[[nodiscard]] GridPoint grid_from_object(const TileShape& shape, ObjectPoint point);

/// The piecewise inverse's own inverse: a fractional grid position to object space, by barycentric weights.
/// The position must lie on visible triangles.
[[nodiscard]] ObjectPoint object_from_grid(const TileShape& shape, GridPoint point);

}  // namespace isohf
