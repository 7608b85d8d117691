#pragma once

#include <string>

#include "formats/tiff/geotiff_keys.h"

namespace isohf {

/// The tags of the GeoTIFF without samples that a JPEG 2000 file has in a box of its own (GeoJP2); empty where it has
/// none, or where the file is another one or damaged.
[[nodiscard]] GeoTags geojp2_tags(const std::string& path);

}  // namespace isohf
