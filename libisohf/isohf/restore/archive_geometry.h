#pragma once

#include "isohf/error.h"
#include "isohf/metadata.h"
#include "isohf/surface/resample/tile_resampler.h"

namespace isohf {

/// What metadata name as `member`. Throws Error{kUnsupported} where this build does not know the name.
template <typename T>
[[nodiscard]] const T& known(const std::optional<T>& value, const char* member) {
  if (value) return *value;
  throw Error(ErrorCode::kUnsupported,
              std::string("metadata: ") + member + ": is a name that this build does not know");
}

/// Where the samples of an archive's source lie in its world, as the metadata have it. Throws Error{kCorrupt} where the
/// metadata name a projection without the source's place in degrees.
[[nodiscard]] SourceGeometry archive_geometry(const Metadata& metadata);

/// World of an archive <-> longitudes and latitudes, and coordinates of its source, which are the same where that was
/// in degrees.
class GeoPlaces {
 public:
  explicit GeoPlaces(const Metadata& metadata);

  /// Whether there are longitudes and latitudes: of a source in degrees, on a map that was understood
  /// (SourceRecord::map), or laid on another map.
  [[nodiscard]] bool knows_geo() const { return is_placed_ && (in_degrees_ || map_ || geometry_.warp); }
  /// Whether there are coordinates of the source: not of one that was laid on another map and is not understood.
  [[nodiscard]] bool knows_source() const { return is_placed_ && (in_degrees_ || map_ || !geometry_.warp); }
  /// Throws Error{kInvalidArgument} unless knows_geo().
  void require_geo() const;

  /// Longitudes are taken modulo 360, nearest to the source's middle. NaN where the map has no place for it.
  [[nodiscard]] WorldPoint world_from_geo(GeoPoint place) const;
  /// longitude in [-180, 180]. NaN where the map shows no place.
  [[nodiscard]] GeoPoint geo_from_world(WorldPoint place) const;
  [[nodiscard]] WorldPoint world_from_source(MapPoint place) const;
  [[nodiscard]] MapPoint source_from_world(WorldPoint place) const;

 private:
  [[nodiscard]] WorldPoint world_from_position(SourcePosition at) const;

  SourceGeometry geometry_;
  std::optional<ExactWarp> warp_;
  std::shared_ptr<const ReferenceMap> map_;  ///< nullptr: the source was in degrees, or is not understood
  bool in_degrees_;
  bool is_placed_;
  MapPoint first_sample_;
  double step_x_ = 0.0;
  double step_y_ = 0.0;
};

/// True where rows of the source are no rows of the world.
[[nodiscard]] bool is_warped(const Metadata& metadata);

}  // namespace isohf
