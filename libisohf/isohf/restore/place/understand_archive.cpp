#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/crs_operation.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/surface.h"

namespace isohf {
namespace {

/// is_ballpark  their datums are taken for one
bool is_system_of(const Georeference& own, const Georeference& other, bool is_ballpark) {
  if (!own.has_origin || own.unit != other.unit) return false;
  const auto same = are_same(own.system, other.system);
  if (same && (*same || !is_ballpark)) return *same;
  // Longitudes and latitudes of a body that names no system are known by its ellipsoid.
  return own.unit == HorizontalUnit::kDegree && own.system.semi_major_axis_m &&
         own.system.semi_major_axis_m == other.system.semi_major_axis_m &&
         own.system.inverse_flattening.value_or(0.0) == other.system.inverse_flattening.value_or(0.0);
}

}  // namespace

void understand_source(ArchiveReader& archive) {
  understand_world(archive);
  const SourceRecord& source = archive.metadata().source;
  const Georeference own = source_georeference(source);
  if (source.map || own.unit != HorizontalUnit::kMetre) return;
  const std::string text = system_text(own.system);
  if (text.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                archive.path() + ": names no reference system: it cannot be told where its metres lie");
  }
  try {
    archive.set_source_map(understand_map(text, source.metres_per_unit));
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

std::shared_ptr<const GridSystem> understand_grid_system(ArchiveReader& archive, const std::string& text,
                                                         std::vector<Warning>& warnings) {
  understand_source(archive);
  const Metadata& metadata = archive.metadata();
  const WorldGeoreference places(metadata);
  if (!places.has_geo()) {
    throw Error(ErrorCode::kInvalidArgument,
                archive.path() + ": does not say where it lies: it has no place in another reference system");
  }
  // The middle of each side and the corners: what the choice among datum shifts goes by.
  GeoExtent ground{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const double u : {0.0, 0.5, 1.0}) {
    for (const double v : {0.0, 0.5, 1.0}) {
      const WorldBounds& all = metadata.valid;
      const GeoPoint at = places.geo_from_world({all.x0 + u * (all.x1 - all.x0), all.z0 + v * (all.z1 - all.z0)});
      if (!std::isfinite(at.longitude)) continue;
      ground = {std::min(ground.west, at.longitude), std::min(ground.south, at.latitude),
                std::max(ground.east, at.longitude), std::max(ground.north, at.latitude)};
    }
  }
  if (!(ground.west <= ground.east)) ground = {-180.0, -90.0, 180.0, 90.0};
  const Georeference own = source_georeference(metadata.source);
  const Ellipsoid ellipsoid = ellipsoid_of(own.system);
  try {
    const SystemOnBody on = on_body_of(own.system, ellipsoid, text);
    const WayToSystem way = find_way(own.system, on.text, ground, ellipsoid);
    SourceInfo there;
    take_system(on.text, there);
    if (way.is_ballpark) warnings.push_back(loss(archive.path() + ": " + ballpark_note("its datum", way)));
    auto system = std::make_shared<GridSystem>(GridSystem{way.map, there.georeference});
    const auto natural = grid_georeference(metadata, natural_grid(metadata));
    for (const Georeference& known : {natural.value_or(own), own}) {
      if (system->place.has_origin || !is_system_of(known, there.georeference, way.is_ballpark)) continue;
      system->place = known;
      system->place.system = there.georeference.system;
    }
    // The heights stay the archive's own.
    system->place.system.vertical_datum.clear();
    system->place.system.vertical_epsg.reset();
    return system;
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

void understand_world(ArchiveReader& archive) {
  const auto& projection = archive.metadata().projection;
  if (!projection || projection->spec.kind != ProjectionKind::kSystem || projection->spec.map) return;
  try {
    archive.set_world_map(understand_way(projection->spec.system, projection->spec.ellipsoid));
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

}  // namespace isohf
