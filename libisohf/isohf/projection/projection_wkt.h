#pragma once

#include <optional>
#include <string>

#include "isohf/projection.h"

namespace isohf {

/// A projected reference system in OGC's well-known text, version 1, as GeoTIFF readers take it.
/// geographic_name   name of the system that the degrees were in; empty: "unknown"
[[nodiscard]] std::string projection_wkt(const ProjectionSpec& spec, const std::string& geographic_name);

/// EPSG code where the map is one of EPSG's: UTM zones on WGS 84, and reference systems that have one.
[[nodiscard]] std::optional<int> projection_epsg(const ProjectionSpec& spec, std::optional<int> geographic_epsg);

/// "lambert-conformal around longitude 10, true at latitudes 46.3 and 47.7": for people.
[[nodiscard]] std::string describe_projection(const ProjectionSpec& spec);

}  // namespace isohf
