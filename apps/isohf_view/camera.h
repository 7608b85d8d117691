#pragma once

#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

/// Where a viewer stands and looks. Angles: heading clockwise from North, pitch up from the horizon.
struct Camera {
  enum class Kind { kFly, kOrbit };

  Kind kind = Kind::kOrbit;
  Vec3 eye;
  double heading_rad = 0.0;
  double pitch_rad = 0.0;
  Vec3 pivot;  ///< orbit: looked at, eye = pivot - distance * forward
  double distance = 1.0;

  [[nodiscard]] Vec3 forward() const;

  /// Looks from `eye` at `target`, which becomes the pivot.
  void look_at(Vec3 from, Vec3 target);
  /// Mouse drag: turns the head (fly) or walks round the pivot (orbit).
  void turn(double heading_change_rad, double pitch_change_rad);
  /// Steps to the right, up and ahead, world units; the pivot goes along.
  void move(double right, double up, double ahead);
  /// Orbit: changes the distance from the pivot by a factor; fly: moves ahead.
  void zoom(double factor);
  void switch_kind();
};

/// A camera that sees all that the source covers from the South-East, as large as the view takes.
[[nodiscard]] Camera overview_camera(const TileSource& source, const ViewState& view);

/// Distance from a point to the farthest corner of the heightfield, of which `whole` are the bounds.
[[nodiscard]] double farthest_corner(const TileGrid& grid, const TileBounds& whole, Vec3 eye, double exaggeration);

}  // namespace isohf::view
