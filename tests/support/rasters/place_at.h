#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "isohf/raster.h"

namespace isohf::test {

/// Samples `spacing` apart, the first one at x, y.
inline Georeference place_at(Registration registration, HorizontalUnit unit, double x, double y, double spacing,
                             std::optional<int> epsg = {}) {
  Georeference place;
  place.registration = registration;
  place.unit = unit;
  place.spacing_x = place.spacing_y = spacing;
  place.has_origin = true;
  place.origin_x = x;
  place.origin_y = y;
  place.system.epsg = epsg;
  return place;
}

/// x and y of the first sample; NaN where they are not known.
inline std::vector<double> origin_of(const Georeference& place) {
  if (!place.has_origin) return {std::nan(""), std::nan("")};
  return {place.origin_x, place.origin_y};
}

/// The same, and the spacings along x and y.
inline std::vector<double> grid_of(const Georeference& place) {
  std::vector<double> grid = origin_of(place);
  grid.insert(grid.end(), {place.spacing_x, place.spacing_y});
  return grid;
}

}  // namespace isohf::test
