#include "raster/restored_raster.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "formats/files/text.h"
#include "formats/georeference/units.h"
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
  if (void_value && !std::isnan(*void_value)) spec.void_value = void_value;
  spec.describe = true;
  if (metadata.vertical_unit != "unknown") spec.vertical_unit = metadata.vertical_unit;
  if (const auto unit = linear_unit(spec.vertical_unit)) spec.metres_per_vertical_unit = unit->metres;
  return spec;
}

/// Whether the file, or the one beside it, says what scale and offset are.
bool has_scale(RasterKind kind) {
  return kind == RasterKind::kTiff || kind == RasterKind::kPng || kind == RasterKind::kRaw16 ||
         kind == RasterKind::kRaw32;
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

bool needs_void(const Metadata& metadata, const SampleGrid& grid, const std::string& output) {
  return may_have_nodata(metadata, grid) || raster_kind(output) == RasterKind::kHgt;
}

void warn_of_lost_scale(const std::string& output, const SampleMapping& mapping) {
  if ((mapping.z_scale == 1.0 && mapping.z_offset == 0.0) || has_scale(raster_kind(output))) return;
  print_warning(loss(fmt::format("{}: has no place for what its raw numbers mean: elevation = raw * {} + {}", output,
                                 mapping.z_scale, mapping.z_offset)));
}

void refuse_sample(const std::string& output, SampleType type, std::int64_t column, std::int64_t row, double value,
                   const char* remedy) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: sample (column {}, row {}) is {:.9g}, which {} does not hold; {}", output, column, row,
                          value, to_string(type), remedy));
}

std::vector<std::byte> store_rows(const SampleStore& store, SampleType type, const std::string& output,
                                  std::int64_t width, std::int64_t first_row, std::span<const double> elevations,
                                  SampleStore::Result& counts) {
  std::vector<std::byte> raw(elevations.size() * size_bytes(type));
  const SampleStore::Result result = store.store(elevations, raw);
  counts.nodata += result.nodata;
  counts.clamped += result.clamped;
  if (result.refused) {
    const auto sample = static_cast<std::int64_t>(*result.refused);
    refuse_sample(output, type, sample % width, first_row + sample / width, elevations[*result.refused],
                  "--clamp-range moves it, .exr holds it");
  }
  return raw;
}

}  // namespace isohf::cli
