#include "isohf/lattice/stitch.h"

#include "isohf/lattice.h"

namespace isohf {
namespace {

/// The visible vertex of a row that lies on the East edge: C-2, slid there, on even rows; C-3 on odd ones.
int east_column(const TileShape& shape, int row) {
  return shape.columns() - (row % 2 == 0 ? 2 : 3);
}

}  // namespace

std::vector<std::uint32_t> stitch_indices(const TileShape& shape) {
  std::vector<std::uint32_t> list;
  list.reserve(static_cast<std::size_t>(shape.stitch_index_count(shape.levels() - 1)));
  const auto add = [&](GridVertex a, GridVertex b, GridVertex c) {
    for (const GridVertex vertex : {a, b, c}) {
      list.push_back(static_cast<std::uint32_t>(vertex.column + vertex.row * shape.columns()));
    }
  };
  const int south = shape.rows() - 2;
  for (int level = 1; level < shape.levels(); ++level) {
    const int stride = 1 << level;
    const int half = stride / 2;
    for (int row = 1; row < south; row += stride) {
      const GridVertex east{east_column(shape, row), row};
      const GridVertex east_removed{east_column(shape, row + half), row + half};
      const GridVertex east_next{east_column(shape, row + stride), row + stride};
      add({1, row}, {1, row + half}, {1, row + stride});
      add(east, east_next, east_removed);
    }
    for (int column = 1; column < shape.columns() - 3; column += stride) {
      add({column, 1}, {column + stride, 1}, {column + half, 1});
      add({column, south}, {column + half, south}, {column + stride, south});
    }
  }
  return list;
}

}  // namespace isohf
