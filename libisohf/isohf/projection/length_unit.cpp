#include "isohf/projection/length_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

namespace isohf {
namespace {

struct UnitRow {
  const char* name = "";
  double metres = 1.0;
  std::array<std::string_view, 8> spellings = {};  // lower case
};

// EPSG dataset, table of units of measure; the US survey foot is 1200/3937 m by definition.
constexpr std::array<UnitRow, 15> kLengthUnits = {{
    {"metre", 1.0, {"m", "metre", "meter", "metres", "meters", "mtr"}},
    {"foot", 0.3048, {"ft", "foot", "feet", "international foot", "international feet", "foot_international"}},
    {"US survey foot",
     1200.0 / 3937.0,
     {"ftus", "us-ft", "us_ft", "us survey foot", "us survey feet", "foot_us", "us_survey_foot", "us_survey_feet"}},
    {"kilometre", 1000.0, {"km", "kilometre", "kilometer", "kilometres", "kilometers"}},
    {"hectometre", 100.0, {"hm", "hectometre", "hectometer", "hectometres", "hectometers"}},
    {"decametre", 10.0, {"dam", "decametre", "decameter", "decametres", "decameters", "dekameter", "dekameters"}},
    {"decimetre", 0.1, {"dm", "decimetre", "decimeter", "decimetres", "decimeters"}},
    {"centimetre", 0.01, {"cm", "centimetre", "centimeter", "centimetres", "centimeters"}},
    {"millimetre", 0.001, {"mm", "millimetre", "millimeter", "millimetres", "millimeters"}},
    {"nautical mile", 1852.0, {"nm", "nmi", "nautical mile", "nautical miles", "nautical_mile"}},
    {"statute mile", 1609.344, {"mi", "statute mile", "mile", "miles", "statute_mile"}},
    {"yard", 0.9144, {"yd", "yard", "yards", "international yard"}},
    {"inch", 0.0254, {"in", "inch", "inches", "international inch"}},
    {"fathom", 1.8288, {"fathom", "fathoms", "ftm", "fm"}},
    {"Clarke's foot", 0.3047972654, {"clarke's foot", "clarke foot", "foot_clarke"}},
}};

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Takes a number at the begin of a text, and the blanks after it.
std::optional<double> take_number(std::string_view& text) {
  double number = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc() || !std::isfinite(number) || number <= 0.0) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  text.remove_prefix(std::min(text.find_first_not_of(" *"), text.size()));
  return number;
}

}  // namespace

std::optional<LinearUnit> linear_unit(std::string_view name) {
  if (name.empty()) return std::nullopt;
  const auto is_name = [&](std::string_view spelling) { return std::ranges::equal(spelling, name, {}, {}, lower); };
  for (const UnitRow& row : kLengthUnits) {
    if (std::ranges::any_of(row.spellings, is_name) || name == row.name) return LinearUnit{row.name, row.metres};
  }
  // Some of another unit: "0.1 m", "1/10 m".
  std::optional<double> factor = take_number(name);
  if (factor && name.starts_with('/')) {
    name.remove_prefix(1);
    const std::optional<double> divisor = take_number(name);
    factor = divisor ? std::optional(*factor / *divisor) : std::nullopt;
  }
  const std::optional<LinearUnit> unit = factor ? linear_unit(name) : std::nullopt;
  if (!unit) return std::nullopt;
  LinearUnit found = length_unit(*factor * unit->metres);
  if (found.name == "unit") found.name = fmt::format("{} {}", *factor, unit->name);
  return found;
}

LinearUnit length_unit(double metres) {
  constexpr double kSame = 1e-13;
  const auto is_same = [&](const UnitRow& row) { return std::abs(row.metres / metres - 1.0) < kSame; };
  const auto* const known = std::ranges::find_if(kLengthUnits, is_same);
  return known == kLengthUnits.end() ? LinearUnit{"unit", metres} : LinearUnit{known->name, known->metres};
}

}  // namespace isohf
