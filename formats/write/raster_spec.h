#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/raster.h"

namespace isohf {

/// What a new raster is. Georeference, scale, offset and unit go into TIFF and the .json beside raw samples and PNG;
/// grids have a place for the georeference, the other formats for nothing.
struct RasterSpec {
  std::int64_t width = 0;   ///< columns, >= 1
  std::int64_t height = 0;  ///< rows, >= 1
  SampleType sample_type = SampleType::kFloat32;
  int channels = 1;                  ///< 1 gray (Y), 3 RGB, 4 RGBA
  std::optional<double> void_value;  ///< raw value that means "no elevation"
  std::optional<Georeference> georeference;
  double z_scale = 1.0;  ///< elevation = raw * z_scale + z_offset, in vertical units
  double z_offset = 0.0;
  std::string vertical_unit;  ///< "metre", ...; empty where unknown
  double metres_per_vertical_unit = 1.0;
  bool describe = false;   ///< of PNG: write NAME.png.json beside it, which says what the numbers mean
  bool compress = true;    ///< TIFF, OpenEXR
  bool overwrite = false;  ///< replace a file of that name
  ScratchFolder scratch;   ///< for what is kept until it can be written, where memory is bounded
};

}  // namespace isohf
