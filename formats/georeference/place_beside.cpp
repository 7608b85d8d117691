#include "formats/georeference/place_beside.h"

#include <cmath>

#include "formats/georeference/auxiliary_metadata.h"
#include "formats/georeference/wkt.h"
#include "isohf/error.h"

namespace isohf {

void place_by(const WorldFile& world, std::int64_t rows, Georeference& place) {
  place.spacing_x = world.dx;
  place.spacing_y = std::abs(world.dy);
  place.has_origin = true;
  place.origin_x = world.x0;
  place.origin_y = world.y0 + (world.rows_from_south() ? static_cast<double>(rows - 1) * world.dy : 0.0);
}

bool has_reference_system(const Georeference& place) {
  return place.unit != HorizontalUnit::kUnknown || place.system.epsg || !place.system.wkt.empty();
}

void read_place_beside(SourceInfo& info, int band) {
  read_auxiliary_metadata(info, band);
  Georeference& place = info.georeference;
  if (!place.has_origin) {
    const std::optional<WorldFile> world = world_file_beside(info.path);
    if (!world) return;
    if (world->rows_from_south()) {
      throw Error(ErrorCode::kUnsupported, world->path + ": dy is positive; rows must run from North to South");
    }
    place_by(*world, info.height, place);
  }
  if (!has_reference_system(place)) read_prj_beside(info);
}

}  // namespace isohf
