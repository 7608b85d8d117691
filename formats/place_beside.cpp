#include "formats/place_beside.h"

#include <cmath>

#include "formats/wkt.h"
#include "isohf/base/error.h"

namespace isohf {

void place_by(const WorldFile& world, std::int64_t rows, Georeference& place) {
  place.spacing_x = world.dx;
  place.spacing_y = std::abs(world.dy);
  place.has_origin = true;
  place.origin_x = world.x0;
  place.origin_y = world.y0 + (world.rows_from_south() ? static_cast<double>(rows - 1) * world.dy : 0.0);
}

void read_place_beside(SourceInfo& info) {
  const std::optional<WorldFile> world = world_file_beside(info.path);
  if (!world) return;
  if (world->rows_from_south()) {
    throw Error(ErrorCode::kUnsupported, world->path + ": dy is positive; rows must run from North to South");
  }
  place_by(*world, info.height, info.georeference);
  read_prj_beside(info);
}

}  // namespace isohf
