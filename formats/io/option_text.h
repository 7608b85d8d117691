#pragma once

#include <string>

namespace isohf {

/// A reference system as it was typed: the text in a file of that name (a .prj), else the text itself. Throws
/// Error{kInvalidArgument} for an empty one, and for a file without text.
[[nodiscard]] std::string system_from(const std::string& text);

/// A horizontal length as it was typed.
struct LengthValue {
  double value = 0.0;      ///< > 0
  bool in_metres = false;  ///< a unit was given, and `value` is metres; else it is whatever the world's units are
};
/// "30", "30m", "0.5 km", "100ft", "us-ft", ...: a number greater than 0 and, if wanted, a unit of length. Throws
/// Error{kInvalidArgument} "found ..., must be ...".
[[nodiscard]] LengthValue parse_length(const std::string& text);

/// A positive number, or a fraction of two as in 1/2. Throws likewise.
[[nodiscard]] double parse_ratio(const std::string& text);

/// ".05" and "0.050" are one number, and so are they in a list or a range: such text with every number in one form.
[[nodiscard]] std::string with_plain_numbers(const std::string& text);

}  // namespace isohf
