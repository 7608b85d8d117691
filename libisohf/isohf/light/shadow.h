#pragma once

#include <algorithm>
#include <limits>
#include <span>

#include "isohf/base/view.h"
#include "isohf/lattice.h"
#include "isohf/lattice/shadow_path.h"

/// Shadows that the surface casts on itself (paper section 3.13, errata E14-E16). The sun stands due West or due East;
/// S at a vertex is the height up to which it is dark there: max over the vertices nearer to the sun, and itself, of
/// elevation - distance * tan(sun elevation).

namespace isohf {

/// S where nothing casts a shadow yet: before the first vertex that has an elevation.
inline constexpr double kNoShadow = -std::numeric_limits<double>::infinity();

/// A sun in the plane of the rows.
struct ShadowLight {
  LightTravel travel = LightTravel::kEastward;
  /// Elevation units that the shadow falls for one world unit: tan(sun elevation), times world units for one unit of
  /// elevation where these differ; > 0.
  double fall = 1.0;
};

/// Shadow heights of a whole tile: every visible row at once, several side by side since each is serial.
///
/// grid        for the shape and the spacing of columns
/// elevations  [C x R]  NaN and infinities are void
/// entering       for stored rows 1 to R-2, shadow height at the edge where light enters, elevation units or
///                      kNoShadow; empty: none anywhere
/// shadow      [C x R]  out at visible vertices, kNoShadow at others; must not overlap elevations. A view without data
///                      (null) is not written
/// leaving        out, shadow height at the edge where light leaves, for the next tile; may be the same array as
///                      entering; empty: not written
/// A path's last vertex is the next path's first, and both count it once. Each S is within 3 roundings (double, then
/// float) of the exact one, however long the path. O(C R), no allocation, thread-safe, cannot fail.
void tile_shadow(const TileGrid& grid, View2D<const float> elevations, const ShadowLight& light,
                 std::span<const double> entering, View2D<float> shadow, std::span<double> leaving);

/// The share of the sun that is seen from height y where S is the shadow height (Eq. 16, errata E16):
/// clamp((y - S + k/2) / k, 0, 1). softness is k, the sun's apparent size at the caster's distance, elevation units, >
/// 0.
[[nodiscard]] inline double sun_share(double y, double shadow, double softness) {
  return std::clamp((y - shadow + softness / 2.0) / softness, 0.0, 1.0);
}

/// The same for the surface itself. It never rises above its own S, where Eq. 16 leaves half of the sun at most: so
/// twice that share. 1 where y = S, 0 from k/2 below.
[[nodiscard]] inline double sun_share_on_surface(double y, double shadow, double softness) {
  return std::min(1.0, 2.0 * sun_share(y, shadow, softness));
}

}  // namespace isohf
