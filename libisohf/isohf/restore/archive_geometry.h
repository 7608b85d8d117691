#pragma once

#include "isohf/archive/metadata.h"
#include "isohf/surface/source_geometry.h"

namespace isohf {

/// Where the samples of an archive's source lie in its world, as the metadata have it. Throws Error{kCorrupt} where the
/// metadata name a projection without the source's place in degrees.
[[nodiscard]] SourceGeometry archive_geometry(const Metadata& metadata);

/// Degrees <-> world of an archive whose source was in degrees.
class GeoPlaces {
 public:
  /// Throws Error{kInvalidArgument} where the source was not in degrees, or had no place.
  explicit GeoPlaces(const Metadata& metadata);

  /// Longitudes are taken modulo 360, nearest to the source's middle. NaN where the map has no place for it.
  [[nodiscard]] WorldPoint world_from_geo(GeoPoint place) const;

 private:
  SourceGeometry geometry_;
  std::optional<ExactWarp> warp_;
  GeoPoint first_sample_;
  double degrees_x_;
  double degrees_y_;
};

/// True where rows of the source are no rows of the world.
[[nodiscard]] bool is_warped(const Metadata& metadata);

}  // namespace isohf
