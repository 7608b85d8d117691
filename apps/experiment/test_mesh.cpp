#include "test_mesh.h"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "isohf/lattice.h"
#include "isohf/lattice/strip.h"

namespace isohf::experiment {
namespace {

struct IntegerPlace {
  int x;
  int z;
};

/// Builds a mesh from integer places 0 <= x <= width, 0 <= z <= depth, one unit of which is (scale.x, scale.z).
class MeshBuilder {
 public:
  MeshBuilder(int width, int depth, Place scale) : width_(width), depth_(depth), scale_(scale) {}

  std::uint32_t add_vertex(IntegerPlace at) {
    places_.push_back(at);
    // Doubled integers, so that opposite vertices are exact negatives of each other.
    mesh_.vertices.push_back({0.5 * (2 * at.x - width_) * scale_.x, 0.5 * (2 * at.z - depth_) * scale_.z});
    return static_cast<std::uint32_t>(places_.size() - 1);
  }

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::array<int, 4> offsets = {places_[b].x - places_[a].x, places_[b].z - places_[a].z,
                                        places_[c].x - places_[a].x, places_[c].z - places_[a].z};
    if (offsets[0] * offsets[3] < offsets[1] * offsets[2]) return add_triangle(a, c, b);
    const auto [found, is_new] = shapes_.try_emplace(offsets, static_cast<std::uint32_t>(mesh_.shapes.size()));
    if (is_new) {
      mesh_.shapes.push_back(
          {{offsets[0] * scale_.x, offsets[1] * scale_.z}, {offsets[2] * scale_.x, offsets[3] * scale_.z}});
    }
    bool is_measured = true;
    for (const std::uint32_t v : {a, b, c}) {
      is_measured = is_measured && std::abs(mesh_.vertices[v].x) <= 0.5 * width_ * scale_.x - kUnmeasuredMargin &&
                    std::abs(mesh_.vertices[v].z) <= 0.5 * depth_ * scale_.z - kUnmeasuredMargin;
    }
    mesh_.triangles.push_back({{a, b, c}, found->second, is_measured});
  }

  TestMesh take() { return std::move(mesh_); }

 private:
  int width_;
  int depth_;
  Place scale_;
  std::vector<IntegerPlace> places_;
  std::map<std::array<int, 4>, std::uint32_t> shapes_;
  TestMesh mesh_;
};

}  // namespace

TestMesh make_iso_mesh(std::int64_t triangles) {
  const double side = std::sqrt(0.5 * static_cast<double>(triangles));
  // Base 2σx, height σz = √3 σx, area ½: two triangles a vertex.
  const double sigma_x = std::sqrt(0.5 / std::numbers::sqrt3);
  const double sigma_z = std::numbers::sqrt3 * sigma_x;
  const int columns = static_cast<int>(std::lround(side / (2.0 * sigma_x)));
  const int rows = 2 * static_cast<int>(std::lround(side / (2.0 * sigma_z)));
  const TileShape shape = TileShape::make(columns + 4, rows + 3, 1);

  MeshBuilder builder(2 * columns, rows, {sigma_x, sigma_z});
  std::map<std::uint32_t, std::uint32_t> vertex_of;  // index in the tile's array -> ours
  const std::vector<std::uint32_t> strip = strip_indices(shape, 0);
  const auto stored = static_cast<std::uint32_t>(shape.columns());
  const auto ours = [&](std::uint32_t index) {
    const auto found = vertex_of.find(index);
    if (found != vertex_of.end()) return found->second;
    const ObjectVertex at =
        object_from_grid(shape, GridVertex{static_cast<int>(index % stored), static_cast<int>(index / stored)});
    return vertex_of[index] = builder.add_vertex({at.x, at.z});
  };
  for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
    if (strip[i] == strip[i + 1] || strip[i + 1] == strip[i + 2] || strip[i] == strip[i + 2]) continue;
    builder.add_triangle(ours(strip[i]), ours(strip[i + 1]), ours(strip[i + 2]));
  }
  return builder.take();
}

TestMesh make_ortho_mesh(std::int64_t triangles, Diagonals diagonals) {
  const int cells = static_cast<int>(std::lround(std::sqrt(0.5 * static_cast<double>(triangles))));
  MeshBuilder builder(cells, cells, {1.0, 1.0});
  for (int z = 0; z <= cells; ++z) {
    for (int x = 0; x <= cells; ++x) builder.add_vertex({x, z});
  }
  const auto vertex = [&](int x, int z) { return static_cast<std::uint32_t>(z * (cells + 1) + x); };
  for (int z = 0; z < cells; ++z) {
    for (int x = 0; x < cells; ++x) {
      const bool is_odd = (x + z) % 2 != 0;
      if (diagonals != Diagonals::kAlternating || !is_odd) {
        builder.add_triangle(vertex(x, z), vertex(x + 1, z), vertex(x + 1, z + 1));
        builder.add_triangle(vertex(x, z), vertex(x + 1, z + 1), vertex(x, z + 1));
      }
      if (diagonals == Diagonals::kBoth || (diagonals == Diagonals::kAlternating && is_odd)) {
        builder.add_triangle(vertex(x, z), vertex(x + 1, z), vertex(x, z + 1));
        builder.add_triangle(vertex(x + 1, z), vertex(x + 1, z + 1), vertex(x, z + 1));
      }
    }
  }
  return builder.take();
}

}  // namespace isohf::experiment
