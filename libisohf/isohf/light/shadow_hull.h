#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/lattice/shadow_path.h"

/// Shadow seeds for every sun elevation at once: the state in which light enters a tile along a row. It comes to the
/// last vertex before the tile's edge, which the tile stores as padding. What is handed to that vertex, as a function
/// of t = tan(sun elevation), is max over all earlier vertices of (height - distance * t): an upper envelope of lines,
/// so the upper convex hull of the points (distance, height). A few casters stand for a whole row.
///
///   height      b                 A vertex that is not higher than a later one never matters again; nor does one
///     |         .  `-. a          under the line between its neighbours (c). Where only suns above t_min are asked
///     |   c     .     | `. edge   for, what a later vertex overtops by more than distance * t_min goes as well.
///     +---------'-----'---'----> the vertex before the edge
///
/// Heights are in codes (or elevations for float archives), falls in the same unit for one half step. With codes and
/// distances below 2^37 half steps every comparison of the hull is exact.

namespace isohf {

/// The casters of one row as the light passes over it.
class ShadowHull {
 public:
  /// fall_min  the least fall that will be asked for, height units for one half step, >= 0
  explicit ShadowHull(double fall_min) : fall_min_(fall_min) {}

  /// The next vertex on the way; positions in half steps, ascending (the same one twice counts once). Amortised O(1).
  void push(std::int64_t position, double height);

  /// The casters seen from `position` (not before the last vertex pushed), nearest first, appended to `out`.
  void casters_at(std::int64_t position, std::vector<ShadowCaster>& out) const;

  void clear() { points_.clear(); }

 private:
  struct Point {
    std::int64_t position;
    double height;
  };
  double fall_min_;
  std::vector<Point> points_;  ///< nearest last
};

/// The casters among a tile's own vertices, as seen from the edge where the light leaves, without those on that edge.
struct TileCasters {
  CasterRows eastward;
  CasterRows westward;
};

/// codes or heights [C x R]; NaN, infinities and elevations beyond 3e38 are void. Thread-safe. O(C R), a few vertices
/// at a time.
[[nodiscard]] TileCasters tile_casters(const TileShape& shape, View2D<const std::uint16_t> codes,
                                       std::uint16_t void_code, double fall_min);
[[nodiscard]] TileCasters tile_casters(const TileShape& shape, View2D<const float> heights, double fall_min);

/// What a tile hands on: the casters that entered it (seen from the edge where they enter) and its own (as tile_casters
/// gives them), seen from the edge where the light leaves.
[[nodiscard]] CasterRows pass_on_casters(const TileShape& shape, const CasterRows& entering, const CasterRows& own,
                                         double fall_min);

/// What the next tile's seeds hold of that: not the last vertices before the edge, which it stores as padding.
[[nodiscard]] CasterRows beyond_padding(const CasterRows& casters);

/// No casters in any row: what enters the first tile.
[[nodiscard]] CasterRows no_casters(const TileShape& shape);

}  // namespace isohf
