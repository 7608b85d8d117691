#pragma once

#include <array>
#include <string>
#include <vector>

#include "gl/gl_objects.h"
#include "gl/vec.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"

namespace isohf::view {

/// The uniforms of the terrain's vertex shader that hold for a whole frame.
struct TerrainFrame {
  Mat4 clip_from_eye = Mat4::identity();
  Vec3 anchor;  ///< North-West corner of the anchor tile seen from the eye; y: elevation of code 0
  TileIndex anchor_tile{0, 0};
  double code_height = 1.0;  ///< world units of one code
  double code_slope = 1.0;   ///< the same for normals
  /// What is shown of tiles that are cut, seen from the eye; all of the world unless said otherwise.
  WorldBounds covered{-1e30, -1e30, 1e30, 1e30};
};

/// A program with the terrain's vertex shader and one fragment shader or another.
class TerrainProgram {
 public:
  TerrainProgram(const std::string& name, bool rim, const std::string& fragment_source,
                 const std::vector<std::string>& feedback = {});

  /// Makes the program current and sets the frame's uniforms.
  void begin(const TileGrid& grid, const TerrainFrame& frame) const;
  /// Before the tile's draw calls.
  void set_tile(const TileGrid& grid, const TerrainFrame& frame, TileIndex tile) const;

  [[nodiscard]] const Program& program() const { return program_; }
  [[nodiscard]] GLint uniform(const char* name) const { return program_.uniform(name); }

 private:
  Program program_;
};

}  // namespace isohf::view
