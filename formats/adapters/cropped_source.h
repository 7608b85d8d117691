#pragma once

#include <memory>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Ground in the coordinates of a raster's own reference system.
struct BoundingBox {
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;
};

/// "WEST,SOUTH,EAST,NORTH". Throws Error{kInvalidArgument} unless West < East or both are longitudes (a box across the
/// 180th meridian), and South < North.
[[nodiscard]] BoundingBox bounding_box_from_string(const std::string& text);

/// The samples of a raster that lie in the box: posts in it or on its edge; of areas those whose middles are.
/// Longitudes are compared modulo 360 degrees; of a box across the seam of a globe, whole rows. Throws
/// Error{kInvalidArgument} where the raster does not say where it lies, has fewer than 2x2 samples there, or has them
/// at both ends without going all the way round.
[[nodiscard]] Window samples_in(const BoundingBox& box, const SourceInfo& info);

/// A part of another raster: its samples in the box. A box that reaches beyond the raster ends there, with a warning;
/// one that crosses the seam of a globe is taken whole.
[[nodiscard]] std::unique_ptr<HeightSource> crop(std::unique_ptr<HeightSource> source, const BoundingBox& box);

}  // namespace isohf
