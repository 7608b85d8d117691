#include <fmt/format.h>

#include <vector>

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/error.h"
#include "isohf/light/normals.h"
#include "isohf/mesh.h"

namespace isohf {

std::vector<MeshVertex> tile_vertices(const Metadata& metadata, TileIndex tile, std::span<const double> elevations,
                                      const VertexOptions& options, int plane) {
  const TileGrid grid = metadata.plane_grid(plane);
  const TileShape& shape = grid.shape();
  const auto count = static_cast<std::size_t>(shape.stored_vertex_count());
  if (!grid.contains(tile)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("there is no tile ({},{}) among {} x {}", tile.column,
                                                         tile.row, grid.tile_columns(), grid.tile_rows()));
  }
  if (elevations.size() != count) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{} elevations for tiles of {} vertices", elevations.size(), count));
  }
  std::vector<float> heights(count);
  for (std::size_t i = 0; i < count; ++i) heights[i] = static_cast<float>(elevations[i] * options.elevation_scale);
  std::vector<Normal> normals(count);
  tile_normals(grid, View2D<const float>(heights.data(), shape.columns(), shape.rows()),
               View2D<Normal>(normals.data(), shape.columns(), shape.rows()));
  const Planes planes = planes_of(metadata);
  std::vector<MeshVertex> vertices;
  vertices.reserve(count);
  for (int row = 0; row < shape.rows(); ++row) {
    for (int column = 0; column < shape.columns(); ++column) {
      const std::size_t i = vertices.size();
      const LatticeVertex own = grid.lattice_vertex(tile, {column, row});
      const LatticeVertex lattice = plane == 0 ? own : planes.place(plane, own);
      const WorldPoint world = metadata.grid.world_from_lattice(lattice);
      vertices.push_back(
          {{static_cast<float>(world.x - options.origin.x), heights[i], static_cast<float>(world.z - options.origin.z)},
           {normals[i].x, normals[i].y, normals[i].z}});
    }
  }
  return vertices;
}

}  // namespace isohf
