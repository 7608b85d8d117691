#include "input/box_ground.h"

#include <fmt/format.h>

#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface.h"

namespace isohf::cli {

WorldBounds ground_in_box(ArchiveReader& archive, const BoundingBox& box, AcrossEnds across) {
  const Metadata& metadata = archive.metadata();
  if (is_warped(metadata)) understand_source(archive);
  const WorldBounds ground = [&] {
    try {
      return world_bounds(metadata, {box.west, box.south, box.east, box.north}, across);
    } catch (const Error& error) {
      throw error.within(fmt::format("--bbox {},{},{},{}", box.west, box.south, box.east, box.north));
    }
  }();
  const TileGrid& tiles = metadata.grid;
  if (!(ground.x0 < tiles.world_width() && ground.x1 > 0.0 && ground.z0 < tiles.world_height() && ground.z1 > 0.0)) {
    throw Error(ErrorCode::kInvalidArgument, archive.path() + ": --bbox lies outside of what the archive covers");
  }
  return ground;
}

}  // namespace isohf::cli
