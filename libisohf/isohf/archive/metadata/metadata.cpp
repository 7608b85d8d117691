#include "isohf/metadata.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>

#include "isohf/archive/metadata/json_members.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Json = JsonMembers::Json;

constexpr const char* kFormatName = "isohf";
constexpr JsonRule kNull{.presence = JsonRule::kNull};
constexpr JsonRule kAbsent{.presence = JsonRule::kAbsent};

JsonRule within(double most) {
  return {.least = -most, .most = most};
}

// --- what metadata consist of, in the order in which it is written ---

/// What an archive may require of its readers and this build knows.
constexpr const char* kProjectionSystem = "projection-system";
constexpr std::array<std::string_view, 1> kKnownRequirements{kProjectionSystem};

bool is_on_system(const Metadata& metadata) {
  return metadata.projection && metadata.projection->spec.kind == ProjectionKind::kSystem;
}

void version_members(JsonMembers& json, const Metadata& metadata) {
  std::string format = kFormatName;
  json("format", format);
  if (format != kFormatName) json.refuse("format", fmt::format("is \"{}\", must be \"{}\"", format, kFormatName));
  int version = kFormatVersion;
  json("version", version, {.least = 1});
  if (version != kFormatVersion) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("metadata: format version {}; this build reads version {}", version, kFormatVersion));
  }
  std::optional<std::vector<std::string>> requirements;
  if (!json.reads() && is_on_system(metadata)) requirements = {kProjectionSystem};
  json("requires", requirements, kAbsent);
  for (const std::string& name : requirements.value_or(std::vector<std::string>{})) {
    if (std::find(kKnownRequirements.begin(), kKnownRequirements.end(), name) != kKnownRequirements.end()) continue;
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("metadata: the archive requires \"{}\" of its readers, which this build does not know", name));
  }
}

/// How a stored elevation follows from the source's surface: "point" is its elevation at the vertex, and the default.
void height_members(JsonMembers& json) {
  constexpr const char* kPoint = "point";
  std::optional<std::string> heights;
  json("heights", heights, kAbsent);
  if (heights.value_or(kPoint) == kPoint) return;
  throw Error(ErrorCode::kUnsupported, fmt::format("metadata: heights: \"{}\" is not known to this build", *heights));
}

void plane_members(JsonMembers& json, PlaneInfo& planes) {
  json("stride", planes.stride, {.least = 2, .most = 1 << (kMaxTileLevels - 1)});
  json("count", planes.count, {.least = 1, .most = 24});
}

/// The planes of a grid: until one tile is left at most, and no vertex of theirs between two of the tiles below.
void check_planes(const JsonMembers& json, const TileGrid& grid, const PlaneInfo& planes) {
  const TileShape& shape = grid.shape();
  const auto refuse = [&](const char* member, const std::string& why) {
    refuse_metadata(std::string("planes.") + member, why);
  };
  const int stride = planes.stride;
  if ((stride & (stride - 1)) != 0 || shape.cell_columns() % stride != 0 || shape.cell_rows() / 2 % stride != 0) {
    refuse("stride", fmt::format("is {}, must be a power of two that divides C-4 = {} and (R-3)/2 = {}", stride,
                                 shape.cell_columns(), shape.cell_rows() / 2));
  }
  std::int64_t most = std::max(grid.tile_columns(), grid.tile_rows());
  double extent = std::max(grid.extent_x(), grid.extent_z());
  for (int plane = 1; plane <= planes.count; ++plane, most = (most + stride - 1) / stride, extent *= stride) {
    if (most == 1) refuse("count", fmt::format("is {}, but plane {} has one tile", planes.count, plane - 1));
  }
  if (!(extent <= kMaxExtent)) json.refuse("extent", "is too wide for the planes' tiles");
}

void grid_members(JsonMembers& json, TileGrid& grid, std::int64_t& tiles_stored) {
  int columns = grid.shape().columns();
  int rows = grid.shape().rows();
  int levels = grid.shape().levels();
  json.object("tile_shape", [&](JsonMembers& shape) {
    shape("columns", columns, {.most = kMaxTileColumns});
    shape("rows", rows, {.most = kMaxTileRows});
    shape("levels", levels, {.most = 99});
  });
  if (const std::string why = TileShape::why_invalid(columns, rows, levels); !why.empty())
    json.refuse("tile_shape", why);
  std::int64_t tile_columns = grid.tile_columns();
  std::int64_t tile_rows = grid.tile_rows();
  json.object("tiles", "columns", tile_columns, "rows", tile_rows, "stored", tiles_stored);
  double extent_x = grid.extent_x();
  double extent_z = grid.extent_z();
  json.object("extent", "x", extent_x, "z", extent_z);
  if (!json.reads()) return;
  try {
    grid = TileGrid::make(TileShape::make(columns, rows, levels), tile_columns, tile_rows, extent_x, extent_z);
  } catch (const Error& error) {
    throw Error(ErrorCode::kCorrupt, fmt::format("metadata: {}", error.what()));
  }
  if (tiles_stored > grid.tile_count())
    json.refuse("tiles.stored", fmt::format("is {}, must lie in 0..{}", tiles_stored, grid.tile_count()));
}

