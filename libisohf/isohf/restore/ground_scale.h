#pragma once

#include "isohf/lattice.h"
#include "isohf/metadata.h"
#include "isohf/projection.h"

namespace isohf {

/// Metres in one unit of an archive's world along its axes, and in one of its elevation units. 1 if a unit is unknown.
/// In a world laid out in degrees, a degree of longitude is as long as it is in the middle.
struct GroundScale {
  double x = 1.0;
  double z = 1.0;
  double elevation = 1.0;
};
[[nodiscard]] GroundScale ground_scale(const Metadata& metadata);

/// Metres between two places on the body of an archive's source, along its ellipsoid.
[[nodiscard]] double ground_distance_m(const Metadata& metadata, GeoPoint from, GeoPoint to);

[[nodiscard]] TileGrid scaled(const TileGrid& grid, GroundScale scale);
[[nodiscard]] WorldBounds scaled(const WorldBounds& bounds, GroundScale scale);

}  // namespace isohf
