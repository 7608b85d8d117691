#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// The GeoTIFF tags of one directory as stored (OGC 19-008r4); empty if absent.
struct GeoTags {
  std::vector<double> pixel_scale;       ///< ModelPixelScaleTag, 33550
  std::vector<double> tiepoints;         ///< ModelTiepointTag, 33922: i, j, k, x, y, z each
  std::vector<double> transformation;    ///< ModelTransformationTag, 34264: 4 x 4, row by row
  std::vector<std::uint16_t> directory;  ///< GeoKeyDirectoryTag, 34735
  std::vector<double> doubles;           ///< GeoDoubleParamsTag, 34736
  std::string ascii;                     ///< GeoAsciiParamsTag, 34737

  [[nodiscard]] bool empty() const {
    return pixel_scale.empty() && tiepoints.empty() && transformation.empty() && directory.empty();
  }
};

/// What GeoTIFF tags say about a raster.
struct GeoTiffPlace {
  Georeference georeference;     ///< origin: sample (0, 0) once the rows run from North to South
  bool rows_from_south = false;  ///< the stored rows run from South to North and must be turned
  std::string vertical_unit;
  double metres_per_vertical_unit = 1.0;
  double z_scale = 1.0;  ///< elevation = raw * z_scale + z_offset, by pixel scale and tie point in z
  double z_offset = 0.0;
  std::vector<Warning> warnings;
};

/// Interprets `tags` of a raster of `rows` stored rows through libgeotiff and PROJ. The tie point of a PixelIsArea raster
/// names a pixel's corner, of a PixelIsPoint raster the sample itself; the origin returned is the sample's position in
/// both. Angles become degrees. Malformed keys become warnings. Throws Error: kUnsupported for a rotated, sheared or
/// East-to-West raster, and what take_system() throws.
[[nodiscard]] GeoTiffPlace place_from_geotiff(const GeoTags& tags, std::int64_t rows);

/// The GeoTIFF tags that place_from_geotiff reads as `georeference` (OGC GeoTIFF 1.1, 19-008r4): pixel scale, tie point
/// of the first sample (its corner if the samples are areas), model and raster type, EPSG codes, units, ellipsoid,
/// names and the vertical system. Empty for a georeference that says nothing. Registration kUnknown is written as area:
/// GeoTIFF has no third kind. A map without an EPSG code is written as user-defined, with its WKT in a citation.
[[nodiscard]] GeoTags geotiff_tags(const Georeference& georeference, double metres_per_vertical_unit,
                                   const std::string& vertical_unit);

}  // namespace isohf
