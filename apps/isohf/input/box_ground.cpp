#include "input/box_ground.h"

#include <fmt/format.h>

#include <vector>

#include "formats/georeference/reference_system.h"
#include "input/source_place.h"
#include "isohf/error.h"
#include "isohf/projection/other_reading.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface.h"

namespace isohf::cli {
namespace {

std::string text_of(const MapBounds& box) {
  return fmt::format("{:.9g},{:.9g},{:.9g},{:.9g}", box.west, box.south, box.east, box.north);
}

/// A box that names no ground of an archive: what the archive covers, and what else the numbers may be.
Error outside(ArchiveReader& archive, const MapBounds& box) {
  std::string what = fmt::format("--bbox {} lies outside of what the archive covers", text_of(box));
  std::string remedy;
  const Georeference own = source_georeference(archive.metadata().source);
  if (const auto place = source_place(archive.metadata())) {
    what += fmt::format(", {} in {}", text_of(place->bounds), name_of(own));
    try {
      understand_source(archive);
    } catch (const Error&) {  // then the box may still be swapped
    }
    const WorldGeoreference places(archive.metadata());
    std::vector<PairReading> readings = {own_reading(place->bounds, own.unit == HorizontalUnit::kDegree)};
    if (places.has_geo() && places.has_source()) {
      const auto in_own = [&](GeoPoint at) { return places.source_from_world(places.world_from_geo(at)); };
      const WorldBounds& all = archive.metadata().valid;
      const GeoPoint middle = places.geo_from_world({(all.x0 + all.x1) / 2.0, (all.z0 + all.z1) / 2.0});
      add_geographic_readings(readings, own.system.body, middle, in_own);
    }
    if (const auto other = other_reading(box, place->bounds, readings)) {
      remedy = fmt::format("read as {} it is --bbox {}", other->words, text_of(other->bounds));
    }
  }
  return {ErrorCode::kInvalidArgument, {archive.path(), what, "", remedy}};
}

}  // namespace

WorldBounds ground_in_box(ArchiveReader& archive, const BoundingBox& box, AcrossEnds across) {
  const Metadata& metadata = archive.metadata();
  if (is_warped(metadata)) understand_source(archive);
  const MapBounds asked{box.west, box.south, box.east, box.north};
  const WorldBounds ground = [&] {
    try {
      return world_bounds(metadata, asked, across);
    } catch (const Error& error) {
      const auto place = source_place(metadata);
      if (place && (asked.north < place->bounds.south || asked.south > place->bounds.north)) {
        if (const Error why = outside(archive, asked); !why.parts().remedy.empty()) throw why;
      }
      throw error.within("--bbox " + text_of(asked));
    }
  }();
  const TileGrid& tiles = metadata.grid;
  if (!(ground.x0 < tiles.world_width() && ground.x1 > 0.0 && ground.z0 < tiles.world_height() && ground.z1 > 0.0)) {
    throw outside(archive, asked);
  }
  return ground;
}

}  // namespace isohf::cli
