#include "restored_raster.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "isohf/base/error.h"
#include "isohf/convert/plan.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/archive_geometry.h"

namespace isohf::cli {
namespace {

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

HorizontalUnit unit_of(const std::string& name) {
  if (name == "metre") return HorizontalUnit::kMetre;
  return name == "degree" ? HorizontalUnit::kDegree : HorizontalUnit::kUnknown;
}

RasterSpec plain_raster(const Metadata& metadata, const SampleGrid& grid, SampleType type) {
  RasterSpec spec;
  spec.width = grid.width;
  spec.height = grid.height;
  spec.sample_type = type;
  spec.describe = true;
  if (metadata.vertical_unit != "unknown") spec.vertical_unit = metadata.vertical_unit;
  return spec;
}

/// By the source's place, for grids whose rows are its rows.
RasterSpec raster_in_source_system(const Metadata& metadata, const SampleGrid& grid, SampleType type) {
  const SourceRecord& source = metadata.source;
  RasterSpec spec = plain_raster(metadata, grid, type);
  Georeference place;
  place.registration = source.registration == "area" ? Registration::kArea : Registration::kPoint;
  place.unit = unit_of(source.crs_unit);
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
  place.system = horizontal_system(source);
  place.system.vertical_datum = source.vertical_datum;
  place.system.vertical_epsg = source.vertical_epsg;
  // Without a position a point of unit spacing is what a raster that says nothing is taken for.
  const bool has_spacing = place.spacing_x != 1.0 || place.spacing_y != 1.0;
  if (place.has_origin || has_spacing || place.registration == Registration::kArea) spec.georeference = place;
  return spec;
}

}  // namespace

RasterKind raster_kind(const std::string& path) {
  const std::string extension = extension_of(path);
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

RasterSpec restored_raster(const Metadata& metadata, const SampleGrid& grid, SampleType type) {
  if (!is_warped(metadata)) return raster_in_source_system(metadata, grid, type);
  RasterSpec spec = plain_raster(metadata, grid, type);
  spec.georeference = map_georeference(metadata, grid);
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
  place.system.epsg = projection_epsg(on.spec, source.crs_epsg);
  place.system.name = describe_projection(on.spec);
  if (!place.system.epsg) place.system.wkt = projection_wkt(on.spec, source.crs_name);
  place.system.body = source.body;
  place.system.semi_major_axis_m = on.spec.ellipsoid.semi_major_axis_m;
  place.system.inverse_flattening = on.spec.ellipsoid.inverse_flattening;
  place.system.vertical_datum = source.vertical_datum;
  place.system.vertical_epsg = source.vertical_epsg;
  return place;
}

bool samples_are_areas(const Metadata& metadata) {
  return is_warped(metadata) || metadata.source.registration == "area";
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

WorldBounds world_bounds(const Metadata& metadata, double west, double south, double east, double north) {
  const SourceRecord& source = metadata.source;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    throw Error(ErrorCode::kInvalidArgument, "the archive does not say where its source lay; coordinates mean nothing");
  }
  if (is_warped(metadata)) {
    const ProjectionRecord& on = *metadata.projection;
    const MapBounds map = projected_bounds(Projection(on.spec), {west, south, east, north});
    if (!std::isfinite(map.west)) {
      throw Error(ErrorCode::kInvalidArgument, "the archive's map has no place for a part of that");
    }
    return {map.west - on.origin.easting, on.origin.northing - map.north, map.east - on.origin.easting,
            on.origin.northing - map.south};
  }
  const double to_x = source.spacing_x / source.crs_spacing_x;
  const double to_z = source.spacing_z / source.crs_spacing_y;
  WorldBounds bounds;
  bounds.x0 = source.first_sample_x + (west - *source.origin_x) * to_x;
  bounds.x1 = source.first_sample_x + (east - *source.origin_x) * to_x;
  bounds.z0 = source.first_sample_z + (*source.origin_y - north) * to_z;
  bounds.z1 = source.first_sample_z + (*source.origin_y - south) * to_z;
  return bounds;
}

SampleGrid grid_like(const Metadata& metadata, const SourceInfo& other) {
  const SourceRecord& source = metadata.source;
  const Georeference& place = other.georeference;
  const bool comparable = source.origin_x && source.origin_y && place.has_origin && source.crs_spacing_x > 0.0 &&
                          source.crs_spacing_y > 0.0 && unit_of(source.crs_unit) == place.unit;
  if (!comparable) {
    const SourceFrame frame = make_source_frame(other);
    return {frame.width,
            frame.height,
            metadata.valid.x0 + frame.first_sample_x,
            metadata.valid.z0 + frame.first_sample_z,
            frame.spacing_x,
            frame.spacing_z};
  }
  const double to_x = source.spacing_x / source.crs_spacing_x;
  const double to_z = source.spacing_z / source.crs_spacing_y;
  return {other.width,
          other.height,
          source.first_sample_x + (place.origin_x - *source.origin_x) * to_x,
          source.first_sample_z + (*source.origin_y - place.origin_y) * to_z,
          place.spacing_x * to_x,
          place.spacing_y * to_z};
}

}  // namespace isohf::cli
