#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "isohf/archive/metadata_json.h"
#include "isohf/error.h"
#include "isohf/metadata.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

/// Reads the members of one JSON object and names them in errors.
class ObjectReader {
 public:
  ObjectReader(const Json& object, std::string where) : object_(&object), where_(std::move(where)) {
    if (!object.is_object()) refuse_metadata(where_, "is no object");
  }

  [[nodiscard]] ObjectReader object(const char* key) const { return {required(key), path(key)}; }

  [[nodiscard]] std::string text(const char* key) const {
    const Json& value = required(key);
    if (!value.is_string()) refuse_metadata(path(key), "is no string");
    return value.get<std::string>();
  }

  [[nodiscard]] double number(const char* key) const {
    const Json& value = required(key);
    if (!value.is_number()) refuse_metadata(path(key), "is no number");
    const auto result = value.get<double>();
    if (!std::isfinite(result)) refuse_metadata(path(key), "is not finite");
    return result;
  }

  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t least = 0,
                                     std::int64_t most = std::numeric_limits<std::int64_t>::max()) const {
    const Json& value = required(key);
    if (!value.is_number_integer()) refuse_metadata(path(key), "is no whole number");
    if (value.is_number_unsigned() &&
        value.get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      refuse_metadata(path(key), fmt::format("is {}, too large", value.get<std::uint64_t>()));
    }
    const auto result = value.get<std::int64_t>();
    if (result < least || result > most)
      refuse_metadata(path(key), fmt::format("is {}, must lie in {}..{}", result, least, most));
    return result;
  }

  /// null and an absent member both mean "not known".
  [[nodiscard]] bool has(const char* key) const {
    const auto found = object_->find(key);
    return found != object_->end() && !found->is_null();
  }
  [[nodiscard]] std::optional<double> optional_number(const char* key) const {
    return has(key) ? std::optional(number(key)) : std::nullopt;
  }
  [[nodiscard]] std::optional<int> optional_code(const char* key) const {
    if (!has(key)) return std::nullopt;
    return static_cast<int>(integer(key, 0, std::numeric_limits<int>::max()));
  }
  [[nodiscard]] bool optional_flag(const char* key) const {
    if (!has(key)) return false;
    const Json& value = required(key);
    if (!value.is_boolean()) refuse_metadata(path(key), "is neither true nor false");
    return value.get<bool>();
  }
  [[nodiscard]] std::optional<std::pair<double, double>> optional_range(const char* key) const {
    if (!has(key)) return std::nullopt;
    const Json& range = required(key);
    const bool is_pair = range.is_array() && range.size() == 2 && range[0].is_number() && range[1].is_number();
    if (!is_pair) refuse_metadata(path(key), "is no array of two numbers");
    return std::pair(range[0].get<double>(), range[1].get<double>());
  }
  [[nodiscard]] std::string optional_text(const char* key) const { return has(key) ? text(key) : std::string(); }

  [[nodiscard]] const Json& required(const char* key) const {
    const auto found = object_->find(key);
    if (found == object_->end()) refuse_metadata(path(key), "is missing");
    return *found;
  }
  [[nodiscard]] std::string path(const char* key) const { return where_.empty() ? key : where_ + "." + key; }

 private:
  const Json* object_;
  std::string where_;
};

/// Archives of the first builds have none.
void voids_from_json(const ObjectReader& json, SourceRecord& source) {
  if (!json.has("voids")) return;
  const ObjectReader voids = json.object("voids");
  const auto number = [&](const Json& value) {
    if (value.is_number()) return value.get<double>();
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    if (text == "nan") return std::numeric_limits<double>::quiet_NaN();
    if (text == "inf" || text == "-inf") return text == "inf" ? HUGE_VAL : -HUGE_VAL;
    refuse_metadata(voids.path("values"), "holds something that is no number");
  };
  if (!voids.required("values").is_array()) refuse_metadata(voids.path("values"), "is no array");
  for (const Json& value : voids.required("values")) source.void_values.push_back(number(value));
  source.fill_distance = voids.integer("fill_distance", 0, std::numeric_limits<std::int32_t>::max());
  source.valid_range = voids.optional_range("valid_range");
}

