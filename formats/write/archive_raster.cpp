#include "formats/write/archive_raster.h"
#include "isohf/projection/length_unit.h"

namespace isohf {

RasterSpec spec_of(const Metadata& metadata, const SampleGrid& grid, const SampleMapping& mapping,
                   std::optional<double> nodata) {
  RasterSpec spec;
  spec.width = grid.width;
  spec.height = grid.height;
  spec.sample_type = mapping.type;
  spec.z_scale = mapping.z_scale;
  spec.z_offset = mapping.z_offset;
  spec.void_value = nodata;
  spec.describe = true;
  if (metadata.vertical_unit != "unknown") spec.vertical_unit = metadata.vertical_unit;
  if (const auto unit = linear_unit(spec.vertical_unit)) spec.metres_per_vertical_unit = unit->metres;
  spec.georeference = grid_georeference(metadata, grid);
  return spec;
}

}  // namespace isohf
