#pragma once

#include <algorithm>

#include "isohf/lattice.h"

namespace isohf {

/// A position in grid space, fractional; integer at vertices.
struct GridPoint {
  double column;
  double row;
};

/// The exact inverse of Eq. 1 on the tile's visible square, extended piecewise linearly inside each triangle (errata E12):
/// a point in a triangle maps to the point with the same barycentric weights in the grid-space triangle.
inline GridPoint grid_from_object(const TileShape& shape, ObjectPoint point) {
  const int width = 2 * shape.cell_columns();
  // Row of triangles: rows r (above) and r+1 (below), v in [0, 1] from one to the other.
  const int row = std::min(static_cast<int>(point.z), shape.cell_rows() - 1) + 1;
  const double v = point.z - (row - 1);
  // Ordinary rows are straight shears: an odd row has its vertices at x = 2(c-1), an even one at x = 2(c-1)-1.
  const double even_share = row % 2 == 0 ? 1.0 - v : v;
  double column = (point.x + even_share) / 2.0 + 1.0;
  // Half triangles at the straight edges: at a constant z their columns run at twice the ordinary rate.
  if (point.x < even_share) column = 1.0 + point.x;
  if (point.x > width - even_share) column = (shape.columns() - 3) + (point.x - (width - even_share));
  return {column, row + v};
}

}  // namespace isohf
