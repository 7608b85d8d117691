#include "isohf/restore/archive_geometry.h"

#include <cmath>

#include "isohf/error.h"

namespace isohf {
namespace {

bool has_place(const SourceRecord& source) {
  return source.origin_x && source.origin_y && source.crs_spacing_x > 0.0 && source.crs_spacing_y > 0.0;
}

/// With a warp that knows no source_map where the source's own map is not understood.
SourceGeometry geometry_of(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  SourceGeometry geometry;
  geometry.width = source.width;
  geometry.height = source.height;
  geometry.registration = source.registration == Registration::kArea ? Registration::kArea : Registration::kPoint;
  geometry.first_sample_x = source.first_sample_x;
  geometry.first_sample_z = source.first_sample_z;
  geometry.spacing_x = source.spacing_x;
  geometry.spacing_z = source.spacing_z;
  geometry.outside = known(metadata.outside, "outside");
  geometry.wraps_x = metadata.wraps_x;
  if (!is_warped(metadata)) return geometry;
  if (!has_place(source)) {
    throw Error(ErrorCode::kCorrupt, "metadata: source.crs: has no origin or spacing, which the projection needs");
  }
  const bool in_degrees = source.crs_unit == "degree";
  geometry.warp = WarpPlace{metadata.projection->spec,
                            metadata.projection->origin,
                            {*source.origin_x, *source.origin_y},
                            source.crs_spacing_x,
                            source.crs_spacing_y,
                            source.width,
                            source.height,
                            in_degrees ? nullptr : source.map};
  // The source itself, not the world, which then is a map of a cap.
  geometry.wraps_x = in_degrees && std::abs(static_cast<double>(source.width) - geometry.warp->columns_round()) <= 0.01;
  return geometry;
}

}  // namespace

bool is_warped(const Metadata& metadata) {
  return metadata.projection && metadata.projection->spec.kind != ProjectionKind::kEquirectangular;
}

GeoPlaces::GeoPlaces(const Metadata& metadata)
    : geometry_(geometry_of(metadata)),
      map_(metadata.source.map),
      in_degrees_(metadata.source.crs_unit == "degree"),
      is_placed_(has_place(metadata.source)) {
  if (!is_placed_) return;
  const SourceRecord& source = metadata.source;
  first_sample_ = {*source.origin_x, *source.origin_y};
  step_x_ = source.crs_spacing_x;
  step_y_ = source.crs_spacing_y;
  if (geometry_.warp) warp_.emplace(*geometry_.warp);
}

void GeoPlaces::require_geo() const {
  if (knows_geo()) return;
  throw Error(ErrorCode::kInvalidArgument,
              "the archive's source has no place in degrees; give places in world units, --at X Z");
}

WorldPoint GeoPlaces::world_from_position(SourcePosition at) const {
  if (warp_) return warp_->world_from_source(at);
  double x = geometry_.first_sample_x + at.u * geometry_.spacing_x;
  if (geometry_.wraps_x) {  // the West half of the first area is the end of the last tile
    const double round = 360.0 / step_x_ * geometry_.spacing_x;
    x -= round * std::floor(x / round);
  }
  return {x, geometry_.first_sample_z + at.v * geometry_.spacing_z};
}

WorldPoint GeoPlaces::world_from_geo(GeoPoint place) const {
  if (!in_degrees_ && warp_) {
    const MapPoint at = warp_->map_from_geo(place);
    return {at.easting - warp_->place().origin.easting, warp_->place().origin.northing - at.northing};
  }
  return world_from_source(map_ ? map_->map_from_geo(place) : MapPoint{place.longitude, place.latitude});
}

GeoPoint GeoPlaces::geo_from_world(WorldPoint place) const {
  if (warp_) return warp_->geo_from_world(place);
  const MapPoint at = source_from_world(place);
  return map_ ? map_->geo_from_map(at) : GeoPoint{at.easting, at.northing};
}

WorldPoint GeoPlaces::world_from_source(MapPoint place) const {
  if (in_degrees_) {
    // Of all turns the one nearest to the source's middle.
    const double middle = first_sample_.easting + 0.5 * static_cast<double>(geometry_.width - 1) * step_x_;
    place.easting = middle + std::remainder(place.easting - middle, 360.0);
  }
  return world_from_position(
      {(place.easting - first_sample_.easting) / step_x_, (first_sample_.northing - place.northing) / step_y_});
}

MapPoint GeoPlaces::source_from_world(WorldPoint place) const {
  if (warp_) {
    const GeoPoint geo = warp_->geo_from_world(place);
    return map_ ? map_->map_from_geo(geo) : MapPoint{geo.longitude, geo.latitude};
  }
  const MapPoint at{first_sample_.easting + (place.x - geometry_.first_sample_x) / geometry_.spacing_x * step_x_,
                    first_sample_.northing - (place.z - geometry_.first_sample_z) / geometry_.spacing_z * step_y_};
  return in_degrees_ ? MapPoint{std::remainder(at.easting, 360.0), at.northing} : at;
}

SourceGeometry archive_geometry(const Metadata& metadata) {
  if (is_warped(metadata) && metadata.source.crs_unit != "degree" && !metadata.source.map) {
    throw Error(ErrorCode::kUnsupported,
                "its input lies on a map of its own, whose reference system has to be understood first");
  }
  return geometry_of(metadata);
}

}  // namespace isohf
