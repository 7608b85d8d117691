#include "formats/open_options.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

template <typename T>
std::optional<double> integer_as_stored(double value) {
  const auto lowest = static_cast<double>(std::numeric_limits<T>::min());
  const auto highest = static_cast<double>(std::numeric_limits<T>::max());
  if (!(value >= lowest && value <= highest) || std::trunc(value) != value) return std::nullopt;
  return value;
}

/// Rounds to a binary format of `digits` significant bits whose largest finite value is `highest` and whose smallest
/// step is 2^`lowest_exponent`. Decimal texts of the largest value round up past it (GDAL writes 3.40282346638529e+38),
/// up to half a step; those mean the largest value.
std::optional<double> float_as_stored(double value, int digits, double highest, int lowest_exponent) {
  if (!std::isfinite(value)) return value;
  int exponent = 0;
  std::frexp(value, &exponent);  // |value| < 2^exponent
  const int step = std::max(exponent - digits, lowest_exponent);
  const double rounded = std::ldexp(std::nearbyint(std::ldexp(value, -step)), step);
  if (std::abs(rounded) <= highest) return rounded;
  int top = 0;
  std::frexp(highest, &top);
  if (std::abs(value) <= highest + std::ldexp(0.5, top - digits)) return std::copysign(highest, value);
  return std::nullopt;
}

void require_finite(const std::optional<double>& value, const SourceInfo& info, const char* what) {
  if (value && !std::isfinite(*value)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {} is {}, must be finite", info.path, what, *value));
  }
}

void override_voids(SourceInfo& info, const std::vector<double>& values) {
  info.void_values.clear();
  for (const double value : values) {
    const std::optional<double> stored = void_value_as_stored(info.sample_type, value);
    if (!stored) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: void value is {}, which no {} sample can hold",
                                                           info.path, value, to_string(info.sample_type)));
    }
    info.void_values.push_back(*stored);
  }
}

void override_spacing(SourceInfo& info, double spacing_m) {
  Georeference& place = info.georeference;
  if (place.unit == HorizontalUnit::kMetre) {
    place.origin_x *= place.metres_per_unit;
    place.origin_y *= place.metres_per_unit;
  } else {
    if (place.unit == HorizontalUnit::kDegree) {
      info.warnings.push_back(
          loss(fmt::format("a spacing of {} m replaces {} x {} degrees: the origin in degrees is dropped", spacing_m,
                           place.spacing_x, place.spacing_y)));
    }
    place.has_origin = false;
    place.origin_x = place.origin_y = 0.0;
  }
  place.unit = HorizontalUnit::kMetre;
  place.metres_per_unit = 1.0;
  place.spacing_x = place.spacing_y = spacing_m;
}

}  // namespace

std::optional<double> void_value_as_stored(SampleType type, double value) {
  return with_stored_type(type, [value](auto stored) -> std::optional<double> {
    using T = decltype(stored);
    if constexpr (std::is_same_v<T, StoredHalf>) {
      return float_as_stored(value, 11, 65504.0, -24);
    } else if constexpr (std::is_same_v<T, float>) {
      return float_as_stored(value, std::numeric_limits<float>::digits,
                             static_cast<double>(std::numeric_limits<float>::max()), -149);
    } else if constexpr (std::is_same_v<T, double>) {
      return value;
    } else {
      return integer_as_stored<T>(value);
    }
  });
}

void apply_open_options(SourceInfo& info, const OpenOptions& options) {
  require_finite(options.z_scale, info, "the vertical scale");
  require_finite(options.z_offset, info, "the vertical offset");
  require_finite(options.spacing, info, "the spacing");
  if (options.z_scale && *options.z_scale == 0.0) {
    throw Error(ErrorCode::kInvalidArgument,
                info.path + ": the vertical scale is 0, which makes every elevation equal");
  }
  if (options.spacing && *options.spacing <= 0.0) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: the spacing is {} m, must be positive", info.path, *options.spacing));
  }
  if (options.registration) info.georeference.registration = *options.registration;
  if (!options.void_values.empty()) override_voids(info, options.void_values);
  if (options.z_scale) info.z_scale = *options.z_scale;
  if (options.z_offset) info.z_offset = *options.z_offset;
  if (options.spacing) override_spacing(info, *options.spacing);
}

std::int64_t choose_band(SourceInfo& info, const OpenOptions& options, std::int64_t bands) {
  std::int64_t band = 0;
  if (!options.channel.empty()) {
    const char* const end = options.channel.data() + options.channel.size();
    const auto [at, error] = std::from_chars(options.channel.data(), end, band);
    if (error != std::errc{} || at != end || band < 0 || band >= bands) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: there is no channel \"{}\"; there {}", info.path, options.channel,
                              bands == 1 ? "is 0 alone" : fmt::format("are 0 to {}", bands - 1)));
    }
  } else if (bands > 1) {
    info.warnings.push_back(fmt::format("there are {} bands; channel 0 is read", bands));
  }
  if (bands > 1) info.channel = fmt::format("{}", band);
  return band;
}

}  // namespace isohf
