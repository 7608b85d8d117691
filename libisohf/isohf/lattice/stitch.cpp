#include "isohf/lattice/stitch.h"

#include "isohf/base/assert.h"
#include "isohf/lattice/planes.h"

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

std::vector<std::uint32_t> side_stitch_indices(const TileShape& shape, TileSide side, int stride) {
  ISOHF_ASSERT(allows_planes(shape, stride));
  const int south = shape.rows() - 2;
  const bool along_z = side == TileSide::kWest || side == TileSide::kEast;
  const int end = along_z ? south : shape.columns() - 3;
  const auto vertex = [&](int along) -> GridVertex {
    switch (side) {
      case TileSide::kWest:
        return {1, along};
      case TileSide::kEast:
        return {east_column(shape, along), along};
      case TileSide::kNorth:
        return {along, 1};
      case TileSide::kSouth:
        break;
    }
    return {along, south};
  };
  // The border runs down the West edge and on counter-clockwise seen from above.
  const bool forwards = side == TileSide::kWest || side == TileSide::kSouth;
  std::vector<std::uint32_t> list;
  for (int step = 2; step <= stride; step *= 2) {
    for (int along = 1; along < end; along += step) {
      const int kept[] = {along, along + step};
      for (const int at : {kept[forwards ? 0 : 1], kept[forwards ? 1 : 0], along + step / 2}) {
        const GridVertex at_vertex = vertex(at);
        list.push_back(static_cast<std::uint32_t>(at_vertex.column + at_vertex.row * shape.columns()));
      }
    }
  }
  return list;
}

}  // namespace isohf
