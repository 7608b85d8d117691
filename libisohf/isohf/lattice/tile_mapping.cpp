#include "isohf/lattice.h"

#include <algorithm>
#include <cmath>

namespace isohf {

bool is_slid(const TileShape& shape, GridVertex vertex) {
  return vertex.row % 2 == 0 && (vertex.column == 1 || vertex.column == shape.columns() - 2);
}

bool is_visible(const TileShape& shape, GridVertex vertex) {
  if (vertex.row < 1 || vertex.row > shape.rows() - 2 || vertex.column < 1) return false;
  return vertex.column <= shape.columns() - (vertex.row % 2 == 0 ? 2 : 3);
}

ObjectVertex object_from_grid(const TileShape& shape, GridVertex vertex) {
  return {object_x(shape.columns(), vertex.column, vertex.row), vertex.row - 1};
}

GridPoint grid_from_object(const TileShape& shape, ObjectPoint point) {
  const int width = 2 * shape.cell_columns();
  const double x = std::fmax(0.0, std::fmin(point.x, width));
  const double z = std::fmax(0.0, std::fmin(point.z, shape.cell_rows()));
  // Row of triangles: rows r (above) and r+1 (below), v in [0, 1] from one to the other.
  const int row = std::min(static_cast<int>(z), shape.cell_rows() - 1) + 1;
  const double v = z - (row - 1);

  // Ordinary rows are straight shears: an odd row has its vertices at x = 2(c-1), an even one at x = 2(c-1)-1. Between
  // the two, x = 2(c-1) - (share of the even row), so c = (x + share)/2 + 1.
  const double even_share = row % 2 == 0 ? 1.0 - v : v;
  double column = (x + even_share) / 2.0 + 1.0;

  // Half triangles at the straight edges, each with two vertices on the even row (one slid) and one on the odd row.
  // West: x in [0, even_share], vertices (0, even) and (1, even) map to columns 1 and 2, and (0, odd) to column 1: at
  // a constant z the half triangle's columns run from 1 to 1+even_share at twice the ordinary rate.
  if (x < even_share) column = 1.0 + x;
  // East: x in [width - even_share, width]; (width-1, even) and (width, even) are columns C-3 and C-2, (width, odd) is
  // column C-3.
  if (x > width - even_share) column = (shape.columns() - 3) + (x - (width - even_share));
  return {column, row + v};
}

ObjectPoint object_from_grid(const TileShape& shape, GridPoint point) {
  const int width = 2 * shape.cell_columns();
  const int row = std::clamp(static_cast<int>(point.row), 1, shape.rows() - 3);
  const double v = point.row - row;
  const double even_share = row % 2 == 0 ? 1.0 - v : v;
  double x = 2.0 * (point.column - 1.0) - even_share;
  if (point.column < 1.0 + even_share) x = point.column - 1.0;
  if (point.column > shape.columns() - 3) x = (point.column - (shape.columns() - 3)) + (width - even_share);
  return {x, point.row - 1.0};
}

}  // namespace isohf
