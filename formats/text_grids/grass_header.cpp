#include "formats/text_grids/grass_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "formats/files/letter_case.h"
#include "formats/text_grids/text_tokens.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::array<std::string_view, 9> kNameTexts = {"north", "south", "east", "west",      "rows",
                                                        "cols",  "null",  "type", "multiplier"};

/// "45:30:00.5N" in degrees, South and West negative; false where the text is none.
bool read_degrees(std::string_view text, double& degrees) {
  double sign = 1.0;
  if (!text.empty() && std::string_view("nsewNSEW").find(text.back()) != std::string_view::npos) {
    if (std::string_view("swSW").find(text.back()) != std::string_view::npos) sign = -1.0;
    text.remove_suffix(1);
  }
  if (!text.empty() && text.front() == '-') {
    sign = -sign;
    text.remove_prefix(1);
  }
  double unit = 1.0;
  degrees = 0.0;
  for (int part = 0; part < 3; ++part, unit /= 60.0) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const std::string_view number = text.substr(0, colon);
    double value = 0.0;
    if (!read_decimal(number, value) || !(value >= 0.0) || (part > 0 && value >= 60.0)) return false;
    degrees += value * unit;
    if (colon == text.size()) {
      degrees *= sign;
      return std::isfinite(degrees);
    }
    text.remove_prefix(colon + 1);
  }
  return false;
}

}  // namespace

std::size_t GrassHeader::find(std::string_view name) {
  const std::string plain = lower_case(name);
  return static_cast<std::size_t>(std::find(kNameTexts.begin(), kNameTexts.end(), plain) - kNameTexts.begin());
}

bool GrassHeader::is_name(std::string_view word) {
  const std::size_t colon = word.find(':');
  return colon != std::string_view::npos && find(word.substr(0, colon)) < kNames;
}

void GrassHeader::add(std::string_view name, std::string_view value, std::uint64_t line) {
  Value& known = values_[find(name)];
  if (!known.text.empty()) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: line {}: {}: is given again, line {} has it; it must be given once", path_, line,
                            printable(name), known.line));
  }
  known = {std::string(value), line};
}

void GrassHeader::refuse(Name name, std::string_view required) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {}: is \"{}\", must be {}", path_, values_[name].line,
                                               kNameTexts[name], printable(values_[name].text), required));
}

std::int64_t GrassHeader::count(Name name) const {
  const std::string& text = values_[name].text;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 1) refuse(name, "a whole number from 1 on");
  return value;
}

double GrassHeader::edge(Name name, bool& degrees) const {
  const std::string& text = values_[name].text;
  double value = 0.0;
  if (read_decimal(text, value) && std::isfinite(value)) return value;
  if (!read_degrees(text, value)) refuse(name, "a number, or degrees as in 45:30:00N");
  degrees = true;
  return value;
}

bool GrassHeader::is_whole() const {
  return lower_case(values_[kType].text) == "int";
}

double GrassHeader::null_value() const {
  double value = 0.0;
  return read_decimal(values_[kNull].text, value) ? value : std::numeric_limits<double>::quiet_NaN();
}

std::string_view GrassHeader::null_word() const {
  return has_null() ? std::string_view(values_[kNull].text) : std::string_view("*");
}

void GrassHeader::read(SourceInfo& info) const {
  for (const Name name : {kNorth, kSouth, kEast, kWest, kRows, kCols}) {
    if (values_[name].text.empty()) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: the header does not say {}:, which it must", path_, kNameTexts[name]));
    }
  }
  info.width = count(kCols);
  info.height = count(kRows);
  bool degrees = false;
  const double north = edge(kNorth, degrees);
  const double south = edge(kSouth, degrees);
  const double east = edge(kEast, degrees);
  const double west = edge(kWest, degrees);
  if (!(north > south)) refuse(kNorth, fmt::format("North of south: ({})", south));
  if (!(east > west)) refuse(kEast, fmt::format("East of west: ({})", west));
  Georeference& place = info.georeference;
  place.registration = Registration::kArea;
  if (degrees) place.unit = HorizontalUnit::kDegree;
  place.spacing_x = (east - west) / static_cast<double>(info.width);
  place.spacing_y = (north - south) / static_cast<double>(info.height);
  place.has_origin = true;
  place.origin_x = west + place.spacing_x / 2.0;
  place.origin_y = north - place.spacing_y / 2.0;
  const std::string type = lower_case(values_[kType].text);
  if (!type.empty() && type != "int" && type != "float" && type != "double") refuse(kType, "int, float or double");
  if (!values_[kMultiplier].text.empty()) {
    double scale = 0.0;
    if (!read_decimal(values_[kMultiplier].text, scale) || !std::isfinite(scale) || scale == 0.0) {
      refuse(kMultiplier, "a number other than 0");
    }
    info.z_scale = scale;
  }
}

}  // namespace isohf
