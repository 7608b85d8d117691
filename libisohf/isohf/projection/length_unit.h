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

/// By the name or abbreviation that files use, in any case: "m", "Meters", "ft", "ftUS", ..., also several or a part of
/// one: "0.1 m", "1/10 m", "10 cm". nullopt for any other text.
[[nodiscard]] std::optional<LinearUnit> linear_unit(std::string_view name);

/// By its length, which databases give with 15 digits; called "unit" if it has no name.
[[nodiscard]] LinearUnit length_unit(double metres);

}  // namespace isohf
