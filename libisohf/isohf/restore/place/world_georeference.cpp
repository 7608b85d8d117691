#include <cmath>

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/error.h"
#include "isohf/projection/reference_map.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface.h"

namespace isohf {
namespace {

bool has_origin(const SourceRecord& source) {
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
  geometry.wraps_x = metadata.wraps_x;
  if (!is_warped(metadata)) return geometry;
  if (!has_origin(source)) {
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

SourceGeometry archive_geometry(const Metadata& metadata) {
  if (is_warped(metadata) && metadata.source.crs_unit != "degree" && !metadata.source.map) {
    throw Error(ErrorCode::kUnsupported,
                "its input lies on a map of its own, whose reference system has to be understood first");
  }
  SourceGeometry geometry = geometry_of(metadata);
  if (const auto cut = cut_record(metadata)) geometry.coarser = static_cast<double>(cut->coarser.value_or(1));
  return geometry;
}

struct WorldGeoreference::State {
  SourceGeometry geometry;
  std::optional<ExactWarp> warp;
  std::shared_ptr<const ReferenceMap> map;  ///< nullptr: the source was in degrees, or is not understood
  bool in_degrees = false;
  bool has_origin = false;
  bool is_lost = false;  ///< the world lies on a reference system that is not understood
  MapPoint first_sample;
  double step_x = 0.0;
  double step_y = 0.0;

  std::optional<double> turn;  ///< of the source's coordinates once round the body, where a length of them is that

  double middle = 0.0;  ///< of the source, or of what was extracted, in the source's coordinates

  /// Of all turns of a longitude, or an easting, the one nearest to the middle.
  [[nodiscard]] double own_turn(double longitude) const {
    if (!turn) return longitude;
    return longitude - *turn * std::nearbyint((longitude - middle) / *turn);
  }

  [[nodiscard]] WorldPoint world_from_position(SourcePosition at) const {
    if (warp) return warp->world_from_source(at);
    double x = geometry.first_sample_x + at.u * geometry.spacing_x;
    if (geometry.wraps_x) {  // the West half of the first area is the end of the last tile
      const double round = turn.value_or(static_cast<double>(geometry.width) * step_x) / step_x * geometry.spacing_x;
      x -= round * std::floor(x / round);
    }
    return {x, geometry.first_sample_z + at.v * geometry.spacing_z};
  }
};

WorldGeoreference::WorldGeoreference(const Metadata& metadata) {
  auto state = std::make_shared<State>();
  const SourceRecord& source = metadata.source;
  state->geometry = geometry_of(metadata);
  state->map = source.map;
  state->in_degrees = source.crs_unit == "degree";
  state->has_origin = isohf::has_origin(source);
  if (state->has_origin) {
    state->first_sample = {*source.origin_x, *source.origin_y};
    state->step_x = source.crs_spacing_x;
    state->step_y = source.crs_spacing_y;
    const WorldBounds& ground = metadata.valid;
    const double from_first = is_cut(metadata) && !state->geometry.warp
                                  ? (0.5 * (ground.x0 + ground.x1) - source.first_sample_x) / source.spacing_x
                                  : 0.5 * static_cast<double>(source.width - 1);
    state->middle = state->first_sample.easting + from_first * state->step_x;
    state->is_lost = state->geometry.warp && state->geometry.warp->projection.kind == ProjectionKind::kSystem &&
                     !state->geometry.warp->projection.map;
    if (state->geometry.warp && !state->is_lost) state->warp.emplace(*state->geometry.warp);
    const double columns = static_cast<double>(source.width);
    if (state->in_degrees) {
      state->turn = 360.0;
    } else if (metadata.wraps_x) {
      state->turn = columns * state->step_x;
    } else if (state->map) {
      state->turn = turn_of(*state->map,
                            {state->first_sample.easting + 0.5 * columns * state->step_x,
                             state->first_sample.northing - 0.5 * static_cast<double>(source.height) * state->step_y});
    }
  }
  state_ = std::move(state);
}

bool WorldGeoreference::has_geo() const {
  return state_->has_origin && !state_->is_lost && (state_->in_degrees || state_->map || state_->warp);
}

bool WorldGeoreference::has_source() const {
  return state_->has_origin && !state_->is_lost && (state_->in_degrees || state_->map || !state_->warp);
}

WorldPoint WorldGeoreference::world_from_geo(GeoPoint point) const {
  const State& s = *state_;
  if (!s.in_degrees && s.warp) {
    const MapPoint at = s.warp->map_from_geo(point);
    const MapPoint& origin = s.warp->place().origin;
    return {at.easting - origin.easting, origin.northing - at.northing};
  }
  return world_from_source(s.map ? s.map->map_from_geo(point) : MapPoint{point.longitude, point.latitude});
}

GeoPoint WorldGeoreference::geo_from_world(WorldPoint point) const {
  if (state_->warp) return state_->warp->geo_from_world(point);
  const MapPoint at = source_from_world(point);
  return state_->map ? state_->map->geo_from_map(at) : GeoPoint{std::remainder(at.easting, 360.0), at.northing};
}

WorldPoint WorldGeoreference::world_from_source(MapPoint point) const {
  const State& s = *state_;
  point.easting = s.own_turn(point.easting);
  return s.world_from_position(
      {(point.easting - s.first_sample.easting) / s.step_x, (s.first_sample.northing - point.northing) / s.step_y});
}

MapPoint WorldGeoreference::source_from_world(WorldPoint point) const {
  const State& s = *state_;
  if (s.warp) {
    const GeoPoint geo = s.warp->geo_from_world(point);
    const MapPoint at = s.map ? s.map->map_from_geo(geo) : MapPoint{geo.longitude, geo.latitude};
    return {s.own_turn(at.easting), at.northing};
  }
  const SourceGeometry& g = s.geometry;
  const MapPoint at{s.first_sample.easting + (point.x - g.first_sample_x) / g.spacing_x * s.step_x,
                    s.first_sample.northing - (point.z - g.first_sample_z) / g.spacing_z * s.step_y};
  return {s.own_turn(at.easting), at.northing};
}

}  // namespace isohf
