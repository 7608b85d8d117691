#include "isohf/restore/place/source_place.h"

#include <cmath>

#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/surface.h"

namespace isohf {

std::optional<SourcePlace> source_place(const Georeference& place, std::int64_t width, std::int64_t height,
                                        Registration registration, const std::optional<MapGround>& stored) {
  if (!place.has_origin) return std::nullopt;
  const double margin = registration == Registration::kArea ? 0.5 : 0.0;
  SourcePlace found;
  found.bounds = {place.origin_x - margin * place.spacing_x,
                  place.origin_y - (static_cast<double>(height - 1) + margin) * place.spacing_y,
                  place.origin_x + (static_cast<double>(width - 1) + margin) * place.spacing_x,
                  place.origin_y + margin * place.spacing_y};
  const MapBounds& bounds = found.bounds;
  if (place.unit == HorizontalUnit::kDegree) {
    found.ground.emplace();
    found.ground->extent = {bounds.west, bounds.south, bounds.east, bounds.north};
    found.ground->centre = {std::remainder(bounds.middle().easting, 360.0), bounds.middle().northing};
    return found;
  }
  found.has_map_scale = true;
  found.ground = stored;
  const std::string text = system_text(place.system);
  if (stored || place.unit != HorizontalUnit::kMetre || text.empty()) return found;
  try {
    found.ground = ground_under(*understand_map(text, place.metres_per_unit), bounds);
    if (!found.ground) found.why_no_ground = "the reference system shows no place there";
  } catch (const Error& error) {
    found.why_no_ground = error.what();
  }
  return found;
}

std::optional<SourcePlace> source_place(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  if (!is_warped(metadata)) {
    const SampleGrid grid = natural_grid(metadata);
    if (grid.width < source.width || grid.height < source.height) {
      const auto there = grid_georeference(metadata, grid);
      return there ? source_place(*there, grid.width, grid.height, source.registration) : std::nullopt;
    }
  }
  Georeference place = source_georeference(source);
  place.has_origin = place.has_origin && source.crs_spacing_x > 0.0 && source.crs_spacing_y > 0.0;
  return source_place(place, source.width, source.height, source.registration, source.ground);
}

}  // namespace isohf