/// Follows from shape and extent; written down for people.
void lattice_members(JsonMembers& json, const TileGrid& grid) {
  const Json number = {{"type", "number"}};
  json.object("lattice", [&](JsonMembers& lattice) {
    lattice.object("origin", [&](JsonMembers& origin) {
      origin.derived("x", 0.0, number);
      origin.derived("z", 0.0, number);
    });
    lattice.derived("column_step", 2.0 * grid.sigma_x(), number);
    lattice.derived("row_step", grid.sigma_z(), number);
    lattice.derived("odd_row_shift", grid.sigma_x(), number);
  });
}

void sample_members(JsonMembers& json, Metadata& metadata) {
  Quantisation& codes = metadata.quantisation;
  json.name("type", codes.type, code_type_from_string);
  json("offset", codes.offset);
  json("scale", codes.scale, {.least = 0.0, .above_least = true});
  const bool is_float = codes.type == CodeType::kF32;
  json.derived("void", is_float ? Json("nan") : Json(codes.void_code()), {{"type", {"string", "integer"}}});
  json("range", metadata.z_range, kAbsent);
  json("rounding", metadata.rounding, {.presence = JsonRule::kAbsent, .least = 0.0, .above_least = true});
  if (is_float && (codes.offset != 0.0 || codes.scale != 1.0))
    refuse_metadata("samples", "offset and scale of f32 must be 0 and 1");
  if (metadata.rounding && (is_float || *metadata.rounding < 0.5 * codes.scale))
    refuse_metadata("samples.rounding", "must be half of the scale or more, and absent for f32");
  if (metadata.z_range && !(metadata.z_range->first <= metadata.z_range->second))
    json.refuse("range", "is not the smaller number first");
}

void system_members(JsonMembers& json, MappedSystem& system) {
  json.all("crs", system.text, "name", system.name, "operation", system.operation);
  json("metres_per_unit", system.metres_per_unit, {.least = 0.0, .most = 1e12, .above_least = true});
}

void projection_members(JsonMembers& json, ProjectionRecord& record) {
  ProjectionSpec& spec = record.spec;
  json.name("kind", spec.kind, projection_kind_from_string);
  if (json.reads() && spec.kind == ProjectionKind::kNone) json.refuse("kind", "is none; the member must then be null");
  json("semi_major_axis_m", spec.ellipsoid.semi_major_axis_m, {.least = 0.0, .most = 1e12, .above_least = true});
  double& inverse = spec.ellipsoid.inverse_flattening;
  json("inverse_flattening", inverse);
  if (inverse != 0.0 && !(inverse > 1.0)) json.refuse("inverse_flattening", "must be 0 or above 1");
  json("longitude_0", spec.longitude_0, within(1e4));
  json("latitude_0", spec.latitude_0, within(90.0));
  json("parallel_1", spec.parallel_1, within(90.0));
  json("parallel_2", spec.parallel_2, within(90.0));
  json("scale_0", spec.scale_0, {.least = 0.0, .most = 1e3, .above_least = true});
  json("false_easting", spec.false_easting, within(1e15));
  json("false_northing", spec.false_northing, within(1e15));
  std::optional<int> zone = spec.utm_zone == 0 ? std::nullopt : std::optional(spec.utm_zone);
  json("utm_zone", zone, {.presence = JsonRule::kNull, .least = -60, .most = 60});
  spec.utm_zone = zone.value_or(0);
  const bool is_system = spec.kind == ProjectionKind::kSystem;
  auto system = is_system ? std::optional(spec.system) : std::nullopt;
  json.object("system", system, system_members, kAbsent);
  if (json.reads() && is_system != system.has_value()) json.refuse("system", "must be there with kind system alone");
  spec.system = system.value_or(MappedSystem{});
  json.object("origin", [&](JsonMembers& origin) {
    origin("easting", record.origin.easting, within(1e15));
    origin("northing", record.origin.northing, within(1e15));
  });
  double& error = record.worst_scale_error;
  std::optional<double> finite = std::isfinite(error) ? std::optional(error) : std::nullopt;
  json.object("worst_scale_error", "error", finite, "longitude", record.worst_place.longitude, "latitude",
              record.worst_place.latitude);
  error = finite.value_or(std::numeric_limits<double>::infinity());
  json("why", record.why);
}

