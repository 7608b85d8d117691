#include "isohf/restore/archive_geometry.h"

#include <cmath>

#include "isohf/base/error.h"

namespace isohf {

bool is_warped(const Metadata& metadata) {
  return metadata.projection && metadata.projection->spec.kind != ProjectionKind::kEquirectangular;
}

GeoPlaces::GeoPlaces(const Metadata& metadata) : geometry_(archive_geometry(metadata)) {
  const SourceRecord& source = metadata.source;
  const bool has_place = source.crs_unit == "degree" && source.origin_x && source.origin_y &&
                         source.crs_spacing_x > 0.0 && source.crs_spacing_y > 0.0;
  if (!has_place) {
    throw Error(ErrorCode::kInvalidArgument,
                "the archive's source has no place in degrees; give places in world units, --at X Z");
  }
  first_sample_ = {*source.origin_x, *source.origin_y};
  degrees_x_ = source.crs_spacing_x;
  degrees_y_ = source.crs_spacing_y;
  if (geometry_.warp) warp_.emplace(*geometry_.warp);
}

WorldPoint GeoPlaces::world_from_geo(GeoPoint place) const {
  // Of all turns the one nearest to the source's middle.
  const double middle = first_sample_.longitude + 0.5 * static_cast<double>(geometry_.width - 1) * degrees_x_;
  const double longitude = middle + std::remainder(place.longitude - middle, 360.0);
  const SourcePosition at{(longitude - first_sample_.longitude) / degrees_x_,
                          (first_sample_.latitude - place.latitude) / degrees_y_};
  if (warp_) return warp_->world_from_source(at);
  double x = geometry_.first_sample_x + at.u * geometry_.spacing_x;
  if (geometry_.wraps_x) {  // the West half of the first area is the end of the last tile
    const double round = 360.0 / degrees_x_ * geometry_.spacing_x;
    x -= round * std::floor(x / round);
  }
  return {x, geometry_.first_sample_z + at.v * geometry_.spacing_z};
}

SourceGeometry archive_geometry(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  SourceGeometry geometry;
  geometry.width = source.width;
  geometry.height = source.height;
  geometry.registration = source.registration == "area" ? Registration::kArea : Registration::kPoint;
  geometry.first_sample_x = source.first_sample_x;
  geometry.first_sample_z = source.first_sample_z;
  geometry.spacing_x = source.spacing_x;
  geometry.spacing_z = source.spacing_z;
  geometry.outside = outside_from_string(metadata.outside);
  geometry.wraps_x = metadata.wraps_x;
  if (!is_warped(metadata)) return geometry;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    throw Error(ErrorCode::kCorrupt, "metadata: source.crs: has no origin or spacing, which the projection needs");
  }
  geometry.warp = WarpPlace{metadata.projection->spec,
                            metadata.projection->origin,
                            {*source.origin_x, *source.origin_y},
                            source.crs_spacing_x,
                            source.crs_spacing_y,
                            source.width,
                            source.height};
  // The source itself, not the world, which then is a map of a cap.
  const double columns = geometry.warp->columns_round();
  geometry.wraps_x = std::abs(static_cast<double>(source.width) - columns) <= 0.01;
  return geometry;
}

}  // namespace isohf
