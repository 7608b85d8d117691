#pragma once

#include <optional>

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

}  // namespace isohf::test
