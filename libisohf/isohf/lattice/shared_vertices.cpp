#include "isohf/lattice/shared_vertices.h"

#include <map>
#include <utility>

namespace isohf {

std::vector<SharedVertex> shared_vertices(const TileShape& shape, TileIndex step) {
  // Only the stored vertices near the common edge can coincide; looked up by place, so that no index arithmetic of the
  // mapping is repeated here.
  const std::int64_t shift_x = step.column * 2 * shape.cell_columns();
  const std::int64_t shift_z = step.row * shape.cell_rows();
  std::map<std::pair<std::int64_t, std::int64_t>, GridVertex> there;
  const auto near_edge = [](int index, int count) { return index <= 4 || index >= count - 5; };
  const auto may_coincide = [&](GridVertex vertex) {
    return (step.column == 0 || near_edge(vertex.column, shape.columns())) &&
           (step.row == 0 || near_edge(vertex.row, shape.rows()));
  };
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      if (!may_coincide({c, r})) continue;
      const ObjectVertex object = object_from_grid(shape, GridVertex{c, r});
      there[{object.z + shift_z, object.x + shift_x}] = {c, r};
    }
  }
  std::vector<SharedVertex> shared;
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      if (!may_coincide({c, r})) continue;
      const ObjectVertex object = object_from_grid(shape, GridVertex{c, r});
      const auto at = there.find({object.z, object.x});
      if (at == there.end()) continue;
      shared.push_back({{c, r}, at->second, is_visible(shape, {c, r}) && is_visible(shape, at->second)});
    }
  }
  return shared;
}

}  // namespace isohf