MosaicRecord mosaic_from_json(const ObjectReader& json) {
  MosaicRecord mosaic;
  mosaic.files = json.integer("files");
  const Json& names = json.required("names");
  if (!names.is_array()) refuse_metadata(json.path("names"), "is no array");
  for (const Json& name : names) {
    if (!name.is_string()) refuse_metadata(json.path("names"), "holds something that is no string");
    mosaic.first_names.push_back(name.get<std::string>());
  }
  mosaic.names_sha256 = json.text("names_sha256");
  mosaic.overlap = json.text("overlap");
  return mosaic;
}

MapGround ground_from_json(const ObjectReader& json) {
  MapGround ground;
  const auto place = [](const ObjectReader& at) { return GeoPoint{at.number("longitude"), at.number("latitude")}; };
  ground.centre = place(json.object("centre"));
  const ObjectReader bounds = json.object("bounds");
  ground.extent = {bounds.number("west"), bounds.number("south"), bounds.number("east"), bounds.number("north")};
  const ObjectReader scale = json.object("map_scale");
  ground.mean_scale = scale.number("mean");
  ground.least_scale = scale.number("least");
  ground.most_scale = scale.number("most");
  ground.worst_error = scale.number("worst_error");
  ground.worst_place = place(scale);
  return ground;
}

/// Archives of the first builds have none.
void options_from_json(const ObjectReader& json, SourceRecord& source) {
  if (!json.has("options")) return;
  const Json& options = json.required("options");
  if (!options.is_object()) refuse_metadata(json.path("options"), "is no object");
  source.options.emplace();
  for (const auto& [name, value] : options.items()) {
    if (!value.is_string()) refuse_metadata(json.path("options"), "holds something that is no string");
    source.options->emplace_back(name, value.get<std::string>());
  }
}

SourceRecord source_from_json(const ObjectReader& json) {
  SourceRecord source;
  source.name = json.text("name");
  source.format = json.text("format");
  source.width = json.integer("width");
  source.height = json.integer("height");
  source.sample_type = json.text("sample_type");
  source.channel = json.optional_text("channel");
  source.z_scale = json.optional_number("z_scale").value_or(1.0);
  source.z_offset = json.optional_number("z_offset").value_or(0.0);
  voids_from_json(json, source);
  const std::string registration = json.text("registration");
  if (registration == "area") source.registration = Registration::kArea;
  if (registration == "point") source.registration = Registration::kPoint;
  source.first_sample_x = json.object("first_sample").number("x");
  source.first_sample_z = json.object("first_sample").number("z");
  source.spacing_x = json.object("spacing").number("x");
  source.spacing_z = json.object("spacing").number("z");
  const ObjectReader crs = json.object("crs");
  source.crs_name = crs.optional_text("name");
  source.crs_epsg = crs.optional_code("epsg");
  source.crs_wkt = crs.optional_text("wkt");
  source.crs_unit = crs.optional_text("unit");
  source.origin_x = crs.optional_number("origin_x");
  source.origin_y = crs.optional_number("origin_y");
  source.crs_spacing_x = crs.number("spacing_x");
  source.crs_spacing_y = crs.number("spacing_y");
  // Archives of the first builds tell it by the spacings alone.
  const bool is_plain = !json.has("ground") && source.crs_unit == "metre" && source.crs_spacing_x > 0.0;
  source.metres_per_unit =
      crs.optional_number("metres_per_unit").value_or(is_plain ? source.spacing_x / source.crs_spacing_x : 1.0);
  if (json.has("ground")) source.ground = ground_from_json(json.object("ground"));
  const ObjectReader body = json.object("body");
  source.body = body.optional_text("name");
  source.semi_major_axis_m = body.optional_number("semi_major_axis_m");
  source.inverse_flattening = body.optional_number("inverse_flattening");
  const ObjectReader datum = json.object("vertical_datum");
  source.vertical_datum = datum.optional_text("name");
  source.vertical_epsg = datum.optional_code("epsg");
  options_from_json(json, source);
  if (json.has("mosaic")) source.mosaic = mosaic_from_json(json.object("mosaic"));
  return source;
}

