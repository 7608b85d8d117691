#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace isohf {

/// The number that a text is, whole, with a decimal point whatever the locale; a plus sign may stand before it, and it
/// may be "nan" or "inf". nullopt for anything else, and beyond the range of a double.
[[nodiscard]] std::optional<double> number_from(std::string_view text);

/// A size as people read it: "999 bytes", "80.8 GB"; units are powers of 1000.
[[nodiscard]] std::string in_bytes(double bytes);

}  // namespace isohf
