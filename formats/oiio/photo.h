#pragma once

#include <memory>
#include <string>

#include "isohf/surface/photo/photo_source.h"

namespace isohf {

/// Opens a photo of the ground, in any format that OpenImageIO reads, through the module isohf_oiio.so: grey, RGB or
/// RGBA of 8 or 16 bits or floats, delivered as 8-bit sRGB. Floats that OpenImageIO calls linear are coded as sRGB, all
/// others are taken to be so. Four channels of which the fourth is no alpha lose it, with a warning. A georeference is
/// read by the native readers of GeoTIFF tags and world files (photo_place.h).
/// Throws Error naming the path: kIo (missing), kUnsupported (no module, unknown format, 2 or more than 4 channels),
/// kCorrupt.
[[nodiscard]] std::unique_ptr<PhotoSource> open_photo(const std::string& path);

}  // namespace isohf