void ground_members(JsonMembers& json, MapGround& ground) {
  GeoExtent& extent = ground.extent;
  json.object("centre", "longitude", ground.centre.longitude, "latitude", ground.centre.latitude);
  json.object("bounds", "west", extent.west, "south", extent.south, "east", extent.east, "north", extent.north);
  json.object("map_scale", "mean", ground.mean_scale, "least", ground.least_scale, "most", ground.most_scale,
              "worst_error", ground.worst_error, "longitude", ground.worst_place.longitude, "latitude",
              ground.worst_place.latitude);
}

void mosaic_members(JsonMembers& json, MosaicRecord& mosaic) {
  json.all("files", mosaic.files, "names", mosaic.first_names, "names_sha256", mosaic.names_sha256, "overlap",
           mosaic.overlap);
}

void source_members(JsonMembers& json, SourceRecord& source) {
  constexpr JsonRule kSamples{.most = 4294967296.0};
  json("name", source.name);
  json("format", source.format);
  json("width", source.width, kSamples);
  json("height", source.height, kSamples);
  json("sample_type", source.sample_type);
  json("channel", source.channel, kNull);
  json("z_scale", source.z_scale);
  json("z_offset", source.z_offset);
  json.object("voids", [&](JsonMembers& voids) {
    voids("values", source.void_values);
    std::optional<std::vector<double>> ends;  // which may be infinite
    if (source.raw_range) ends = {source.raw_range->first, source.raw_range->second};
    voids("raw_range", ends, kAbsent);
    if (voids.reads() && ends) {
      if (ends->size() != 2) voids.refuse("raw_range", "is no array of two numbers");
      source.raw_range = {ends->front(), ends->back()};
      if (!(ends->front() <= ends->back())) voids.refuse("raw_range", "is not the smaller number first");
    }
    voids("valid_range", source.valid_range, kNull);
    voids("fill_distance", source.fill_distance, {.most = std::numeric_limits<std::int32_t>::max()});
  });
  std::string registration = to_string(source.registration);
  json("registration", registration);
  source.registration = registration == "area"    ? Registration::kArea
                        : registration == "point" ? Registration::kPoint
                                                  : Registration::kUnknown;
  std::optional<bool> repeats_column;
  if (!json.reads() && source.repeats_column) repeats_column = true;
  json("repeats_column", repeats_column, kAbsent);
  source.repeats_column = repeats_column.value_or(false);
  json.object("first_sample", "x", source.first_sample_x, "z", source.first_sample_z);
  json.object("spacing", "x", source.spacing_x, "z", source.spacing_z);
  std::optional<double> metres_per_unit;
  if (!json.reads() && source.metres_per_unit != 1.0) metres_per_unit = source.metres_per_unit;
  json.object("crs", [&](JsonMembers& crs) {
    crs("name", source.crs_name, kNull);
    crs("epsg", source.crs_epsg, kNull);
    crs("wkt", source.crs_wkt, kNull);
    crs("unit", source.crs_unit, kNull);
    crs.all("origin_x", source.origin_x, "origin_y", source.origin_y);
    crs.all("spacing_x", source.crs_spacing_x, "spacing_y", source.crs_spacing_y);
    crs("metres_per_unit", metres_per_unit, kAbsent);
  });
  json.object("ground", source.ground, ground_members, kAbsent);
  if (json.reads()) source.metres_per_unit = metres_per_unit.value_or(1.0);
  json.object("body", [&](JsonMembers& body) {
    body("name", source.body, kNull);
    body.all("semi_major_axis_m", source.semi_major_axis_m, "inverse_flattening", source.inverse_flattening);
  });
  json.object("vertical_datum", [&](JsonMembers& datum) {
    datum("name", source.vertical_datum, kNull);
    datum("epsg", source.vertical_epsg, kNull);
  });
  json.object("mosaic", source.mosaic, mosaic_members, kAbsent);
  json("options", source.options, kAbsent);
}

