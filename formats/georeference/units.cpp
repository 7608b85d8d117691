#include "formats/georeference/units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "formats/io/text.h"

namespace isohf {
namespace {

struct UnitRow {
  int epsg = 0;
  const char* name = "";
  double metres = 1.0;
  std::array<std::string_view, 8> spellings = {};  // lower case
};

// EPSG dataset, table of units of measure; the US survey foot is 1200/3937 m by definition.
constexpr std::array<UnitRow, 10> kUnits = {{
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

struct BodyRow {
  const char* name;
  double smallest_m;  // bounds of the semi-major axis; 0, 0 where the size says nothing
  double largest_m;
};

constexpr std::array<BodyRow, 19> kBodies = {{
    {"Earth", 6.35e6, 6.38e6},
    {"Mars", 3.3895e6, 3.3985e6},
    {"Moon", 1.7370e6, 1.7385e6},
    {"Mercury", 2.4390e6, 2.4410e6},
    {"Venus", 6.0510e6, 6.0525e6},
    {"Phobos", 0.0, 0.0},
    {"Deimos", 0.0, 0.0},
    {"Ceres", 0.0, 0.0},
    {"Vesta", 0.0, 0.0},
    {"Europa", 0.0, 0.0},
    {"Ganymede", 2.6310e6, 2.6330e6},
    {"Callisto", 2.4095e6, 2.4105e6},
    {"Titan", 2.5745e6, 2.5760e6},
    {"Enceladus", 0.0, 0.0},
    {"Triton", 0.0, 0.0},
    {"Pluto", 0.0, 0.0},
    {"Charon", 0.0, 0.0},
    {"Bennu", 0.0, 0.0},
    {"Ryugu", 0.0, 0.0},
}};

/// Whether `word` stands in `text` as a word of its own: "Mars_2000" and "GCS Mars" yes, "marsh" no.
bool has_word(const std::string& text, const std::string& word) {
  const auto is_letter = [&](std::size_t i) {
    return i < text.size() && std::isalpha(static_cast<unsigned char>(text[i])) != 0;
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if ((at == 0 || !is_letter(at - 1)) && !is_letter(at + word.size())) return true;
  }
  return false;
}

}  // namespace

std::optional<LinearUnit> linear_unit(int epsg) {
  for (const UnitRow& row : kUnits) {
    if (row.epsg == epsg) return LinearUnit{row.name, row.metres};
  }
  return std::nullopt;
}

std::optional<LinearUnit> linear_unit(std::string_view name) {
  const std::string wanted = lower_case(name);
  if (wanted.empty()) return std::nullopt;
  for (const UnitRow& row : kUnits) {
    if (std::find(row.spellings.begin(), row.spellings.end(), wanted) != row.spellings.end()) {
      return LinearUnit{row.name, row.metres};
    }
  }
  return std::nullopt;
}

std::string linear_unit_name(double metres) {
  const auto known = std::ranges::find(kUnits, metres, &UnitRow::metres);
  return known == kUnits.end() ? "unit" : known->name;
}

double world_per_elevation(const Metadata& metadata) {
  if (metadata.horizontal_unit != "metre" && metadata.source.crs_unit != "degree") return 1.0;
  const auto unit = linear_unit(metadata.vertical_unit);
  return unit ? unit->metres : 1.0;
}

std::string gdal_unit(const std::string& name, bool has_vertical_code) {
  const bool is_short = !has_vertical_code && (name == "metre" || name == "foot");
  return is_short ? (name == "metre" ? "m" : "ft") : name;
}

ReferenceSystem wgs84_system() {
  ReferenceSystem system;
  system.name = "WGS 84";
  system.epsg = 4326;
  system.body = "Earth";
  system.semi_major_axis_m = 6378137.0;
  system.inverse_flattening = 298.257223563;
  return system;
}

ReferenceSystem wgs84_utm_zone(int zone, bool is_south) {
  ReferenceSystem system = wgs84_system();
  system.epsg = (is_south ? 32700 : 32600) + zone;
  system.name = fmt::format("WGS 84 / UTM zone {}{}", zone, is_south ? 'S' : 'N');
  return system;
}

std::string body_of(std::string_view name, std::optional<double> semi_major_axis_m) {
  const std::string text = lower_case(name);
  for (const BodyRow& body : kBodies) {
    if (has_word(text, lower_case(body.name))) return body.name;
  }
  if (has_word(text, "lunar")) return "Moon";
  if (!semi_major_axis_m || !(*semi_major_axis_m > 0.0)) return {};
  for (const BodyRow& body : kBodies) {
    if (*semi_major_axis_m >= body.smallest_m && *semi_major_axis_m <= body.largest_m) return body.name;
  }
  return {};
}

}  // namespace isohf
