#include "isohf/base/handed_in.h"

#include <fmt/format.h>

#include <cmath>

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& found, const std::string& required) {
  throw Error(ErrorCode::kInvalidArgument, {where, found, required, ""});
}

/// Places in degrees: what else has such coordinates is in metres, most often.
void require_degrees(const std::string& path, const Georeference& place, std::int64_t height) {
  constexpr double kTurn = 360.0;
  constexpr double kMostLongitude = 1e4;  // as metadata have it
  constexpr double kMostLatitude = 180.0;
  const auto require = [&](bool holds, const std::string& what, const std::string& found, const char* required) {
    if (holds) return;
    throw Error(ErrorCode::kInvalidArgument,
                {path + ": " + what, found + " degrees", required, "`reference_system` says what they are instead"});
  };
  require(place.spacing_x <= kTurn && place.spacing_y <= kTurn, "the spacing",
          fmt::format("{:.9g} x {:.9g}", place.spacing_x, place.spacing_y), "360 at most");
  if (!place.has_origin) return;
  require(std::abs(place.origin_x) <= kMostLongitude, "the first longitude", fmt::format("{:.9g}", place.origin_x),
          "from -10000 to 10000");
  const double south = place.origin_y - static_cast<double>(height - 1) * place.spacing_y;
  require(place.origin_y <= kMostLatitude && south >= -kMostLatitude, "the latitudes",
          fmt::format("{:.9g} to {:.9g}", south, place.origin_y), "from -90 to 90");
}

}  // namespace

void require_size(const std::string& what, std::int64_t width, std::int64_t height) {
  if (width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide && width <= kMaxSamples / height) return;
  refuse(what, fmt::format("{} x {} samples", width, height), "1 to 2^40 either way, 2^59 at most");
}

void refuse_unknown(std::string_view what, std::int64_t found, std::int64_t last) {
  refuse(std::string(what), fmt::format("{}", found), fmt::format("a value of its type, 0 to {}", last));
}

void require_window(const std::string& path, std::int64_t width, std::int64_t height, const Window& window,
                    std::size_t sample_bytes, std::size_t room_bytes) {
  const auto is_within = [](std::int64_t first, std::int64_t count, std::int64_t size) {
    return first >= 0 && count >= 0 && first <= size && count <= size - first;
  };
  if (!is_within(window.column, window.columns, width) || !is_within(window.row, window.rows, height)) {
    refuse(path,
           fmt::format("a window of {} x {} samples from ({}, {}) on", window.columns, window.rows, window.column,
                       window.row),
           fmt::format("within its {} x {}", width, height));
  }
  // Beyond 2^53 doubles differ from room that nobody has.
  const double bytes =
      static_cast<double>(window.columns) * static_cast<double>(window.rows) * static_cast<double>(sample_bytes);
  if (bytes == static_cast<double>(room_bytes)) return;
  refuse(path, fmt::format("room for {} bytes", room_bytes),
         fmt::format("{:.0f}, the size of {} x {} samples of {}", bytes, window.columns, window.rows, sample_bytes));
}

void require_source(const SourceInfo& info) {
  const auto require = [&](bool holds, const char* member, double found, const char* required) {
    if (holds) return;
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: its {} is {}, must be {}", info.path, member, found, required));
  };
  const auto is_length = [](double value) { return std::isfinite(value) && value > 0.0; };
  const Georeference& place = info.georeference;
  require_size(info.path, info.width, info.height);
  require_known(info.path + ": its sample type", info.sample_type, SampleType::kFloat64);
  require_known(info.path + ": its horizontal unit", place.unit, HorizontalUnit::kDegree);
  require_known(info.path + ": its registration", place.registration, Registration::kPoint);
  require(std::isfinite(info.z_scale) && info.z_scale != 0.0, "z_scale", info.z_scale, "a number other than 0");
  require(std::isfinite(info.z_offset), "z_offset", info.z_offset, "a number");
  require(!std::isnan(info.valid_min), "valid_min", info.valid_min, "a number");
  require(!std::isnan(info.valid_max), "valid_max", info.valid_max, "a number");
  require(info.fill_distance >= 0 && info.fill_distance <= kMaxFillDistance, "fill distance",
          static_cast<double>(info.fill_distance), "0 to 4096");
  require(is_length(info.metres_per_vertical_unit), "vertical unit in metres", info.metres_per_vertical_unit,
          "above 0");
  require(is_length(place.metres_per_unit), "horizontal unit in metres", place.metres_per_unit, "above 0");
  require(is_length(place.spacing_x), "spacing of columns", place.spacing_x, "above 0");
  require(is_length(place.spacing_y), "spacing of rows", place.spacing_y, "above 0");
  require(std::isfinite(place.origin_x), "first easting", place.origin_x, "a number");
  require(std::isfinite(place.origin_y), "first northing", place.origin_y, "a number");
  require(place.system.epsg.value_or(1) > 0, "EPSG code", place.system.epsg.value_or(1), "above 0");
  require(place.system.vertical_epsg.value_or(1) > 0, "vertical EPSG code", place.system.vertical_epsg.value_or(1),
          "above 0");
  const double axis = place.system.semi_major_axis_m.value_or(1.0);
  require(is_length(axis), "semi-major axis", axis, "above 0");
  const double flattening = place.system.inverse_flattening.value_or(0.0);
  require(std::isfinite(flattening), "inverse flattening", flattening, "a number");
  if (place.unit == HorizontalUnit::kDegree) require_degrees(info.path, place, info.height);
}

std::string latitude_warning(const SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (place.unit != HorizontalUnit::kDegree || !place.has_origin) return {};
  constexpr double kPole = 90.0;
  const double north = place.origin_y;
  const double south = north - static_cast<double>(info.height - 1) * place.spacing_y;
  const double beyond = kPole + 0.01 * place.spacing_y;
  if (north <= beyond && south >= -beyond) return {};
  return fmt::format(
      "its rows lie at latitudes from {:.10g} to {:.10g}, and there is no ground beyond 90: `bbox` leaves rows out",
      south, north);
}

}  // namespace isohf
