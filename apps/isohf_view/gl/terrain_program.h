#pragma once

#include <string>
#include <vector>

#include "gl/gl_objects.h"
#include "gl/vec.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"
#include "view_state.h"

namespace isohf::view {

/// Fragment shaders for the terrain; they discard voids. Light, colours and haze: one for each mode.
[[nodiscard]] std::string terrain_fragment_shader(ColourMode mode);
/// (elevation code, 0, 0, 1): what verifying reads back.
[[nodiscard]] std::string probe_fragment_shader();
/// One flat colour: wireframes.
[[nodiscard]] std::string flat_fragment_shader();

/// The uniforms of the terrain's vertex shader that hold for a whole frame.
struct TerrainFrame {
  Mat4 clip_from_eye = Mat4::identity();
  Vec3 anchor;  ///< North-West corner of the anchor tile seen from the eye; y: elevation of code 0
  TileIndex anchor_tile{0, 0};
  double code_height = 1.0;  ///< world units of one code
  /// What is shown of tiles that are cut, seen from the eye; all of the world unless said otherwise.
  WorldBounds covered{-1e30, -1e30, 1e30, 1e30};
};

/// A program with the terrain's vertex shader, which every picture and every check draws through, and one fragment
/// shader or another. Vertex attributes: 0 the shared object-space (x, z); 1 the depth in the shadow (constant 0
/// without). Texture units: 0 the tile's texture, 1 the palette, 2 its elevation codes, which TileSlot::bind() binds.
class TerrainProgram {
 public:
  TerrainProgram(const std::string& name, const std::string& fragment_source,
                 const std::vector<std::string>& feedback = {});

  /// Makes the program current and sets the frame's uniforms.
  void begin(const TileGrid& grid, const TerrainFrame& frame) const;
  /// Before the tile's draw calls. `grid` is that of the finest plane, `stride` how many of its steps one of the tile's
  /// plane takes.
  void set_tile(const TileGrid& grid, const TerrainFrame& frame, TileIndex tile, std::int64_t stride = 1) const;

  [[nodiscard]] GLint uniform(const char* name) const { return program_.uniform(name); }

 private:
  Program program_;
};

}  // namespace isohf::view
