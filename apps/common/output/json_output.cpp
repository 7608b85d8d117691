#include "output/json_output.h"

#include <fmt/format.h>

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

namespace {

/// Control characters that JSON would let through, U+007F to U+009F, as escapes.
std::string without_controls(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0U;
    if (byte == 0x7f) {
      out += "\\u007f";
    } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
      out += fmt::format("\\u{:04x}", next);
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace

std::string json_text(const ordered_json& document) {
  return without_controls(document.dump(2, ' ', false, ordered_json::error_handler_t::replace)) + "\n";
}

std::string json_line(const ordered_json& document) {
  return without_controls(document.dump(-1, ' ', false, ordered_json::error_handler_t::replace)) + "\n";
}

}  // namespace isohf::cli
