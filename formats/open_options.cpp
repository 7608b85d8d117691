#include "formats/open_options.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

void require_finite(const std::optional<double>& value, const SourceInfo& info, const char* what) {
  if (value && !std::isfinite(*value)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {} is {}, must be finite", info.path, what, *value));
  }
}

void override_voids(SourceInfo& info, const std::vector<double>& values) {
  info.void_values.clear();
  for (const double value : values) {
    if (const auto stored = void_value_as_stored(info.sample_type, value)) info.void_values.push_back(*stored);
  }
  // Files of several types are read with the void values of all.
  if (info.void_values.empty()) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: void value is {}, which no {} sample can hold", info.path,
                                                         values.front(), to_string(info.sample_type)));
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

/// On top of the file's own. A scale that is the unit's size in metres turns the elevations into metres.
void scale_elevations(SourceInfo& info, double scale) {
  constexpr double kSameUnit = 1e-4;  // 0.3048 for US survey feet as well
  if (info.metres_per_vertical_unit != 1.0 && std::abs(scale / info.metres_per_vertical_unit - 1.0) < kSameUnit) {
    info.warnings.push_back(
        fmt::format("the vertical scale {} turns elevations in {} into metres", scale, info.vertical_unit));
    info.vertical_unit = "metre";
    info.metres_per_vertical_unit = 1.0;
  }
  info.z_scale *= scale;
  info.z_offset = info.z_offset * scale + 0.0;  // never -0
}

}  // namespace

std::optional<double> void_value_as_stored(SampleType type, double value) {
  if (!std::isfinite(value)) return is_floating(type) ? std::optional(value) : std::nullopt;
  const double nearest = nearest_sample(type, value);
  if (!is_floating(type)) return nearest == value ? std::optional(value) : std::nullopt;
  // Decimal texts of the largest value round up past it (GDAL writes 3.40282346638529e+38), up to half a step.
  const double most = sample_range(type).second;
  if (std::abs(value) > most + (most - previous_sample(type, most)) / 2.0) return std::nullopt;
  return nearest;
}

std::vector<std::byte> stored_sample(SampleType type, double value) {
  std::vector<std::byte> bytes(size_bytes(type));
  const bool is_beyond = type == SampleType::kFloat16 && std::isinf(value);
  store_sample(type)(is_beyond ? std::numeric_limits<double>::quiet_NaN() : value, bytes.data());
  return bytes;
}

void bound_undeclared_voids(SourceInfo& info) {
  if (!is_floating(info.sample_type) || !info.void_values.empty()) return;
  info.valid_min = std::max(info.valid_min, -kBeyondAnyGround);
  info.valid_max = std::min(info.valid_max, kBeyondAnyGround);
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
  if (options.z_scale) scale_elevations(info, *options.z_scale);
  if (options.z_offset) info.z_offset += *options.z_offset;
  if (options.spacing) override_spacing(info, *options.spacing);
}

}  // namespace isohf
