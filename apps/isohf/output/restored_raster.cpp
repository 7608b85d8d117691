#include "output/restored_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "formats/georeference/reference_system.h"
#include "formats/georeference/units.h"
#include "formats/io/text.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

RasterSpec plain_spec(const Metadata& metadata, const SampleGrid& grid, const SampleMapping& mapping,
                      std::optional<double> void_value) {
  RasterSpec spec;
  spec.width = grid.width;
  spec.height = grid.height;
  spec.sample_type = mapping.type;
  spec.z_scale = mapping.z_scale;
  spec.z_offset = mapping.z_offset;
  spec.void_value = void_value;
  spec.describe = true;
  if (metadata.vertical_unit != "unknown") spec.vertical_unit = metadata.vertical_unit;
  if (const auto unit = linear_unit(spec.vertical_unit)) spec.metres_per_vertical_unit = unit->metres;
  return spec;
}

}  // namespace

RasterKind raster_kind(const std::string& path) {
  static constexpr std::pair<const char*, RasterKind> kKinds[] = {
      {".tif", RasterKind::kTiff},  {".tiff", RasterKind::kTiff}, {".exr", RasterKind::kExr},
      {".png", RasterKind::kPng},   {".hgt", RasterKind::kHgt},   {".asc", RasterKind::kAsc},
      {".flt", RasterKind::kFlt},   {".r16", RasterKind::kRaw16}, {".raw", RasterKind::kRaw16},
      {".r32", RasterKind::kRaw32}, {".npy", RasterKind::kNpy}};
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  for (const auto& [known, kind] : kKinds) {
    if (extension == known) return kind;
  }
  return RasterKind::kOther;
}

SampleType restored_type(const std::string& path, SampleType source_type) {
  switch (raster_kind(path)) {
    case RasterKind::kHgt:
      return SampleType::kInt16;
    case RasterKind::kExr:
      if (source_type == SampleType::kFloat16 || source_type == SampleType::kUint32) return source_type;
      return SampleType::kFloat32;
    case RasterKind::kPng:
      return source_type == SampleType::kUint8 ? source_type : SampleType::kUint16;
    case RasterKind::kFlt:
    case RasterKind::kRaw32:
      return SampleType::kFloat32;
    case RasterKind::kRaw16:
      return SampleType::kUint16;
    default:
      return source_type;
  }
}

RasterSpec raster_spec(const Metadata& metadata, const SampleGrid& grid, const SampleMapping& mapping,
                       std::optional<double> void_value) {
  RasterSpec spec = plain_spec(metadata, grid, mapping, void_value);
  spec.georeference = grid_georeference(metadata, grid);
  return spec;
}

RasterSpec source_raster_spec(const Metadata& metadata, const SampleMapping& mapping,
                              std::optional<double> void_value) {
  const SampleGrid grid = source_grid(metadata.source);
  RasterSpec spec = plain_spec(metadata, grid, mapping, void_value);
  spec.georeference = is_warped(metadata) ? source_georeference(metadata.source) : grid_georeference(metadata, grid);
  return spec;
}

std::optional<double> void_value_of(SampleType type, bool has_voids) {
  if (!has_voids) return std::nullopt;
  return usual_nodata(type).value_or(std::numeric_limits<double>::quiet_NaN());
}

bool needs_void(const Metadata& metadata, const SampleGrid& grid, const std::string& output) {
  return may_have_nodata(metadata, grid) || raster_kind(output) == RasterKind::kHgt;
}

bool takes_decimals(const Metadata& metadata, const SampleMapping& mapping) {
  return !is_floating(mapping.type) && mapping.z_scale == 1.0 &&
         is_floating(sample_type_from_string(metadata.source.sample_type));
}

bool has_scale(const std::string& output) {
  const RasterKind kind = raster_kind(output);
  return kind == RasterKind::kTiff || kind == RasterKind::kPng || kind == RasterKind::kRaw16 ||
         kind == RasterKind::kRaw32;
}

SampleMapping spread_over(SampleType type, RowReader rows, const Job& job, bool& has_voids) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  has_voids = false;
  rows.read_all(
      [&](std::int64_t, std::span<const double> elevations) {
        for (const double z : elevations) {
          has_voids = has_voids || std::isnan(z);
          low = z < low ? z : low;
          high = z > high ? z : high;
        }
      },
      job);
  // Filters leave some rounding of level ground, which spread over all numbers would be noise.
  if (high - low <= 1e-7 * std::max(std::abs(low), std::abs(high))) high = low;
  return low <= high ? spread(type, {low, high}, has_voids) : SampleMapping{type, 1.0, 0.0};
}

void warn_of_whole_numbers(const Common& common, const std::string& output, const Metadata& metadata) {
  const std::string& unit = metadata.vertical_unit;
  print_warning(common, loss(fmt::format("{}: holds whole numbers: elevations are rounded by up to 0.5 {}", output,
                                         unit == "unknown" ? "of their unit" : unit)));
}

void warn_of_halves(const Common& common, const std::string& output, const Metadata& metadata) {
  const Statistics& found = metadata.statistics;
  const double largest = std::max(std::abs(found.min.value_or(0.0)), std::abs(found.max.value_or(0.0)));
  if (!(largest > 0.0)) return;
  const std::string& unit = metadata.vertical_unit;
  print_warning(common,
                loss(fmt::format("{}: half floats have 11 bits: elevations are rounded by up to {:.3g} {}", output,
                                 std::exp2(std::ilogb(largest) - 11), unit == "unknown" ? "of their unit" : unit)));
}

