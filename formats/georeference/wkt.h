#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/georeference/map_wkt.h"
#include "isohf/raster.h"

namespace isohf {

/// What a system is called that its longitudes and latitudes are on; empty where a WKT does not say it.
struct DatumNames {
  std::string geographic;
  std::string datum;
  std::string ellipsoid;
  std::string meridian;
};
[[nodiscard]] DatumNames datum_names(std::string_view wkt);

/// An equidistant cylindrical or polar stereographic map, whose WKT 1 GDAL takes for another method of the same places.
struct KeyedMap {
  int method = 0;  ///< EPSG's code: 1028 or 9810
  DatumNames names;
  double semi_major_axis_m = 0.0;
  double inverse_flattening = 0.0;
  MapParameters parameters;
};
/// nullopt where a WKT does not say, by the code of its method, that it is one.
[[nodiscard]] std::optional<KeyedMap> keyed_map(std::string_view wkt);

}  // namespace isohf
