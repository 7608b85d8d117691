#include "input/box_ground.h"

#include <fmt/format.h>

#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/restore/place/archive_coordinates.h"
#include "isohf/restore/place/source_place.h"
#include "isohf/surface.h"

namespace isohf::cli {
namespace {

std::string text_of(const MapBounds& box) {
  return fmt::format("{:.9g},{:.9g},{:.9g},{:.9g}", box.west, box.south, box.east, box.north);
}

std::string remedy(const std::optional<OtherReading>& other) {
  return other ? fmt::format("read as {} it is --bbox {}", other->words, text_of(other->bounds)) : "";
}

bool is_smaller_than_a_sample(const WorldBounds& ground, const SourceRecord& source) {
  return ground.x1 - ground.x0 < source.spacing_x && ground.z1 - ground.z0 < source.spacing_z;
}

}  // namespace

WorldBounds ground_in_box(ArchiveReader& archive, const BoundingBox& box, AcrossEnds across) {
  const Metadata& metadata = archive.metadata();
  if (is_warped(metadata)) understand_source(archive);
  const MapBounds asked{box.west, box.south, box.east, box.north};
  const std::string option = "--bbox " + text_of(asked);
  const TileGrid& tiles = metadata.grid;
  std::optional<Error> why;
  std::optional<WorldBounds> found;
  try {
    found = world_bounds(metadata, asked, across);
  } catch (const Error& error) {
    why = error.within(option);
  }
  if (found) {
    const WorldBounds& ground = *found;
    if (ground.x0 < tiles.world_width() && ground.x1 > 0.0 && ground.z0 < tiles.world_height() && ground.z1 > 0.0) {
      if (is_smaller_than_a_sample(ground, metadata.source)) {
        if (const auto other = other_reading_of(archive, asked)) {
          throw Error(ErrorCode::kInvalidArgument,
                      {archive.path(), option + " is smaller than a sample of the source", "", remedy(other)});
        }
      }
      return ground;
    }
  }
  const auto place = source_place(metadata);
  const bool is_beyond = place && (asked.north < place->bounds.south || asked.south > place->bounds.north);
  if (why && !is_beyond) throw *why;
  const auto other = other_reading_of(archive, asked);
  if (why && !other) throw *why;
  std::string what = option + " lies outside of what the archive covers";
  if (place) what += fmt::format(", {} in {}", text_of(place->bounds), name_of(source_georeference(metadata.source)));
  throw Error(ErrorCode::kInvalidArgument, {archive.path(), what, "", remedy(other)});
}

}  // namespace isohf::cli
