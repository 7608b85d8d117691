#pragma once

#include <span>
#include <vector>

#include "gl/offscreen.h"
#include "gl/terrain_program.h"
#include "gl/tile_buffers.h"
#include "verify/mesh_oracle.h"

namespace isohf::view {

/// What the vertex shader made of one vertex, captured by transform feedback.
struct ProbedVertex {
  float x, y, z, w;  ///< from the North-West corner of tile (0, 0) and code 0, world units; w = 1
  float nx, ny, nz, distance;
  float object_x, object_z, code, shadow;
};

/// Draws a tile from straight above with the terrain's vertex shader into floats: (code, 0, 0, count).
class TileProbe {
 public:
  TileProbe(const TileGrid& grid, const SharedGeometry& shared, double code_height);

  /// Strip and stitch of one level, added up, without back faces. Rows from the South.
  void draw_level(const TileSlot& slot, int level, const PixelWindow& window, std::vector<float>& out);
  /// All stored vertices, drawn as those of `tile`; padding gets no sensible normal.
  void capture(const TileSlot& slot, TileIndex tile, std::vector<ProbedVertex>& out);
  [[nodiscard]] int width() const { return target_.width(); }  ///< pixels of a row of the pictures

 private:
  const TileGrid& grid_;
  const SharedGeometry& shared_;
  TerrainFrame frame_;
  TerrainProgram height_;
  TerrainProgram feedback_;
  Offscreen target_;
  Buffer captured_;
};

}  // namespace isohf::view
