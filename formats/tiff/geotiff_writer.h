#pragma once

#include <optional>
#include <string>

#include "formats/tiff/geotiff_keys.h"
#include "isohf/projection.h"

namespace isohf {

/// The GeoTIFF tags that place_from_geotiff reads as `georeference` (OGC GeoTIFF 1.1, 19-008r4): pixel scale, tie point
/// of the first sample (its corner where the samples are areas), model and raster type, EPSG codes, units, ellipsoid,
/// names and the vertical system. Empty for a georeference that says nothing.
/// Registration kUnknown is written as area: GeoTIFF knows no third kind. What has no EPSG code keeps its name,
/// ellipsoid and WKT, not the parameters of its projection.
/// projection   the map that the georeference is on: its method and parameters are written instead of a WKT
[[nodiscard]] GeoTags geotiff_tags(const Georeference& georeference, const std::optional<ProjectionSpec>& projection,
                                   double metres_per_vertical_unit, const std::string& vertical_unit);

}  // namespace isohf
