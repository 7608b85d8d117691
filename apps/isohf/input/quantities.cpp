#include "input/quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "formats/georeference/units.h"
#include "isohf/error.h"
#include "options/option_values.h"

namespace isohf::cli {

LengthValue parse_length(const std::string& text) {
  // An 'e' before a digit or a sign belongs to the number.
  std::size_t end = 0;
  while (end < text.size() && (std::string_view("+-.0123456789").find(text[end]) != std::string_view::npos ||
                               ((text[end] == 'e' || text[end] == 'E') && end + 1 < text.size() &&
                                std::string_view("+-0123456789").find(text[end + 1]) != std::string_view::npos))) {
    ++end;
  }
  LengthValue length;
  const std::size_t unit_at = text.find_first_not_of(' ', end);
  const bool is_plain = unit_at == std::string::npos;
  const auto unit = is_plain ? std::nullopt : linear_unit(std::string_view(text).substr(unit_at));
  if (!read_number(std::string_view(text).substr(0, end), length.value) || !(is_plain || unit) ||
      !std::isfinite(length.value) || length.value <= 0.0) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("found '{}', must be a number greater than 0, alone or with a unit: mm, cm, m, km, ft, "
                            "us-ft, yd, mi or nm (nautical miles)",
                            text));
  }
  if (unit) length = {length.value * unit->metres, true};
  return length;
}

double parse_ratio(const std::string& text) {
  const std::size_t slash = std::min(text.find('/'), text.size());
  double above = 0.0;
  double below = 1.0;
  const bool is_ratio = read_number(std::string_view(text).substr(0, slash), above) &&
                        (slash == text.size() || read_number(std::string_view(text).substr(slash + 1), below));
  const double ratio = above / below;
  if (!is_ratio || !(above > 0.0) || !(below > 0.0) || !std::isfinite(ratio) || ratio <= 0.0) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("found '{}', must be a number greater than 0 or a fraction as in 1/2", text));
  }
  return ratio;
}

}  // namespace isohf::cli
