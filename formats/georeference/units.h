#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "isohf/projection/length_unit.h"
#include "isohf/raster.h"

namespace isohf {

/// What GDAL calls the unit of a band's heights that linear_unit() has named: "m", "ft", else the name; where a code says what
/// heights are above, by that system's.
[[nodiscard]] std::string gdal_unit(const std::string& name, bool has_vertical_code);

/// WGS 84 in degrees, on the Earth.
[[nodiscard]] ReferenceSystem wgs84_system();
/// A zone of UTM on it, 1 to 60.
[[nodiscard]] ReferenceSystem wgs84_utm_zone(int zone, bool is_south);

/// The planet or moon that a reference system's name (or, failing that, its semi-major axis) belongs to; else empty.
/// Axes: reports of the IAU working group on cartographic coordinates; anything from 6.35e6 m to 6.38e6 m is the Earth.
[[nodiscard]] std::string body_of(std::string_view name, std::optional<double> semi_major_axis_m);

}  // namespace isohf
