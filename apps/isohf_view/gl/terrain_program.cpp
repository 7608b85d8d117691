#include "gl/terrain_program.h"

#include "gl/shaders.h"

namespace isohf::view {

TerrainProgram::TerrainProgram(const std::string& name, bool rim, const std::string& fragment_source,
                               const std::vector<std::string>& feedback)
    : program_(name, terrain_vertex_shader(rim), fragment_source, feedback) {}

void TerrainProgram::begin(const TileGrid& grid, const TerrainFrame& frame) const {
  program_.use();
  const auto set_vec2 = [this](const char* name, double x, double y) {
    glUniform2f(uniform(name), static_cast<float>(x), static_cast<float>(y));
  };
  glUniform1i(uniform("tile_texture"), 0);
  glUniform2i(uniform("last_xz"), 2 * grid.shape().cell_columns(), grid.shape().cell_rows());
  set_vec2("sigma", grid.sigma_x(), grid.sigma_z());
  set_vec2("object_size", 2.0 * grid.shape().cell_columns(), grid.shape().cell_rows());
  glUniform3f(uniform("anchor"), static_cast<float>(frame.anchor.x), static_cast<float>(frame.anchor.y),
              static_cast<float>(frame.anchor.z));
  glUniform1f(uniform("code_height"), static_cast<float>(frame.code_height));
  glUniform1f(uniform("code_slope"), static_cast<float>(frame.code_slope));
  glUniform4f(uniform("covered"), static_cast<float>(frame.covered.x0), static_cast<float>(frame.covered.z0),
              static_cast<float>(frame.covered.x1), static_cast<float>(frame.covered.z1));
  glUniformMatrix4fv(uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
}

void TerrainProgram::set_tile(const TileGrid& grid, const TerrainFrame& frame, TileIndex tile) const {
  const auto x = (tile.column - frame.anchor_tile.column) * 2 * grid.shape().cell_columns();
  const auto z = (tile.row - frame.anchor_tile.row) * grid.shape().cell_rows();
  glUniform2i(uniform("tile_lattice"), static_cast<GLint>(x), static_cast<GLint>(z));
}

}  // namespace isohf::view
