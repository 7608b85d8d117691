#include "raster/restored_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "formats/files/text.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/archive_geometry.h"
#include "output/standard_output.h"
#include "raster/output_grid.h"

namespace isohf::cli {
namespace {

RasterSpec plain_raster(const Metadata& metadata, const SampleGrid& grid, SampleType type) {
  RasterSpec spec;
  spec.width = grid.width;
  spec.height = grid.height;
  spec.sample_type = type;
  spec.describe = true;
  if (metadata.vertical_unit != "unknown") spec.vertical_unit = metadata.vertical_unit;
  return spec;
}

ReferenceSystem full_system(const SourceRecord& source) {
  ReferenceSystem system = horizontal_system(source);
  system.vertical_datum = source.vertical_datum;
  system.vertical_epsg = source.vertical_epsg;
  return system;
}

/// By the source's place, for grids whose rows are its rows.
RasterSpec raster_in_source_system(const Metadata& metadata, const SampleGrid& grid, SampleType type) {
  const SourceRecord& source = metadata.source;
  RasterSpec spec = plain_raster(metadata, grid, type);
  Georeference place;
  place.registration = source.registration == Registration::kArea ? Registration::kArea : Registration::kPoint;
  place.unit = horizontal_unit(source);
  place.metres_per_unit = source.metres_per_unit;
  // World units to the source's own.
  const double per_x = source.crs_spacing_x > 0.0 ? source.crs_spacing_x / source.spacing_x : 1.0;
  const double per_z = source.crs_spacing_y > 0.0 ? source.crs_spacing_y / source.spacing_z : 1.0;
  const bool is_source_grid = grid.spacing_x == source.spacing_x && grid.spacing_z == source.spacing_z;
  place.spacing_x = is_source_grid && source.crs_spacing_x > 0.0 ? source.crs_spacing_x : grid.spacing_x * per_x;
  place.spacing_y = is_source_grid && source.crs_spacing_y > 0.0 ? source.crs_spacing_y : grid.spacing_z * per_z;
  place.has_origin = source.origin_x.has_value() && source.origin_y.has_value();
  if (place.has_origin) {
    place.origin_x = *source.origin_x + (grid.first_x - source.first_sample_x) * per_x;
    place.origin_y = *source.origin_y - (grid.first_z - source.first_sample_z) * per_z;
  }
  place.system = full_system(source);
  // Without a position a point of unit spacing is what a raster that says nothing is taken for.
  const bool has_spacing = place.spacing_x != 1.0 || place.spacing_y != 1.0;
  if (place.has_origin || has_spacing || place.registration == Registration::kArea) spec.georeference = place;
  return spec;
}

/// Of the archive's reference system in degrees.
RasterSpec raster_in_degrees(const Metadata& metadata, const OutputGrid& grid, SampleType type) {
  RasterSpec spec = plain_raster(metadata, grid.world, type);
  Georeference place;
  place.registration = grid.registration;
  place.unit = HorizontalUnit::kDegree;
  place.spacing_x = grid.degrees->degrees_x;
  place.spacing_y = grid.degrees->degrees_y;
  place.has_origin = true;
  place.origin_x = grid.degrees->first_sample.longitude;
  place.origin_y = grid.degrees->first_sample.latitude;
  place.system = full_system(metadata.source);
  spec.georeference = place;
  return spec;
}

}  // namespace

RasterKind raster_kind(const std::string& path) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  if (extension == ".tif" || extension == ".tiff") return RasterKind::kTiff;
  if (extension == ".exr") return RasterKind::kExr;
  if (extension == ".png") return RasterKind::kPng;
  if (extension == ".hgt") return RasterKind::kHgt;
  if (extension == ".asc") return RasterKind::kAsc;
  if (extension == ".flt") return RasterKind::kFlt;
  if (extension == ".r16" || extension == ".raw") return RasterKind::kRaw16;
  if (extension == ".r32") return RasterKind::kRaw32;
  return extension == ".npy" ? RasterKind::kNpy : RasterKind::kOther;
}

bool has_scale(RasterKind kind) {
  return kind == RasterKind::kTiff || kind == RasterKind::kPng || kind == RasterKind::kRaw16 ||
         kind == RasterKind::kRaw32;
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
    case RasterKind::kTiff:
    case RasterKind::kAsc:
    case RasterKind::kNpy:
    case RasterKind::kOther:
      break;
  }
  return source_type;
}