void metadata_members(JsonMembers& json, Metadata& metadata) {
  version_members(json, metadata);
  height_members(json);
  json("producer", metadata.producer);
  grid_members(json, metadata.grid, metadata.tiles_stored);
  auto planes = metadata.planes.count > 0 ? std::optional(metadata.planes) : std::nullopt;
  json.object("planes", planes, plane_members, kAbsent);
  if (json.reads() && planes) check_planes(json, metadata.grid, *planes);
  metadata.planes = planes.value_or(PlaneInfo{});
  if (!json.reads()) lattice_members(json, metadata.grid);
  json.object("samples", [&](JsonMembers& samples) { sample_members(samples, metadata); });
  json.object("units", "horizontal", metadata.horizontal_unit, "vertical", metadata.vertical_unit);
  WorldBounds& valid = metadata.valid;
  json.object("valid", "x0", valid.x0, "z0", valid.z0, "x1", valid.x1, "z1", valid.z1);
  json.object("projection", metadata.projection, projection_members, kNull);
  json("wraps_x", metadata.wraps_x);
  json.name("filter", metadata.filter, filter_from_string);
  json.name("edges", metadata.edges, edges_from_string);
  json.name("acquisition", metadata.acquisition, acquisition_from_string);
  std::optional<int> level = metadata.effort ? std::optional(level_of(*metadata.effort)) : std::nullopt;
  json("level", level, {.presence = JsonRule::kAbsent, .least = 1});
  metadata.effort.reset();
  for (const Effort effort : {Effort::kFast, Effort::kDefault, Effort::kBest}) {
    if (level == level_of(effort)) metadata.effort = effort;
  }
  json.object("source", [&](JsonMembers& source) { source_members(source, metadata.source); });
  Statistics& counted = metadata.statistics;
  json.object("statistics", "min", counted.min, "max", counted.max, "mean", counted.mean, "vertices", counted.vertices,
              "voids", counted.voids, "clamped", counted.clamped, "worst_rounding", counted.worst_rounding);
  json("textures", metadata.textures);
  json("content_sha256", metadata.content_sha256);
  json("ground_sha256", metadata.ground_sha256);
}

Metadata empty_metadata() {
  return Metadata(TileGrid::make(TileShape::make(5, 5, 1), 1, 1, 1.0, 1.0));
}

/// The members that belong to the format, as a JSON Schema; all others are extensions.
const Json& format_members() {
  static const Json schema = [] {
    Json made = {{"properties", Json::object()}, {"required", Json::array()}};
    JsonMembers json(JsonMembers::Pass::kSchema, made, "");
    Metadata metadata = empty_metadata();
    metadata_members(json, metadata);
    return made;
  }();
  return schema;
}

/// A member's name as part of a JSON pointer (RFC 6901).
std::string pointer_to(const std::string& where, const std::string& name) {
  std::string part = where + "/";
  for (const char c : name) part += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return part;
}

/// Takes what `schema` does not know of an object's members: those of the outermost by their names, others by their
/// places.
void take_extensions(const Json& object, const Json& schema, const std::string& where, Metadata& metadata) {
  const Json& known = schema.at("properties");
  for (const auto& [name, value] : object.items()) {
    const auto found = known.find(name);
    if (found == known.end()) {
      const bool by_name = where.empty() && !name.starts_with("/");
      if (by_name || !value.is_null())
        metadata.extensions.emplace_back(by_name ? name : pointer_to(where, name), value.dump());
    } else if (value.is_object() && found->contains("properties")) {
      take_extensions(value, *found, pointer_to(where, name), metadata);
    }
  }
}

/// Puts an extension where it belongs; one whose object is no longer there goes with it.
void put_extension(const std::string& name, const std::string& text, Json& object) {
  if (!name.starts_with("/")) {
    if (format_members()["properties"].contains(name)) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("metadata: extension \"{}\" has a name of the format", name));
    }
    object[name] = parse_json(text);
    return;
  }
  const Json::json_pointer place(name);
  const Json::json_pointer parent = place.parent_pointer();
  if (!object.contains(parent) || !object[parent].is_object() || object.contains(place)) return;
  object[place] = parse_json(text);
}

// --- what members must be beside each other ---

void require(bool holds, const std::string& where, double found, const std::string& wanted) {
  if (!holds) refuse_metadata(where, fmt::format("is {}, must {}", found, wanted));
}

