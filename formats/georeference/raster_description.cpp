#include "formats/georeference/raster_description.h"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "formats/io/raw_file.h"
#include "formats/open_options.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/length_unit.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::uint64_t kMostBytes = 65536;
constexpr double kMostSide = 2147483647.0;

}  // namespace

struct RasterDescription::Json {
  nlohmann::json value;
};

bool has_raster_description(const std::string& raster_path) {
  return is_file(raster_path + ".json");
}

RasterDescription::RasterDescription(const std::string& raster_path)
    : path_(raster_path + ".json"), json_(std::make_unique<Json>()) {
  const RawFile file(path_);
  if (file.size_bytes() > kMostBytes)
    refuse(fmt::format("has {} bytes, must have {} at most", file.size_bytes(), kMostBytes));
  std::string text(static_cast<std::size_t>(file.size_bytes()), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  json_->value = nlohmann::json::parse(text, nullptr, false);
  if (!json_->value.is_object()) refuse("is not a JSON object");
}

RasterDescription::~RasterDescription() = default;

RawLayout RasterDescription::layout() const {
  RawLayout layout;
  layout.width = side("width");
  layout.height = side("height");
  layout.type = sample_type();
  const std::string order = word("byte_order");
  if (order != "little" && order != "big") refuse("byte_order is neither little nor big");
  layout.big_endian = order == "big";
  return layout;
}

void RasterDescription::require(const std::string& format, const SourceInfo& info) const {
  if (this->format() != format) refuse(fmt::format("format is {}, must be {}", printable(this->format()), format));
  const std::int64_t width = side("width");
  const std::int64_t height = side("height");
  const SampleType type = sample_type();
  if (width != info.width || height != info.height || type != info.sample_type) {
    refuse(fmt::format("is of {} x {} samples of {}, the file beside it has {} x {} of {}", width, height,
                       to_string(type), info.width, info.height, to_string(info.sample_type)));
  }
}

void RasterDescription::describe(SourceInfo& info) const {
  if (const std::string order = word("row_order"); !order.empty() && order != "north to south") {
    refuse(fmt::format("row_order is {}, must be north to south: turn the samples over", printable(order)));
  }
  info.z_scale = number("z_scale").value_or(1.0);
  info.z_offset = number("z_offset").value_or(0.0);
  if (info.z_scale == 0.0) refuse("z_scale is 0");
  if (const auto value = number("void_value")) {
    const auto stored = void_value_as_stored(info.sample_type, *value);
    if (!stored)
      refuse(fmt::format("void_value is {}, which no {} sample can hold", *value, to_string(info.sample_type)));
    info.void_values = {*stored};
  }
  if (word("vertical_unit") != "unknown") info.vertical_unit = word("vertical_unit");
  if (const auto unit = linear_unit(info.vertical_unit)) info.metres_per_vertical_unit = unit->metres;
  describe_place(info.georeference);
  if (const std::string wkt = word("crs_wkt"); !wkt.empty()) {
    try {
      take_system(wkt, info);
    } catch (const Error& error) {
      refuse(fmt::format("crs_wkt: {}", error.what()));
    }
  }
  ReferenceSystem& system = info.georeference.system;
  if (const std::string datum = word("vertical_datum"); !datum.empty()) system.vertical_datum = datum;
  if (const auto heights = code("vertical_epsg")) system.vertical_epsg = heights;
}

void RasterDescription::describe_place(Georeference& place) const {
  const auto unknown = [this](const std::string& text, const char* key, const char* words) {
    if (!text.empty() && text != "unknown") refuse(fmt::format("{} is {}, must be {}", key, printable(text), words));
  };
  const std::string registration = word("registration");
  place.registration = registration == "area"    ? Registration::kArea
                       : registration == "point" ? Registration::kPoint
                                                 : Registration::kUnknown;
  if (place.registration == Registration::kUnknown) unknown(registration, "registration", "area, point or unknown");
  const std::string unit = word("horizontal_unit");
  place.unit = unit == "degree"  ? HorizontalUnit::kDegree
               : unit == "metre" ? HorizontalUnit::kMetre
                                 : HorizontalUnit::kUnknown;
  if (place.unit == HorizontalUnit::kUnknown) unknown(unit, "horizontal_unit", "degree, metre or unknown");
  place.metres_per_unit = number("metres_per_unit").value_or(1.0);
  place.spacing_x = number("spacing_x").value_or(1.0);
  place.spacing_y = number("spacing_y").value_or(1.0);
  if (!(place.spacing_x > 0.0) || !(place.spacing_y > 0.0) || !(place.metres_per_unit > 0.0)) {
    refuse("a spacing or metres_per_unit is not positive");
  }
  const auto x = number("origin_x");
  const auto y = number("origin_y");
  if (x.has_value() != y.has_value()) refuse("has one of origin_x and origin_y, must have both or none");
  place.has_origin = x.has_value();
  place.origin_x = x.value_or(0.0);
  place.origin_y = y.value_or(0.0);
  place.system.name = word("crs_name");
  place.system.body = word("body");
  place.system.epsg = code("crs_epsg");
}

void RasterDescription::refuse(const std::string& what) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}; mend it or move it away", path_, what));
}

std::int64_t RasterDescription::side(const char* key) const {
  const double side = number(key).value_or(0.0);
  if (!(side >= 1.0 && side <= kMostSide) || side != std::floor(side)) {
    refuse("has no width and height, whole numbers from 1");
  }
  return static_cast<std::int64_t>(side);
}

SampleType RasterDescription::sample_type() const {
  try {
    return sample_type_from_string(word("sample_type"));
  } catch (const Error& error) {
    refuse(fmt::format("sample_type: {}", error.what()));
  }
}

std::optional<double> RasterDescription::number(const char* key) const {
  const auto found = json_->value.find(key);
  if (found == json_->value.end() || found->is_null()) return std::nullopt;
  if (!found->is_number() || !std::isfinite(found->get<double>())) refuse(fmt::format("{} is no number", key));
  return found->get<double>();
}

std::optional<int> RasterDescription::code(const char* key) const {
  const auto code = number(key);
  if (!code) return std::nullopt;
  if (!(*code > 0 && *code < 1e6) || *code != std::floor(*code)) refuse(fmt::format("{} is no EPSG code", key));
  return static_cast<int>(*code);
}

std::string RasterDescription::word(const char* key) const {
  const auto found = json_->value.find(key);
  if (found == json_->value.end()) return {};
  if (!found->is_string()) refuse(fmt::format("{} is no text", key));
  return found->get<std::string>();
}

}  // namespace isohf
