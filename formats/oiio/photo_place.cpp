#include "formats/oiio/photo_place.h"

#include <array>

#include "formats/files/raw_file.h"
#include "formats/georeference/files_beside.h"
#include "formats/readers.h"
#include "formats/tiff/geotiff_keys.h"
#include "formats/tiff/tiff_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

[[noreturn]] void refuse_south_up() {
  throw Error(ErrorCode::kUnsupported, "its rows run from South to North; turn it first");
}

/// The place that the tags of a TIFF file give; nullopt for other files and for tags without one.
std::optional<Georeference> place_from_tags(const std::string& path, std::int64_t rows) {
  const RawFile file(path);
  std::array<std::byte, 4> head{};
  if (file.read_some(0, head) != head.size() || !looks_like_tiff(head)) return std::nullopt;
  const GeoTiffPlace place = place_from_geotiff(open_main_image(file).handle->read_tags().geo, rows);
  if (!place.placed || !place.georeference.has_origin) return std::nullopt;
  if (place.rows_from_south) refuse_south_up();
  return place.georeference;
}

}  // namespace

std::optional<Georeference> photo_georeference(const std::string& path, std::int64_t rows) {
  std::optional<Georeference> place = place_from_tags(path, rows);
  if (!place) {
    const std::optional<WorldFile> world = world_file_beside(path);
    if (!world) return std::nullopt;
    if (world->rows_from_south()) refuse_south_up();
    place_by(*world, rows, place.emplace());
  }
  if (place->system.wkt.empty() && !place->system.epsg) place->system.wkt = prj_beside(path);
  return place;
}

}  // namespace isohf