RasterSpec restored_raster(const Metadata& metadata, const OutputGrid& grid, SampleType type) {
  if (grid.degrees) return raster_in_degrees(metadata, grid, type);
  if (!is_warped(metadata)) return raster_in_source_system(metadata, grid.world, type);
  RasterSpec spec = plain_raster(metadata, grid.world, type);
  spec.georeference = map_georeference(metadata, grid.world);
  if (!spec.georeference->system.epsg) spec.projection = metadata.projection->spec;
  return spec;
}

RasterSpec source_raster(const Metadata& metadata, SampleType type) {
  return raster_in_source_system(metadata, source_grid(metadata.source), type);
}

Georeference map_georeference(const Metadata& metadata, const SampleGrid& grid) {
  const SourceRecord& source = metadata.source;
  const ProjectionRecord& on = *metadata.projection;
  Georeference place;
  place.registration = Registration::kArea;
  place.unit = HorizontalUnit::kMetre;
  place.spacing_x = grid.spacing_x;
  place.spacing_y = grid.spacing_z;
  place.has_origin = true;
  place.origin_x = on.origin.easting + grid.first_x;
  place.origin_y = on.origin.northing - grid.first_z;
  // A map's own code and name are none of degrees.
  const bool in_degrees = horizontal_unit(source) == HorizontalUnit::kDegree;
  place.system.epsg = projection_epsg(on.spec, in_degrees ? source.crs_epsg : std::nullopt);
  place.system.name = describe_projection(on.spec);
  if (!place.system.epsg) place.system.wkt = projection_wkt(on.spec, in_degrees ? source.crs_name : "");
  place.system.body = source.body;
  place.system.semi_major_axis_m = on.spec.ellipsoid.semi_major_axis_m;
  place.system.inverse_flattening = on.spec.ellipsoid.inverse_flattening;
  place.system.vertical_datum = source.vertical_datum;
  place.system.vertical_epsg = source.vertical_epsg;
  return place;
}

bool samples_are_areas(const Metadata& metadata) {
  return is_warped(metadata) || metadata.source.registration == Registration::kArea;
}

SampleGrid natural_grid(const Metadata& metadata) {
  if (!is_warped(metadata)) return source_grid(metadata.source);
  const WorldBounds& ground = metadata.valid;
  SampleGrid grid;
  // One area for one of the source's, in the middle of its ground.
  grid.spacing_x = grid.spacing_z = std::sqrt(metadata.source.spacing_x * metadata.source.spacing_z);
  grid.width = std::max(std::llround((ground.x1 - ground.x0) / grid.spacing_x), 1LL);
  grid.height = std::max(std::llround((ground.z1 - ground.z0) / grid.spacing_z), 1LL);
  grid.first_x = ground.x0 + grid.spacing_x / 2.0;
  grid.first_z = ground.z0 + grid.spacing_z / 2.0;
  return grid;
}

HorizontalUnit horizontal_unit(const SourceRecord& source) {
  if (source.crs_unit == "metre") return HorizontalUnit::kMetre;
  return source.crs_unit == "degree" ? HorizontalUnit::kDegree : HorizontalUnit::kUnknown;
}

ReferenceSystem horizontal_system(const SourceRecord& source) {
  ReferenceSystem system;
  system.name = source.crs_name;
  system.epsg = source.crs_epsg;
  system.wkt = source.crs_wkt;
  system.body = source.body;
  system.semi_major_axis_m = source.semi_major_axis_m;
  system.inverse_flattening = source.inverse_flattening;
  return system;
}

bool needs_void(const Metadata& metadata, const OutputGrid& grid, const std::string& output) {
  return grid.degrees || may_have_voids(metadata, grid.world) || raster_kind(output) == RasterKind::kHgt;
}

void set_mapping(RasterSpec& spec, const SampleMapping& mapping, std::optional<double> void_value) {
  spec.z_scale = mapping.z_scale;
  spec.z_offset = mapping.z_offset;
  if (void_value && !std::isnan(*void_value)) spec.void_value = void_value;
}

void warn_of_lost_scale(const std::string& output, const SampleMapping& mapping) {
  if ((mapping.z_scale == 1.0 && mapping.z_offset == 0.0) || has_scale(raster_kind(output))) return;
  print_warning(loss(fmt::format("{}: has no place for what its raw numbers mean: elevation = raw * {} + {}", output,
                                 mapping.z_scale, mapping.z_offset)));
}

}  // namespace isohf::cli
