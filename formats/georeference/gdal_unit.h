#pragma once

#include <string>

namespace isohf {

/// What GDAL calls the unit of a band's heights that linear_unit() has named: "m", "ft", else the name; where a code
/// says what heights are above, by that system's.
[[nodiscard]] inline std::string gdal_unit(const std::string& name, bool has_vertical_code) {
  if (has_vertical_code) return name;
  return name == "metre" ? "m" : name == "foot" ? "ft" : name;
}

}  // namespace isohf
