#include "isohf/lattice.h"

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

}  // namespace isohf
