#include "isohf/projection/length_unit.h"

#include <algorithm>
#include <array>

namespace isohf {
namespace {

struct UnitRow {
  int epsg = 0;
  const char* name = "";
  double metres = 1.0;
  std::array<std::string_view, 8> spellings = {};  // lower case
};

// EPSG dataset, table of units of measure; the US survey foot is 1200/3937 m by definition.
constexpr std::array<UnitRow, 10> kLengthUnits = {{
    {9001, "metre", 1.0, {"m", "metre", "meter", "metres", "meters", "mtr"}},
    {9002, "foot", 0.3048, {"ft", "foot", "feet", "international foot", "international feet", "foot_international"}},
    {9003,
     "US survey foot",
     1200.0 / 3937.0,
     {"ftus", "us-ft", "us_ft", "us survey foot", "us survey feet", "foot_us", "us_survey_foot", "us_survey_feet"}},
    {9036, "kilometre", 1000.0, {"km", "kilometre", "kilometer", "kilometres", "kilometers", ""}},
    {9030, "nautical mile", 1852.0, {"nm", "nautical mile", "nautical miles", "", "", ""}},
    {9093, "statute mile", 1609.344, {"mi", "statute mile", "mile", "miles", "", ""}},
    {9096, "yard", 0.9144, {"yd", "yard", "yards", "", "", ""}},
    {9014, "fathom", 1.8288, {"fathom", "fathoms", "", "", "", ""}},
    {1033, "centimetre", 0.01, {"cm", "centimetre", "centimeter", "centimetres", "centimeters", ""}},
    {1025, "millimetre", 0.001, {"mm", "millimetre", "millimeter", "millimetres", "millimeters", ""}},
}};

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::optional<LinearUnit> linear_unit(int epsg) {
  for (const UnitRow& row : kLengthUnits) {
    if (row.epsg == epsg) return LinearUnit{row.name, row.metres};
  }
  return std::nullopt;
}

std::optional<LinearUnit> linear_unit(std::string_view name) {
  if (name.empty()) return std::nullopt;
  const auto is_name = [&](std::string_view spelling) { return std::ranges::equal(spelling, name, {}, {}, lower); };
  for (const UnitRow& row : kLengthUnits) {
    if (std::ranges::any_of(row.spellings, is_name)) return LinearUnit{row.name, row.metres};
  }
  return std::nullopt;
}

std::string linear_unit_name(double metres) {
  const auto known = std::ranges::find(kLengthUnits, metres, &UnitRow::metres);
  return known == kLengthUnits.end() ? "unit" : known->name;
}

}  // namespace isohf
