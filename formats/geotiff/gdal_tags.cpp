#include "formats/geotiff/gdal_tags.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>

#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/base/number_text.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

/// The value of `name="..."` inside a start tag.
std::string attribute(std::string_view tag, std::string_view name) {
  const std::string wanted = fmt::format(" {}=\"", name);
  const std::size_t at = tag.find(wanted);
  if (at == std::string_view::npos) return {};
  const std::size_t begin = at + wanted.size();
  const std::size_t end = tag.find('"', begin);
  return end == std::string_view::npos ? std::string() : std::string(tag.substr(begin, end - begin));
}

}  // namespace

void read_gdal_item(const std::string& role, const std::string& text, SourceInfo& info) {
  if (role == "unittype") {
    if (text.empty()) return;
    const std::optional<LinearUnit> unit = linear_unit(text);
    info.vertical_unit = unit ? unit->name : text;
    info.metres_per_vertical_unit = unit ? unit->metres : 1.0;
    return;
  }
  const std::optional<double> value = number_from(text);
  if (!value || !std::isfinite(*value) || (role == "scale" && *value == 0.0)) {
    info.warnings.push_back(loss(fmt::format("GDAL gives the {} \"{}\", which is ignored", role, text)));
    return;
  }
  (role == "scale" ? info.z_scale : info.z_offset) = *value;
}

void read_gdal_nodata(const std::string& text, SourceInfo& info) {
  const std::string shown = trimmed(text);
  if (shown.empty()) return;
  const std::optional<double> value = number_from(shown);
  const std::optional<double> stored = value ? void_value_as_stored(info.sample_type, *value) : std::nullopt;
  if (stored) {
    info.void_values.push_back(*stored);
  } else {
    info.warnings.push_back(loss(fmt::format("GDAL_NODATA is \"{}\", which no {} sample can hold; it is ignored", shown,
                                             to_string(info.sample_type))));
  }
}

namespace {

/// Calls take(role, band, text) for each <Item role="..." sample="...">.
template <typename Take>
void for_each_item(const std::string& xml, Take take) {
  std::size_t at = 0;
  while ((at = xml.find("<Item ", at)) != std::string::npos) {
    const std::size_t tag_end = xml.find('>', at);
    if (tag_end == std::string::npos) return;
    const std::string_view tag = std::string_view(xml).substr(at, tag_end - at);
    at = tag_end + 1;
    if (tag.back() == '/') continue;
    const std::size_t text_end = xml.find('<', at);
    if (text_end == std::string::npos) return;
    take(attribute(tag, "role"), attribute(tag, "sample"), trimmed(std::string_view(xml).substr(at, text_end - at)));
    at = text_end;
  }
}

}  // namespace

void read_gdal_metadata(const std::string& xml, int sample, SourceInfo& info) {
  const std::string band = std::to_string(sample);
  for_each_item(xml, [&](const std::string& role, const std::string& of, const std::string& text) {
    if (of == band && (role == "scale" || role == "offset" || role == "unittype")) read_gdal_item(role, text, info);
  });
}

std::vector<std::string> gdal_band_names(const std::string& xml, std::size_t bands) {
  std::vector<std::string> names(bands);
  for_each_item(xml, [&](const std::string& role, const std::string& of, const std::string& text) {
    std::size_t band = 0;
    const auto [end, failure] = std::from_chars(of.data(), of.data() + of.size(), band);
    if (role == "description" && failure == std::errc() && end == of.data() + of.size() && band < bands)
      names[band] = text;
  });
  return names;
}

}  // namespace isohf
