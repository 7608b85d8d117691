#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// The georeference of a picture of `rows` rows: GeoTIFF tags, else a world file beside it (.tfw, .jgw, .pgw, .wld,
/// ...) with the reference system of a .prj; nullopt where there is neither. The origin is the middle of pixel (0, 0).
/// Throws Error: kCorrupt where it cannot be read, kUnsupported where the picture is rotated or its rows run from South
/// to North.
[[nodiscard]] std::optional<Georeference> photo_georeference(const std::string& path, std::int64_t rows);

}  // namespace isohf
