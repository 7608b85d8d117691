#include "formats/io/option_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/io/raw_file.h"
#include "isohf/base/output_file.h"
#include "isohf/base/text/number_text.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"

namespace isohf {

std::string system_from(const std::string& text) {
  constexpr std::size_t kMostBytes = 65536;
  if (text.empty())
    throw Error(ErrorCode::kInvalidArgument, "found '', must be EPSG:2154, WKT, a PROJ string or a file");
  if (!is_file(text)) {
    const std::string extension = extension_of(text);
    if (extension != ".prj" && extension != ".wkt" && extension != ".txt") return text;
    throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', no such file");
  }
  const std::vector<std::byte> bytes = head_of_file(text, kMostBytes);
  std::string held(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  held.erase(held.find_last_not_of(" \t\r\n") + 1);
  if (held.empty() || held.find('\0') != held.npos) {
    throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', a file that must hold WKT or a PROJ string");
  }
  return held;
}

LengthValue parse_length(const std::string& text) {
  LengthValue length;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, length.value);
  const std::string_view unit_name(std::find_if(rest, end, [](char c) { return c != ' '; }), end);
  const bool is_name = !unit_name.empty() && unit_name.find_first_of("0123456789") == std::string_view::npos;
  const auto unit = is_name ? linear_unit(unit_name) : std::nullopt;
  if (error != std::errc() || !(unit_name.empty() || unit) || !std::isfinite(length.value) || length.value <= 0.0) {
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
  const std::optional<double> above = number_from(std::string_view(text).substr(0, slash));
  const std::optional<double> below =
      slash == text.size() ? 1.0 : number_from(std::string_view(text).substr(slash + 1));
  if (!above || !below || *above <= 0.0 || *below <= 0.0 || !std::isnormal(*above / *below)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("found '{}', must be a number greater than 0 or a fraction as in 1/2", text));
  }
  return *above / *below;
}

std::string with_plain_numbers(const std::string& text) {
  std::string plain;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find_first_of(",:", from), text.size());
    const std::string word = text.substr(from, to - from);
    const std::optional<double> number = number_from(word);  // nullopt with a unit
    plain += (number && std::isfinite(*number) ? fmt::format("{}", *number) : word) + text.substr(to, 1);
    from = to + 1;
  }
  return plain;
}

}  // namespace isohf