std::optional<ProjectionRecord> projection_from_json(const ObjectReader& root) {
  if (!root.has("projection")) return std::nullopt;
  const ObjectReader json = root.object("projection");
  ProjectionRecord record;
  ProjectionSpec& spec = record.spec;
  try {
    spec.kind = projection_kind_from_string(json.text("kind"));
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kCorrupt) throw;
    refuse_metadata(json.path("kind"), error.what());
  }
  if (spec.kind == ProjectionKind::kNone) refuse_metadata(json.path("kind"), "is none; the member must then be null");
  spec.ellipsoid = {json.number("semi_major_axis_m"), json.number("inverse_flattening")};
  if (!(spec.ellipsoid.semi_major_axis_m > 0.0)) refuse_metadata(json.path("semi_major_axis_m"), "must be above 0");
  const double inverse = spec.ellipsoid.inverse_flattening;
  if (inverse != 0.0 && !(inverse > 1.0)) refuse_metadata(json.path("inverse_flattening"), "must be 0 or above 1");
  spec.longitude_0 = json.number("longitude_0");
  spec.latitude_0 = json.number("latitude_0");
  spec.parallel_1 = json.number("parallel_1");
  spec.parallel_2 = json.number("parallel_2");
  spec.scale_0 = json.number("scale_0");
  spec.false_easting = json.number("false_easting");
  spec.false_northing = json.number("false_northing");
  if (json.has("utm_zone")) spec.utm_zone = static_cast<int>(json.integer("utm_zone", -60, 60));
  const ObjectReader origin = json.object("origin");
  record.origin = {origin.number("easting"), origin.number("northing")};
  const ObjectReader worst = json.object("worst_scale_error");
  record.worst_scale_error = worst.optional_number("error").value_or(std::numeric_limits<double>::infinity());
  record.worst_place = {worst.number("longitude"), worst.number("latitude")};
  record.why = json.optional_text("why");
  return record;
}

Statistics statistics_from_json(const ObjectReader& json) {
  Statistics statistics;
  statistics.min = json.optional_number("min");
  statistics.max = json.optional_number("max");
  statistics.mean = json.optional_number("mean");
  statistics.vertices = json.integer("vertices");
  statistics.voids = json.integer("voids");
  statistics.clamped = json.integer("clamped");
  statistics.worst_rounding = json.number("worst_rounding");
  return statistics;
}

TileGrid grid_from_json(const ObjectReader& root) {
  const ObjectReader shape = root.object("tile_shape");
  const auto columns = static_cast<int>(shape.integer("columns", 0, kMaxTileColumns));
  const auto rows = static_cast<int>(shape.integer("rows", 0, kMaxTileRows));
  const auto levels = static_cast<int>(shape.integer("levels", 0, 99));
  if (const std::string why = TileShape::why_invalid(columns, rows, levels); !why.empty())
    refuse_metadata("tile_shape", why);
  const ObjectReader tiles = root.object("tiles");
  const ObjectReader extent = root.object("extent");
  try {
    return TileGrid::make(TileShape::make(columns, rows, levels), tiles.integer("columns"), tiles.integer("rows"),
                          extent.number("x"), extent.number("z"));
  } catch (const Error& error) {
    throw Error(ErrorCode::kCorrupt, fmt::format("metadata: {}", error.what()));
  }
}

