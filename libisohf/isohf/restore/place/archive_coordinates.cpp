#include "isohf/restore/place/archive_coordinates.h"

#include <memory>

#include "isohf/restore/place/source_place.h"
#include "isohf/surface.h"

namespace isohf {

Coordinates coordinates_in(const std::string& system, ArchiveReader& archive, std::vector<Warning>& warnings) {
  if (system == "world") {
    return {[](WorldPoint at) {
              return MapPoint{at.x, at.z};
            },
            [](MapPoint at) {
              return WorldPoint{at.easting, at.northing};
            }};
  }
  if (system != "crs" && system != "lonlat") {
    const std::shared_ptr<const GridSystem> there = understand_grid_system(archive, system, warnings);
    const WorldGeoreference places(archive.metadata());
    return {[=](WorldPoint at) { return there->map->map_from_geo(places.geo_from_world(at)); },
            [=](MapPoint at) { return places.world_from_geo(there->map->geo_from_map(at)); }};
  }
  const bool in_degrees = system == "lonlat";
  const auto known_places = [&] {
    const WorldGeoreference places(archive.metadata());
    return (in_degrees ? places.has_geo() : places.has_source()) ? std::optional(places) : std::nullopt;
  };
  std::optional<WorldGeoreference> known = known_places();
  if (!known) {
    understand_source(archive);
    known = known_places();
  }
  if (!known) {
    throw Error(ErrorCode::kInvalidArgument, archive.path() + ": its input has no known " +
                                                 (in_degrees ? "longitudes and latitudes" : "coordinates") +
                                                 "; give places in world units");
  }
  const WorldGeoreference places = *known;
  if (!in_degrees) {
    return {[=](WorldPoint at) { return places.source_from_world(at); },
            [=](MapPoint at) { return places.world_from_source(at); }};
  }
  return {[=](WorldPoint at) {
            const GeoPoint there = places.geo_from_world(at);
            return MapPoint{there.longitude, there.latitude};
          },
          [=](MapPoint at) {
            return places.world_from_geo({at.easting, at.northing});
          }};
}

std::optional<OtherReading> other_reading_of(ArchiveReader& archive, const MapBounds& asked,
                                             const std::optional<PairReading>& first) {
  const auto place = source_place(archive.metadata());
  if (!place) return std::nullopt;
  try {
    understand_source(archive);
  } catch (const Error&) {  // then they may still be swapped
  }
  const WorldGeoreference places(archive.metadata());
  const Georeference own = source_georeference(archive.metadata().source);
  std::vector<PairReading> readings;
  if (first) readings.push_back(*first);
  readings.push_back(own_reading(place->bounds, own.unit == HorizontalUnit::kDegree));
  if (places.has_geo() && places.has_source()) {
    const WorldBounds& all = archive.metadata().valid;
    const GeoPoint middle = places.geo_from_world({(all.x0 + all.x1) / 2.0, (all.z0 + all.z1) / 2.0});
    add_geographic_readings(readings, own.system.body, middle,
                            [&](GeoPoint at) { return places.source_from_world(places.world_from_geo(at)); });
  }
  return other_reading(asked, place->bounds, readings);
}

}  // namespace isohf
