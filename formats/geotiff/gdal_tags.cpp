#include "formats/geotiff/gdal_tags.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <sstream>
#include <string_view>

#include "formats/open_options.h"
#include "isohf/base/sample.h"
#include "isohf/base/text/number_text.h"
#include "isohf/base/text/text.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

/// Half a unit of the last digit of a decimal number; 0 for a text of more than `most` digits, or of none.
double half_last_digit(std::string_view text, std::size_t most) {
  const std::size_t exponent_at = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, exponent_at);
  const std::size_t point = mantissa.find('.');
  const auto digits = static_cast<std::size_t>(
      std::ranges::count_if(mantissa, [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }));
  if (digits == 0 || digits > most) return 0.0;
  const std::string_view exponent = exponent_at < text.size() ? text.substr(exponent_at + 1) : "0";
  const std::size_t decimals = point == std::string_view::npos ? 0 : mantissa.size() - point - 1;
  return 0.5 * std::pow(10.0, number_from(exponent).value_or(0.0) - static_cast<double>(decimals));
}

/// The largest value of a floating type, or a power of two, that a text of fewer digits than the type has was printed
/// from: "-3.402823e+38", "1.701412e+38".
std::optional<double> rounded_value(SampleType type, std::string_view text, double value) {
  const bool is_double = type == SampleType::kFloat64;
  constexpr double kLeast = 1e6;  // below it texts of few digits are exact
  if (!is_floating(type) || !(std::abs(value) > kLeast)) return std::nullopt;
  const double half = half_last_digit(text, is_double ? 16 : 8);
  for (const double round : {sample_range(type).second, std::exp2(std::round(std::log2(std::abs(value))))}) {
    if (std::abs(round - std::abs(value)) <= half) return std::copysign(round, value);
  }
  return std::nullopt;
}

/// GDAL escapes texts twice.
std::string unescaped(const std::string& text) {
  pugi::xml_document document;
  const bool is_escaped =
      text.find('&') != std::string::npos && document.load_string(("<t>" + text + "</t>").c_str(), pugi::parse_escapes);
  return is_escaped ? document.child_value("t") : text;
}

/// Calls take(band, role, text) for each item of a band.
template <typename Take>
void for_each_item(const std::string& xml, Take take) {
  pugi::xml_document document;
  // What comes before a fault counts.
  static_cast<void>(document.load_buffer(xml.data(), xml.size()));
  for (const pugi::xml_node item : document.child("GDALMetadata").children("Item")) {
    const int band = item.attribute("sample").as_int(-1);
    if (band >= 0) take(band, std::string(item.attribute("role").value()), unescaped(trimmed(item.child_value())));
  }
}

}  // namespace

void read_gdal_item(const std::string& role, const std::string& text, SourceInfo& info) {
  if (role == "unittype") {
    if (text.empty()) return;
    const std::optional<LinearUnit> unit = linear_unit(text);
    if (!unit) {
      info.warnings.push_back(
          loss(fmt::format("its elevations are in \"{}\", which is not a known unit of length: they are taken as "
                           "metres; `z_scale` makes "
                           "metres of them",
                           printable(text))));
      return;
    }
    info.vertical_unit = unit->name;
    info.metres_per_vertical_unit = unit->metres;
    return;
  }
  const std::optional<double> value = number_from(text);
  if (!value || !std::isfinite(*value) || (role == "scale" && *value == 0.0)) {
    info.warnings.push_back(loss(fmt::format("GDAL gives the {} \"{}\", which is ignored", role, printable(text))));
    return;
  }
  (role == "scale" ? info.z_scale : info.z_offset) = *value;
}

void read_gdal_nodata(const std::string& text, SourceInfo& info) {
  const std::string shown = trimmed(text);
  if (shown.empty()) return;
  std::optional<double> value = number_from(shown);
  // GDAL writes the largest double with 15 digits, which is more.
  if (shown == "1.79769313486232e+308") value = std::numeric_limits<double>::max();
  if (shown == "-1.79769313486232e+308") value = std::numeric_limits<double>::lowest();
  const std::optional<double> rounded = value ? rounded_value(info.sample_type, shown, *value) : std::nullopt;
  const std::optional<double> stored = value ? void_value_as_stored(info.sample_type, *value) : std::nullopt;
  if (rounded) info.void_values.push_back(*rounded);
  if (stored && stored != rounded) info.void_values.push_back(*stored);
  if (!stored && !rounded) {
    info.warnings.push_back(loss(fmt::format("GDAL_NODATA is \"{}\", which no {} sample can hold; it is ignored",
                                             printable(shown), to_string(info.sample_type))));
  }
}

void read_gdal_metadata(const std::string& xml, int sample, SourceInfo& info) {
  for_each_item(xml, [&](int band, const std::string& role, const std::string& text) {
    if (band != sample) return;
    if (role == "scale" || role == "offset" || role == "unittype") read_gdal_item(role, text, info);
  });
}

std::vector<std::string> gdal_band_names(const std::string& xml, std::size_t bands) {
  std::vector<std::string> names(bands);
  for_each_item(xml, [&](int band, const std::string& role, const std::string& text) {
    const auto at = static_cast<std::size_t>(band);
    if (role == "description" && at < bands) names[at] = text;
  });
  return names;
}

std::string gdal_metadata(double z_scale, double z_offset, const std::string& unit) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("GDALMetadata");
  const auto add = [&](const char* role, const std::string& text) {
    pugi::xml_node item = root.append_child("Item");
    item.append_attribute("name") = upper_case(role).c_str();
    item.append_attribute("sample") = 0;
    item.append_attribute("role") = role;
    item.text() = text.c_str();
  };
  if (z_scale != 1.0 || z_offset != 0.0) {
    add("offset", fmt::format("{}", z_offset));
    add("scale", fmt::format("{}", z_scale));
  }
  if (!unit.empty()) add("unittype", unit);
  if (!root.first_child()) return {};
  std::ostringstream text;
  document.save(text, "  ", pugi::format_default | pugi::format_no_declaration);
  return text.str();
}

}  // namespace isohf