Quantisation quantisation_from_json(const ObjectReader& root) {
  const ObjectReader samples = root.object("samples");
  Quantisation quantisation;
  try {
    quantisation.type = code_type_from_string(samples.text("type"));
  } catch (const Error& error) {
    refuse_metadata(samples.path("type"), error.what());
  }
  quantisation.offset = samples.number("offset");
  quantisation.scale = samples.number("scale");
  if (!(quantisation.scale > 0.0)) refuse_metadata(samples.path("scale"), "must be above 0");
  if (quantisation.type == CodeType::kF32 && (quantisation.offset != 0.0 || quantisation.scale != 1.0)) {
    refuse_metadata("samples", "offset and scale of f32 must be 0 and 1");
  }
  return quantisation;
}

void check_version(const ObjectReader& root) {
  if (const std::string format = root.text("format"); format != kFormatName) {
    refuse_metadata("format", fmt::format("is \"{}\", must be \"{}\"", format, kFormatName));
  }
  const std::int64_t version = root.integer("version", 1);
  if (version != kFormatVersion) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("metadata: format version {}; this build reads version {}", version, kFormatVersion));
  }
}

std::string checked_hash(const ObjectReader& root) {
  std::string hash = root.text("content_sha256");
  const bool is_hex = hash.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (hash.size() != 64 || !is_hex) refuse_metadata("content_sha256", "is no 64 lower-case hexadecimal digits");
  return hash;
}

/// Holds every number that arithmetic is done with against the range in which that arithmetic works, and the place of
/// the source against the tiles that were made of it.
void check_ranges(const Metadata& metadata) {
  const auto require = [](bool holds, const char* where, double found, const std::string& wanted) {
    if (!holds) refuse_metadata(where, fmt::format("is {}, must {}", found, wanted));
  };
  const Quantisation& codes = metadata.quantisation;
  require(std::isfinite(codes.offset + codes.scale * 65535.0), "samples.scale", codes.scale,
          "not lead beyond all numbers");
  const SourceRecord& source = metadata.source;
  constexpr std::int64_t kMostSamples = std::int64_t{1} << 32U;
  require(source.width <= kMostSamples, "source.width", static_cast<double>(source.width), "be at most 2^32");
  require(source.height <= kMostSamples, "source.height", static_cast<double>(source.height), "be at most 2^32");
  require(source.z_scale != 0.0, "source.z_scale", source.z_scale, "not be 0");
  const auto check_axis = [&](const char* spacing_name, const char* first_name, double spacing, double first,
                              std::int64_t samples, double step, double world) {
    require(spacing >= 1e-9 * step && spacing <= 1e12 * step, spacing_name, spacing,
            fmt::format("lie within 1e-9 and 1e12 lattice steps of {}", step));
    const double last = first + spacing * static_cast<double>(std::max<std::int64_t>(samples - 1, 0));
    require(std::abs(first) <= 1000.0 * world && std::abs(last) <= 1000.0 * world, first_name, first,
            fmt::format("leave all samples near the world of {}", world));
  };
  const TileGrid& grid = metadata.grid;
  check_axis("source.spacing.x", "source.first_sample.x", source.spacing_x, source.first_sample_x, source.width,
             grid.sigma_x(), grid.world_width());
  check_axis("source.spacing.z", "source.first_sample.z", source.spacing_z, source.first_sample_z, source.height,
             grid.sigma_z(), grid.world_height());
  const auto check_extent = [&](const char* where, double low, double high, double world) {
    const double slack = 1e-6 * world;
    require(low >= -slack && low <= high, where, low, "lie in the world, West and North first");
    require(high <= world + slack, where, high, fmt::format("be at most {}, where the tiles end", world));
  };
  check_extent("valid.x0, .x1", metadata.valid.x0, metadata.valid.x1, grid.world_width());
  check_extent("valid.z0, .z1", metadata.valid.z0, metadata.valid.z1, grid.world_height());
  if (!metadata.projection) return;
  const ProjectionSpec& spec = metadata.projection->spec;
  const MapPoint& origin = metadata.projection->origin;
  const auto within = [&](const char* where, double value, double most) {
    require(std::abs(value) <= most, where, value, fmt::format("lie in {} to {}", -most, most));
  };
  within("projection.semi_major_axis_m", spec.ellipsoid.semi_major_axis_m, 1e12);
  within("projection.longitude_0", spec.longitude_0, 1e4);
  within("projection.latitude_0", spec.latitude_0, 90.0);
  within("projection.parallel_1", spec.parallel_1, 90.0);
  within("projection.parallel_2", spec.parallel_2, 90.0);
  require(spec.scale_0 > 0.0 && spec.scale_0 <= 1e3, "projection.scale_0", spec.scale_0, "lie above 0, to 1000");
  within("projection.false_easting", spec.false_easting, 1e15);
  within("projection.false_northing", spec.false_northing, 1e15);
  within("projection.origin.easting", origin.easting, 1e15);
  within("projection.origin.northing", origin.northing, 1e15);
  if (source.crs_unit != "degree") return;
  within("source.crs.origin_x", source.origin_x.value_or(0.0), 1e4);
  within("source.crs.origin_y", source.origin_y.value_or(0.0), 1e4);
  require(source.crs_spacing_x >= 1e-12 && source.crs_spacing_x <= 360.0, "source.crs.spacing_x", source.crs_spacing_x,
          "lie in 1e-12 to 360 degrees, which the projection needs");
  require(source.crs_spacing_y >= 1e-12 && source.crs_spacing_y <= 360.0, "source.crs.spacing_y", source.crs_spacing_y,
          "lie in 1e-12 to 360 degrees, which the projection needs");
}

