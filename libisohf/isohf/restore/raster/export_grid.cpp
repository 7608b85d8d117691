#include "isohf/restore/raster/export_grid.h"

#include <fmt/format.h>

#include <tuple>

#include "isohf/error.h"

namespace isohf {
namespace {

std::optional<double> spacing_in(const ExportGridRequest& request, const Metadata& metadata) {
  if (!request.spacing || !request.spacing_in_metres) return request.spacing;
  if (request.system && request.system->place.unit == HorizontalUnit::kDegree) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("`spacing` has a unit, and coordinates of \"{}\" are degrees; give a plain number of these",
                            request.system->place.system.name));
  }
  if (request.system) return *request.spacing / request.system->place.metres_per_unit;
  if (metadata.horizontal_unit == "metre") return request.spacing;
  throw Error(ErrorCode::kInvalidArgument,
              "`spacing` has a unit, but the archive's world units are not known; give a plain number of these");
}

}  // namespace

bool is_cut_in_source(const Metadata& metadata, const ExportGridRequest& request) {
  return is_warped(metadata) && !request.on_own_map && (!request.system || is_source_system(metadata, *request.system));
}

SampleGrid export_grid(const Metadata& metadata, const ExportGridRequest& request) {
  const std::optional<double> spacing = spacing_in(request, metadata);
  if (is_cut_in_source(metadata, request)) {
    try {
      return grid_of_source(metadata, {request.box, request.size, spacing, !request.system});
    } catch (const Error& error) {
      if (!request.box) throw;
      const MapBounds& box = *request.box;
      throw error.within(fmt::format("`bbox` {},{},{},{}", box.west, box.south, box.east, box.north));
    }
  }
  const WorldBounds ground = request.box ? world_bounds(metadata, *request.box, AcrossEnds::kGoesOn) : metadata.valid;
  if (request.system) return grid_in_system(metadata, ground, request.system, request.size, spacing);
  if (request.size || spacing) return grid_over(ground, samples_are_areas(metadata), request.size, spacing);
  const SampleGrid all = natural_grid(metadata);
  if (!request.box) return all;
  if (const std::optional<SampleGrid> part = part_of(all, ground)) return *part;
  throw Error(ErrorCode::kInvalidArgument, "`bbox` holds no sample of the source's grid; `size` or `spacing` would");
}

SampleGrid window_of(const SampleGrid& grid, std::int64_t column, std::int64_t row, const GridSize& size) {
  SampleGrid part = grid;
  std::tie(part.width, part.height) = size;
  part.first_x += static_cast<double>(column) * part.spacing_x;
  const double south = static_cast<double>(row) * part.spacing_z;
  part.first_z += part.goes_by_places() ? -south : south;  // northings, and world z
  return part;
}

void place_in_world(const SampleGrid& grid, std::optional<Georeference>& georeference) {
  if (georeference && georeference->has_origin) return;
  if (!georeference) georeference.emplace().registration = Registration::kPoint;
  georeference->has_origin = true;
  georeference->origin_x = grid.first_x * (georeference->spacing_x / grid.spacing_x);
  georeference->origin_y = -grid.first_z * (georeference->spacing_y / grid.spacing_z);
}

}  // namespace isohf
