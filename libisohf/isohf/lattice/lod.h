#pragma once

#include "isohf/lattice.h"

/// Choosing a level of detail and fading between two (paper sections 3.8-3.9, Eqs. 7-8, erratum E18).

namespace isohf {

/// Area in pixels that a drawn triangle is meant to have: section 3.9 uses level λ where full-detail triangles have
/// 4^(1-λ) pixels, and a triangle of level λ is made of 4^λ of those.
inline constexpr double kTriangleTarget_px = 4.0;

/// What to draw for one tile: `first` opaque with depth writes, then `second` blended over it with `alpha`, depth
/// writes off.
struct LodBlend {
  int first;     ///< L1
  int second;    ///< L2; equal to first only where no coarser level exists
  double alpha;  ///< in [0, 1]; 0: draw first alone
};

/// World area of a full-detail triangle in a tile tilted by `slope` (rise per unit of run, 0 flat, 1 is 45 degrees):
/// σx·σz·√(1 + slope²) (erratum E18). The paper estimates with 45 degrees.
[[nodiscard]] double triangle_area(const TileGrid& grid, double slope);

/// Pixels that a world area covers when it faces the viewer: area·(focal/distance)². The paper divides by the distance
/// once; areas shrink with its square.
/// focal_px  pixels per unit of slope: viewport height / (2·tan(vertical field of view / 2))
/// distance  camera-space depth of the tile's centre, world units; <= 0 gives infinity
[[nodiscard]] double projected_area_px(double world_area, double focal_px, double distance);

/// Fractional level of detail at which triangles have target_px pixels: ½·log2(target/area), in [0, levels - 1].
/// area_px  pixels of a full-detail triangle, >= 0 (0 gives the coarsest level, infinity or NaN level 0)
[[nodiscard]] double fractional_level(double area_px, int levels, double target_px = kTriangleTarget_px);

/// Eqs. 7-8: the two-stage transition at a fractional level, in [0, levels - 1] (values outside are moved there).
/// With F = floor(level) and β = level - F: β < ½ draws F, then F+1 with α = 2β; otherwise F+1, then F with α = 2 - 2β.
[[nodiscard]] LodBlend lod_blend(double level, int levels);

}  // namespace isohf