/// One axis of the source and of the ground that it covers, "x" or "z", against the lattice that was made of it.
void check_axis(const std::string& axis, double spacing, double first, std::int64_t samples, double valid_begin,
                double valid_end, double step, double world) {
  require(spacing >= 1e-9 * step && spacing <= 1e12 * step, "source.spacing." + axis, spacing,
          fmt::format("lie within 1e-9 and 1e12 lattice steps of {}", step));
  const double last = first + spacing * static_cast<double>(std::max<std::int64_t>(samples - 1, 0));
  // An archive of one tile may be extracted from one of 2^24.
  constexpr double kMostWorlds = 0x1p25;
  require(std::abs(first) <= kMostWorlds * world && std::abs(last) <= kMostWorlds * world,
          "source.first_sample." + axis, first, fmt::format("leave all samples near the world of {}", world));
  const double slack = 1e-6 * world;
  require(valid_begin >= -slack && valid_begin <= valid_end, "valid." + axis + "0", valid_begin,
          "lie in the world, West and North first");
  require(valid_end <= world + slack, "valid." + axis + "1", valid_end,
          fmt::format("be at most {}, where the tiles end", world));
}

void check_hash(const char* name, const std::string& hash) {
  if (hash.size() != 64 || hash.find_first_not_of("0123456789abcdef") != std::string::npos)
    refuse_metadata(name, "is no 64 lower-case hexadecimal digits");
}

void check(const Metadata& metadata) {
  check_hash("content_sha256", metadata.content_sha256);
  check_hash("ground_sha256", metadata.ground_sha256);
  const Quantisation& codes = metadata.quantisation;
  require(std::isfinite(codes.offset + codes.scale * 65535.0), "samples.scale", codes.scale,
          "not lead beyond all numbers");
  const SourceRecord& source = metadata.source;
  require(source.z_scale != 0.0, "source.z_scale", source.z_scale, "not be 0");
  const TileGrid& grid = metadata.grid;
  const WorldBounds& valid = metadata.valid;
  check_axis("x", source.spacing_x, source.first_sample_x, source.width, valid.x0, valid.x1, grid.sigma_x(),
             grid.world_width());
  check_axis("z", source.spacing_z, source.first_sample_z, source.height, valid.z0, valid.z1, grid.sigma_z(),
             grid.world_height());
  if (!metadata.projection || source.crs_unit != "degree") return;
  for (const double origin : {source.origin_x.value_or(0.0), source.origin_y.value_or(0.0)})
    require(std::abs(origin) <= 1e4, "source.crs.origin", origin, "lie in -10000 to 10000");
  for (const double spacing : {source.crs_spacing_x, source.crs_spacing_y}) {
    require(spacing >= 1e-12 && spacing <= 360.0, "source.crs.spacing", spacing,
            "lie in 1e-12 to 360 degrees, which the projection needs");
  }
}

}  // namespace

std::string to_string(CodeType type) {
  return type == CodeType::kU16 ? "u16" : type == CodeType::kU8 ? "u8" : "f32";
}

int level_of(Effort effort) {
  return effort == Effort::kFast ? 2 : effort == Effort::kDefault ? 5 : 6;
}

CodeType code_type_from_string(const std::string& text) {
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    if (text == to_string(type)) return type;
  }
  throw Error(ErrorCode::kInvalidArgument, fmt::format("sample type is \"{}\", must be u16, u8 or f32", text));
}

std::string format_metadata(const Metadata& metadata) {
  Json object = Json::object();
  JsonMembers json(JsonMembers::Pass::kWrite, object, "");
  Metadata copy = metadata;
  metadata_members(json, copy);
  for (const auto& [name, text] : metadata.extensions) put_extension(name, text, object);
  return text_of(object, 1);
}

Metadata parse_metadata(const std::string& text) {
  Metadata metadata = empty_metadata();
  Json json = parse_json(text);
  if (!json.is_object()) refuse_metadata("", "is no object");
  JsonMembers members(JsonMembers::Pass::kRead, json, "");
  metadata_members(members, metadata);
  check(metadata);
  take_extensions(json, format_members(), "", metadata);
  return metadata;
}

TileGrid Metadata::plane_grid(int plane) const {
  if (plane < 0 || plane > planes.count) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("plane {} is asked for, there are 0 to {}", plane, planes.count));
  }
  std::int64_t columns = grid.tile_columns();
  std::int64_t rows = grid.tile_rows();
  double stride = 1.0;
  for (; plane > 0; --plane, stride *= planes.stride) {
    columns = (columns + planes.stride - 1) / planes.stride;
    rows = (rows + planes.stride - 1) / planes.stride;
  }
  return TileGrid::make(grid.shape(), columns, rows, grid.extent_x() * stride, grid.extent_z() * stride);
}

std::string metadata_schema() {
  Metadata metadata = empty_metadata();
  return schema_of_members([&](JsonMembers& json) { metadata_members(json, metadata); });
}

std::string format_projection(const ProjectionRecord& record) {
  return write_extension(record, projection_members);
}

std::string format_ground(const MapGround& ground) {
  return write_extension(ground, ground_members);
}

}  // namespace isohf
