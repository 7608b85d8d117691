#pragma once

#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

/// Where a viewer stands and looks. Angles: heading clockwise from North, pitch up from the horizon.
struct Camera {
  Vec3 eye;
  double heading_rad = 0.0;
  double pitch_rad = 0.0;

  [[nodiscard]] Vec3 forward() const;
  [[nodiscard]] Vec3 right() const { return {std::cos(heading_rad), 0.0, std::sin(heading_rad)}; }

  /// Looks from `from` at `target`.
  void look_at(Vec3 from, Vec3 target);
  /// Walks round a point, which stays where it is on the screen. Stops short of straight up and down.
  void orbit(Vec3 about, double heading_change_rad, double pitch_change_rad);

  friend bool operator==(const Camera&, const Camera&) = default;
};

/// Direction of the ray through a place on the screen: x and y from -1 to 1, eastwards and upwards of its middle.
[[nodiscard]] Vec3 ray_through(const Camera& camera, const ViewState& view, double x, double y);

/// Where a place is seen; nullopt: behind the eye.
[[nodiscard]] std::optional<PicturePoint> project(const Camera& camera, const ViewState& view, Vec3 at);

/// Part of the way from one camera to another, 0...1, the short way round.
[[nodiscard]] Camera between(const Camera& from, const Camera& to, double share);

/// A camera in the South-East that sees all that the source covers, as large as the view takes; what it looks at goes to `target` where
/// wanted.
[[nodiscard]] Camera overview_camera(const TileSource& source, const ViewState& view, Vec3* target = nullptr);

/// 1, but where the heights of all are in no known proportion to the ground, or so low that nothing would be seen of
/// them: 1, 2 or 5 times a power of ten.
[[nodiscard]] double default_exaggeration(const TileSource& source);

/// Distance from a point to the farthest corner of the heightfield, of which `whole` are the bounds.
[[nodiscard]] double farthest_corner(const TileGrid& grid, const TileBounds& whole, Vec3 eye, double exaggeration);

}  // namespace isohf::view
