#pragma once

#include <vector>

#include "gl/gl_objects.h"
#include "gl/terrain_program.h"
#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

/// The block that the ground stands on: walls from its outer edge down to a floor, which is hatched, so that voids are
/// told from low ground. Walls follow the finest plane whose edge has not more vertices than a few screens have columns.
class Block {
 public:
  explicit Block(const TileSource& source);

  /// Height of the floor, as drawn.
  [[nodiscard]] static double floor(const TileSource& source, const ViewState& view);

  /// Makes the program current and sets its places; the caller sets the light.
  const Program& begin(const ViewState& view, const TerrainFrame& frame) const;
  void draw() const;

 private:
  struct Side {
    Vec3 outwards;
    GLint first;
    GLsizei count;
  };
  void add_side(const TileSource& plane, WorldPoint from, WorldPoint to, double step, Vec3 outwards);

  const TileSource& source_;
  WorldBounds covered_;
  Program program_;
  Buffer vertices_;
  VertexArray array_;
  std::vector<float> places_;  ///< x and z from the North-West corner, height, 1 at the ground and 0 at the floor
  std::vector<Side> sides_;    ///< the floor first
};

}  // namespace isohf::view
