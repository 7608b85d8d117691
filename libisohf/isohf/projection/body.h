#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "isohf/projection.h"
#include "isohf/raster.h"

namespace isohf {

/// The planet or moon that a reference system's name (or, failing that, its semi-major axis) belongs to; else empty.
/// Axes: reports of the IAU working group on cartographic coordinates; anything from 6.35e6 m to 6.38e6 m is the Earth.
[[nodiscard]] std::string body_of(std::string_view name, std::optional<double> semi_major_axis_m);

/// The ellipsoid that a system states; WGS 84's where it states none.
[[nodiscard]] Ellipsoid ellipsoid_of(const ReferenceSystem& system);

}  // namespace isohf