/// What a name stands for; nullopt where this build does not know it.
template <typename T>
std::optional<T> named(T (*from_string)(const std::string&), const std::string& name) {
  try {
    return from_string(name);
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

Metadata parse_metadata(const std::string& text) {
  const Json json = parse_json<Json>(text);
  const ObjectReader root(json, "");
  check_version(root);
  Metadata metadata(grid_from_json(root));
  metadata.quantisation = quantisation_from_json(root);
  metadata.z_range = root.object("samples").optional_range("range");
  if (metadata.z_range && !(metadata.z_range->first <= metadata.z_range->second)) {
    refuse_metadata("samples.range", "is not the smaller number first");
  }
  metadata.tiles_stored = root.object("tiles").integer("stored", 0, metadata.grid.tile_count());
  metadata.horizontal_unit = root.object("units").text("horizontal");
  metadata.vertical_unit = root.object("units").text("vertical");
  const ObjectReader valid = root.object("valid");
  metadata.valid = {valid.number("x0"), valid.number("z0"), valid.number("x1"), valid.number("z1")};
  metadata.outside = named(outside_from_string, root.text("outside"));
  metadata.projection = projection_from_json(root);
  metadata.wraps_x = root.optional_flag("wraps_x");
  metadata.filter = named(filter_from_string, root.text("filter"));
  if (root.has("edges")) metadata.edges = named(edges_from_string, root.text("edges"));
  metadata.acquisition = named(acquisition_from_string, root.text("acquisition"));
  if (root.has("level")) metadata.level = static_cast<int>(root.integer("level", 1, 12));
  metadata.source = source_from_json(root.object("source"));
  metadata.statistics = statistics_from_json(root.object("statistics"));
  const Json& textures = root.required("textures");
  if (!textures.is_array()) refuse_metadata("textures", "is no array");
  for (const Json& texture : textures) {
    if (!texture.is_string()) refuse_metadata("textures", "holds something that is no string");
    metadata.textures.push_back(texture.get<std::string>());
  }
  metadata.content_sha256 = checked_hash(root);
  metadata.producer = root.text("producer");
  check_ranges(metadata);
  for (const auto& [name, value] : json.items()) {
    if (!is_format_member(name)) metadata.extensions.emplace_back(name, value.dump());
  }
  return metadata;
}

}  // namespace isohf
