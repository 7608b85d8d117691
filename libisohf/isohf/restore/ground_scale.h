#pragma once

#include "isohf/lattice.h"
#include "isohf/metadata.h"
#include "isohf/projection.h"

namespace isohf {

/// Metres in one unit of an archive's world along its axes, where it is laid out in degrees: a degree of longitude as long
/// as it is in the middle. 1 where the world is in metres or in unknown units.
struct GroundScale {
  double x = 1.0;
  double z = 1.0;
};
[[nodiscard]] GroundScale ground_scale(const Metadata& metadata);

/// Metres between two places on the body of an archive's source, along its ellipsoid.
[[nodiscard]] double ground_distance_m(const Metadata& metadata, GeoPoint from, GeoPoint to);

/// Whether the archive's world is its source's degrees.
[[nodiscard]] bool is_in_degrees(const Metadata& metadata);

[[nodiscard]] TileGrid scaled(const TileGrid& grid, GroundScale scale);
[[nodiscard]] WorldBounds scaled(const WorldBounds& bounds, GroundScale scale);

}  // namespace isohf
