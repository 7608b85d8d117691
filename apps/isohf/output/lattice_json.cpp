#include "output/lattice_json.h"

#include <nlohmann/json.hpp>
#include <numbers>

namespace isohf::cli {

using nlohmann::ordered_json;

ordered_json json_from(const TileShape& shape) {
  ordered_json levels = ordered_json::array();
  for (int level = 0; level < shape.levels(); ++level) {
    levels.push_back({{"strip_indices", shape.strip_index_count(level)},
                      {"strip_triangles", shape.strip_triangle_count(level)},
                      {"stitch_indices", shape.stitch_index_count(level)},
                      {"stitch_triangles", shape.stitch_triangle_count(level)}});
  }
  return {{"columns", shape.columns()},
          {"rows", shape.rows()},
          {"levels", shape.levels()},
          {"aspect", shape.aspect()},
          {"printed_aspect", shape.printed_aspect()},
          {"triangles", shape.triangle_count()},
          {"stored_vertices", shape.stored_vertex_count()},
          {"visible_vertices", shape.visible_vertex_count()},
          {"index_arrays", levels}};
}

ordered_json json_from(const TileGrid& grid) {
  return {{"tile_columns", grid.tile_columns()}, {"tile_rows", grid.tile_rows()},
          {"tiles", grid.tile_count()},          {"extent_x", grid.extent_x()},
          {"extent_z", grid.extent_z()},         {"column_spacing", 2.0 * grid.sigma_x()},
          {"row_spacing", grid.sigma_z()},       {"aspect", std::numbers::sqrt3 * grid.sigma_x() / grid.sigma_z()},
          {"world_width", grid.world_width()},   {"world_height", grid.world_height()}};
}

ordered_json json_from(const WorldBounds& bounds) {
  return {{"x0", bounds.x0}, {"z0", bounds.z0}, {"x1", bounds.x1}, {"z1", bounds.z1}};
}

}  // namespace isohf::cli