void warn_of_losses(const Common& common, const std::string& output, const RasterSpec& spec) {
  const RasterKind kind = raster_kind(output);
  std::vector<Warning> lost;
  const auto say = [&](const std::string& what) { lost.push_back(loss(output + ": " + what)); };
  if ((spec.z_scale != 1.0 || spec.z_offset != 0.0) && !has_scale(output)) {
    say(fmt::format("has no place for what its raw numbers mean: elevation = raw * {} + {}", spec.z_scale,
                    spec.z_offset));
  }
  const ReferenceSystem system = spec.georeference ? spec.georeference->system : ReferenceSystem{};
  const bool has_auxiliary =
      (kind == RasterKind::kExr || kind == RasterKind::kPng) && spec.georeference && spec.georeference->has_origin;
  if (spec.metres_per_vertical_unit != 1.0 && !has_scale(output) && !has_auxiliary) {
    say(fmt::format("has no place for the unit of its elevations, {}: readers take them for metres",
                    spec.vertical_unit));
  }
  if (kind == RasterKind::kHgt) {
    const bool is_in_degrees = spec.georeference && spec.georeference->unit == HorizontalUnit::kDegree;
    const bool is_on_earth = system.body.empty() || system.body == "Earth";
    const bool is_above_ellipsoid =
        system.vertical_datum.find("llipsoid") != std::string::npos ||
        (is_in_degrees && system.epsg && system.vertical_datum.empty() && gives_heights_above_ellipsoid(*system.epsg));
    constexpr int kWgs84WithHeights = 4979;
    const int code = system.epsg.value_or(4326);
    if (!is_on_earth || (is_in_degrees && code != 4326 && code != kWgs84WithHeights))
      say("readers take it for degrees of WGS 84, which its samples do not lie on");
    if (is_above_ellipsoid) {
      say("readers take it for heights above the geoid, and these are above the ellipsoid");
    }
  }
  print_warnings(common, lost);
}

void refuse_sample(const std::string& output, SampleType type, std::int64_t column, std::int64_t row,
                   const std::string& value, const std::string& remedy) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: sample (column {}, row {}) is {}, which {} does not hold; {}", output, column, row,
                          value, to_string(type), remedy));
}

std::string usual_remedy(const std::string& output, const SampleMapping& mapping, const Statistics& elevations,
                         RestoreMethod method) {
  std::string text = "--clamp-range moves it";
  const auto holds = [&, range = sample_range(mapping.type)](double elevation) {
    const double raw = std::round((elevation - mapping.z_offset) / mapping.z_scale);
    return raw >= range.first && raw <= range.second;
  };
  if (elevations.min && elevations.max && !(holds(*elevations.min) && holds(*elevations.max))) {
    text += fmt::format(" (elevations run from {:.9g} to {:.9g})", *elevations.min, *elevations.max);
  } else if (method == RestoreMethod::kHex && !is_floating(mapping.type)) {
    text += ", --method barycentric does not overshoot";
  }
  if (raster_kind(output) != RasterKind::kExr) text += ", .exr holds it";
  return text;
}

std::string scale_that_holds(const Statistics& elevations, const SampleMapping& mapping, bool has_voids) {
  if (is_floating(mapping.type) || !elevations.min || !elevations.max) return {};
  // A spline goes a little beyond them.
  const double beyond = 0.005 * (*elevations.max - *elevations.min);
  const double least = *elevations.min - beyond;
  const double most = *elevations.max + beyond;
  const auto rounded_up = [](double scale) {
    const double grain = std::pow(10.0, std::floor(std::log10(scale)) - 2.0);
    return std::ceil(scale / grain) * grain;
  };
  auto [low, high] = sample_range(mapping.type);
  const std::optional<double> nodata = has_voids ? usual_nodata(mapping.type) : std::nullopt;
  if (nodata == low) low += 1.0;
  if (nodata == high) high -= 1.0;
  if (low < 0.0 || least >= mapping.z_offset) {
    const double scale =
        std::max({(most - mapping.z_offset) / high, low < 0.0 ? (least - mapping.z_offset) / low : 0.0, 1e-9});
    return fmt::format("--z-scale {:.3g} holds it", rounded_up(scale));
  }
  const double offset = std::floor(least);
  return fmt::format("--z-offset {} with --z-scale {:.3g} holds it", offset,
                     rounded_up(std::max((most - offset) / high, 1e-9)));
}

std::vector<std::byte> store_rows(const SampleStore& store, const RasterTarget& target, std::int64_t width,
                                  std::int64_t first_row, std::span<const double> elevations,
                                  SampleStore::Result& counts) {
  const SampleMapping& mapping = target.mapping;
  std::vector<std::byte> raw(elevations.size() * size_bytes(mapping.type));
  const SampleStore::Result result = store.store(elevations, raw);
  counts.nodata += result.nodata;
  counts.clamped += result.clamped;
  if (result.refused) {
    const auto sample = static_cast<std::int64_t>(*result.refused);
    const double elevation = elevations[*result.refused];
    std::string value = fmt::format("{:.9g}", elevation);
    if (mapping.z_scale != 1.0 || mapping.z_offset != 0.0) {
      value =
          fmt::format("at elevation {:.9g}, so {:.9g}", elevation, (elevation - mapping.z_offset) / mapping.z_scale);
    }
    const bool is_void = std::isnan(elevation);
    refuse_sample(target.output, mapping.type, sample % width, first_row + sample / width, is_void ? "void" : value,
                  is_void ? "a floating type does" : target.remedy);
  }
  return raw;
}

}  // namespace isohf::cli
