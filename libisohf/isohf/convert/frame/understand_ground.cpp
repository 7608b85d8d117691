#include <fmt/format.h>

#include <cmath>

#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/crs_operation.h"
#include "isohf/projection/reference_map.h"

namespace isohf {
namespace {

/// The ground of a source that says where it lies, for the choice among ways between datums.
GeoExtent rough_ground(const SourceInfo& info, const ReferenceMap* map) {
  const Georeference& place = info.georeference;
  GeoExtent ground{-180.0, -90.0, 180.0, 90.0};
  if (!place.has_origin) return ground;
  const MapBounds bounds{place.origin_x, place.origin_y - static_cast<double>(info.height - 1) * place.spacing_y,
                         place.origin_x + static_cast<double>(info.width - 1) * place.spacing_x, place.origin_y};
  if (map != nullptr) {
    const auto found = ground_under(*map, bounds);
    if (!found) return ground;
    ground = found->extent;
  } else {
    ground = {bounds.west, bounds.south, bounds.east, bounds.north};
  }
  if (ground.east - ground.west >= 360.0) return {-180.0, ground.south, 180.0, ground.north};
  return {std::remainder(ground.west, 360.0), ground.south, std::remainder(ground.east, 360.0), ground.north};
}

void understand_projection(const SourceInfo& info, const ReferenceMap* source_map, ProjectionRequest& request) {
  try {
    ProjectionSpec& spec = request.system_map;
    spec.kind = ProjectionKind::kSystem;
    const ReferenceSystem& own = info.georeference.system;
    if (own.semi_major_axis_m) {
      spec.ellipsoid = ellipsoid_of(own);
    } else if (source_map != nullptr) {
      spec.ellipsoid = source_map->ellipsoid();
    }
    const SystemOnBody on = on_body_of(own, spec.ellipsoid, request.system);
    request.system_body = on.body;
    const WayToSystem way = find_way(own, on.text, rough_ground(info, source_map), spec.ellipsoid);
    spec.system = way.system;
    if (!way.is_projected) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("\"{}\" counts degrees and is no map; `projection` none leaves degrees as they are",
                              spec.system.name));
    }
    spec.map = understand_way(spec.system, spec.ellipsoid);
    if (way.is_ballpark) request.system_note = info.path + ": " + ballpark_note("its datum", way);
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("{}: `projection`: {}", info.path, error.what()));
  }
}

void understand_source_map(const SourceInfo& info, GroundRequest& request) {
  const Georeference& place = info.georeference;
  const std::string text = system_text(place.system);
  if (place.unit != HorizontalUnit::kMetre || !place.has_origin || text.empty()) return;
  try {
    request.source_map = understand_map(text, place.metres_per_unit);
  } catch (const Error& error) {
    request.why_no_map = error.what();
  }
}

}  // namespace

void understand_ground(const SourceInfo& info, GroundRequest& request) {
  understand_source_map(info, request);
  ProjectionRequest& projection = request.projection;
  if (projection.kind != ProjectionKind::kSystem) return;
  // Without a place of its own the input is refused later, with the remedy.
  if (!info.georeference.has_origin || info.georeference.unit == HorizontalUnit::kUnknown) return;
  if (info.georeference.unit == HorizontalUnit::kMetre && !request.source_map) return;
  understand_projection(info, request.source_map.get(), projection);
}

}  // namespace isohf
