#include "formats/text_grids/fortran_fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "formats/text_grids/text_tokens.h"

namespace isohf {

std::string_view trimmed(std::string_view field) {
  field.remove_prefix(std::min(field.find_first_not_of(' '), field.size()));
  return field.substr(0, field.find_last_not_of(' ') + 1);
}

std::optional<double> fortran_number(std::string_view field) {
  std::string text(trimmed(field));
  for (char& c : text) c = c == 'D' || c == 'd' ? 'E' : c;
  double value = 0.0;
  if (text.empty() || !read_decimal(text, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> whole_number(std::string_view field) {
  const std::string_view text = trimmed(field);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace isohf
