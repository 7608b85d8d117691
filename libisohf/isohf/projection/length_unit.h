#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace isohf {

/// A unit of length.
struct LinearUnit {
  std::string name;     ///< "metre", "foot", "US survey foot", ...
  double metres = 1.0;  ///< metres in one unit
};

/// By EPSG unit code (9001 is the metre); nullopt for a code that isohf does not know.
[[nodiscard]] std::optional<LinearUnit> linear_unit(int epsg);

/// By the name or abbreviation that files use, in any case: "m", "Meters", "ft", "ftUS", ...; nullopt for any other
/// text.
[[nodiscard]] std::optional<LinearUnit> linear_unit(std::string_view name);

/// What a length of so many metres is called; "unit" where it has no name.
[[nodiscard]] std::string linear_unit_name(double metres);

}  // namespace isohf
