#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace isohf {

/// Numbers in records of fixed columns, as Fortran programs write them: blanks around them mean nothing.

/// The field without the blanks around it.
[[nodiscard]] std::string_view trimmed(std::string_view field);
/// A finite number, whose exponent is a D as often as an E; nullopt where the field holds none.
[[nodiscard]] std::optional<double> fortran_number(std::string_view field);
/// A whole number; nullopt where the field holds none.
[[nodiscard]] std::optional<std::int64_t> whole_number(std::string_view field);

}  // namespace isohf
