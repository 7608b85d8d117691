#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "isohf/lattice.h"

/// Exact checks on index meshes of one tile, in integers.

namespace isohf::test {

using Edge = std::pair<std::uint32_t, std::uint32_t>;
using Triangle = std::array<std::uint32_t, 3>;

inline GridVertex vertex_of(const TileShape& shape, std::uint32_t index) {
  const auto columns = static_cast<std::uint32_t>(shape.columns());
  return {static_cast<int>(index % columns), static_cast<int>(index / columns)};
}

inline ObjectVertex place_of(const TileShape& shape, std::uint32_t index) {
  return object_from_grid(shape, vertex_of(shape, index));
}

/// The triangles of a strip in the order and winding that the graphics interfaces define, degenerate ones included.
inline std::vector<Triangle> triangles_of_strip(std::span<const std::uint32_t> strip) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
    if (i % 2 == 0) triangles.push_back({strip[i], strip[i + 1], strip[i + 2]});
    if (i % 2 == 1) triangles.push_back({strip[i + 1], strip[i], strip[i + 2]});
  }
  return triangles;
}

inline std::vector<Triangle> triangles_of_list(std::span<const std::uint32_t> list) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i + 2 < list.size(); i += 3) triangles.push_back({list[i], list[i + 1], list[i + 2]});
  return triangles;
}

inline bool repeats_a_vertex(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// Twice the area in object space, positive where the triangle winds counter-clockwise seen from above. x points
/// right and z down on the page, hence the order of the factors.
inline std::int64_t doubled_area(const TileShape& shape, const Triangle& t) {
  const ObjectVertex a = place_of(shape, t[0]);
  const ObjectVertex b = place_of(shape, t[1]);
  const ObjectVertex c = place_of(shape, t[2]);
  return std::int64_t{b.z - a.z} * (c.x - a.x) - std::int64_t{b.x - a.x} * (c.z - a.z);
}

/// A chain of directed edges: adding an edge and its reverse leaves nothing.
class EdgeChain {
 public:
  void add(const Triangle& t) {
    for (std::size_t i = 0; i < 3; ++i) add(t[i], t[(i + 1) % 3]);
  }
  void add(std::uint32_t from, std::uint32_t to) {
    if (from < to) edges_.push_back({{from, to}, 1});
    if (from > to) edges_.push_back({{to, from}, -1});
  }
  /// What is left once opposite edges are cancelled, sorted; an edge that is left twice appears twice.
  [[nodiscard]] std::vector<Edge> remaining() {
    std::sort(edges_.begin(), edges_.end());
    std::vector<Edge> left;
    for (std::size_t i = 0; i < edges_.size();) {
      const Edge edge = edges_[i].first;
      int sum = 0;
      for (; i < edges_.size() && edges_[i].first == edge; ++i) sum += edges_[i].second;
      for (; sum > 0; --sum) left.push_back(edge);
      for (; sum < 0; ++sum) left.emplace_back(edge.second, edge.first);
    }
    std::sort(left.begin(), left.end());
    return left;
  }

 private:
  std::vector<std::pair<Edge, int>> edges_;
};

/// The full-detail border of a tile as directed edges, counter-clockwise seen from above, sorted.
inline std::vector<Edge> full_detail_border(const TileShape& shape) {
  const int south = shape.rows() - 2;
  const auto index = [&](int c, int r) { return static_cast<std::uint32_t>(c + r * shape.columns()); };
  std::vector<std::uint32_t> loop;
  for (int r = 1; r <= south; ++r) loop.push_back(index(1, r));
  for (int c = 2; c <= shape.columns() - 3; ++c) loop.push_back(index(c, south));
  for (int r = south - 1; r >= 1; --r) loop.push_back(index(shape.columns() - (r % 2 == 0 ? 2 : 3), r));
  for (int c = shape.columns() - 4; c >= 2; --c) loop.push_back(index(c, 1));
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < loop.size(); ++i) edges.emplace_back(loop[i], loop[(i + 1) % loop.size()]);
  std::sort(edges.begin(), edges.end());
  return edges;
}

/// The square's border at `level`, whose vertices lie `stride` steps apart, likewise.
inline std::vector<Edge> coarse_border(const TileShape& shape, int level) {
  if (level == 0) return full_detail_border(shape);
  const int stride = 1 << level;
  const int south = shape.rows() - 2;
  const int east = shape.columns() - 3;
  const auto index = [&](int c, int r) { return static_cast<std::uint32_t>(c + r * shape.columns()); };
  std::vector<std::uint32_t> loop;
  for (int r = 1; r < south; r += stride) loop.push_back(index(1, r));
  for (int c = 1; c < east; c += stride) loop.push_back(index(c, south));
  for (int r = south; r > 1; r -= stride) loop.push_back(index(east, r));
  for (int c = east; c > 1; c -= stride) loop.push_back(index(c, 1));
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < loop.size(); ++i) edges.emplace_back(loop[i], loop[(i + 1) % loop.size()]);
  std::sort(edges.begin(), edges.end());
  return edges;
}

/// Every valid shape with at most these columns and rows, once for each count of levels.
inline std::vector<TileShape> all_shapes(int most_columns, int most_rows) {
  std::vector<TileShape> shapes;
  for (int columns = 5; columns <= most_columns; ++columns) {
    for (int rows = 5; rows <= most_rows; ++rows) {
      for (int levels = 1; TileShape::why_invalid(columns, rows, levels).empty(); ++levels) {
        shapes.push_back(TileShape::make(columns, rows, levels));
      }
    }
  }
  return shapes;
}

/// Of those, for each size the one with the most levels: strips and stitch lists don't depend on the levels beyond.
inline std::vector<TileShape> deepest_shapes(int most_columns, int most_rows) {
  std::vector<TileShape> deepest;
  for (const TileShape& shape : all_shapes(most_columns, most_rows)) {
    if (TileShape::why_invalid(shape.columns(), shape.rows(), shape.levels() + 1).empty()) continue;
    deepest.push_back(shape);
  }
  return deepest;
}

}  // namespace isohf::test
