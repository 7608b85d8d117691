#include "isohf/restore/ground_scale.h"

#include <GeographicLib/Geodesic.hpp>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "isohf/projection/length_unit.h"

namespace isohf {

GroundScale ground_scale(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  const bool in_metres = metadata.horizontal_unit == "metre";
  if (!in_metres && source.crs_unit != "degree") return {};
  const auto unit = linear_unit(metadata.vertical_unit);
  const double elevation = unit ? unit->metres : 1.0;
  if (in_metres || !source.origin_y) return {1.0, 1.0, elevation};
  const double degree = std::numbers::pi / 180.0;
  const double middle = *source.origin_y - 0.5 * static_cast<double>(source.height - 1) * source.crs_spacing_y;
  const double length = degree * source.semi_major_axis_m.value_or(Ellipsoid{}.semi_major_axis_m);
  return {length * std::max(std::cos(middle * degree), 0.01), length, elevation};
}

double ground_distance_m(const Metadata& metadata, GeoPoint from, GeoPoint to) {
  const SourceRecord& source = metadata.source;
  Ellipsoid ellipsoid;
  if (metadata.projection) {
    ellipsoid = metadata.projection->spec.ellipsoid;
  } else if (source.semi_major_axis_m) {
    ellipsoid = {*source.semi_major_axis_m, source.inverse_flattening.value_or(0.0)};
  }
  double metres = 0.0;
  GeographicLib::Geodesic(ellipsoid.semi_major_axis_m, ellipsoid.flattening())
      .Inverse(from.latitude, from.longitude, to.latitude, to.longitude, metres);
  return metres;
}

TileGrid scaled(const TileGrid& grid, GroundScale scale) {
  return TileGrid::make(grid.shape(), grid.tile_columns(), grid.tile_rows(), grid.extent_x() * scale.x,
                        grid.extent_z() * scale.z);
}

WorldBounds scaled(const WorldBounds& bounds, GroundScale scale) {
  return {bounds.x0 * scale.x, bounds.z0 * scale.z, bounds.x1 * scale.x, bounds.z1 * scale.z};
}

}  // namespace isohf
