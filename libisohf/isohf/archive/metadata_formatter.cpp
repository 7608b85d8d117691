#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/metadata_json.h"
#include "isohf/error.h"
#include "isohf/metadata.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

/// JSON has no numbers that are not finite.
Json voids_to_json(const SourceRecord& source) {
  Json values = Json::array();
  for (const double value : source.void_values) {
    values.push_back(std::isfinite(value) ? Json(value) : Json(std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf"));
  }
  Json range = nullptr;
  if (source.valid_range) range = {source.valid_range->first, source.valid_range->second};
  return {{"values", values}, {"valid_range", range}, {"fill_distance", source.fill_distance}};
}

Json ground_to_json(const MapGround& ground) {
  const GeoExtent& extent = ground.extent;
  return {{"centre", {{"longitude", ground.centre.longitude}, {"latitude", ground.centre.latitude}}},
          {"bounds", {{"west", extent.west}, {"south", extent.south}, {"east", extent.east}, {"north", extent.north}}},
          {"map_scale",
           {{"mean", ground.mean_scale},
            {"least", ground.least_scale},
            {"most", ground.most_scale},
            {"worst_error", ground.worst_error},
            {"longitude", ground.worst_place.longitude},
            {"latitude", ground.worst_place.latitude}}}};
}

Json source_to_json(const SourceRecord& source) {
  Json json;
  json["name"] = source.name;
  json["format"] = source.format;
  json["width"] = source.width;
  json["height"] = source.height;
  json["sample_type"] = source.sample_type;
  json["channel"] = text_or_null(source.channel);
  json["z_scale"] = source.z_scale;
  json["z_offset"] = source.z_offset;
  json["voids"] = voids_to_json(source);
  json["registration"] = to_string(source.registration);
  json["first_sample"] = {{"x", source.first_sample_x}, {"z", source.first_sample_z}};
  json["spacing"] = {{"x", source.spacing_x}, {"z", source.spacing_z}};
  json["crs"] = {{"name", text_or_null(source.crs_name)}, {"epsg", or_null(source.crs_epsg)},
                 {"wkt", text_or_null(source.crs_wkt)},   {"unit", text_or_null(source.crs_unit)},
                 {"origin_x", or_null(source.origin_x)},  {"origin_y", or_null(source.origin_y)},
                 {"spacing_x", source.crs_spacing_x},     {"spacing_y", source.crs_spacing_y}};
  if (source.metres_per_unit != 1.0) json["crs"]["metres_per_unit"] = source.metres_per_unit;
  if (source.ground) json["ground"] = ground_to_json(*source.ground);
  json["body"] = {{"name", text_or_null(source.body)},
                  {"semi_major_axis_m", or_null(source.semi_major_axis_m)},
                  {"inverse_flattening", or_null(source.inverse_flattening)}};
  json["vertical_datum"] = {{"name", text_or_null(source.vertical_datum)}, {"epsg", or_null(source.vertical_epsg)}};
  if (source.mosaic) {
    json["mosaic"] = {{"files", source.mosaic->files},
                      {"names", source.mosaic->first_names},
                      {"names_sha256", source.mosaic->names_sha256},
                      {"overlap", source.mosaic->overlap}};
  }
  if (source.options) {
    json["options"] = Json::object();
    for (const auto& [name, text] : *source.options) json["options"][name] = text;
  }
  return json;
}

Json projection_to_json(const std::optional<ProjectionRecord>& record) {
  if (!record) return nullptr;
  const ProjectionSpec& spec = record->spec;
  Json json;
  json["kind"] = to_string(spec.kind);
  json["semi_major_axis_m"] = spec.ellipsoid.semi_major_axis_m;
  json["inverse_flattening"] = spec.ellipsoid.inverse_flattening;
  json["longitude_0"] = spec.longitude_0;
  json["latitude_0"] = spec.latitude_0;
  json["parallel_1"] = spec.parallel_1;
  json["parallel_2"] = spec.parallel_2;
  json["scale_0"] = spec.scale_0;
  json["false_easting"] = spec.false_easting;
  json["false_northing"] = spec.false_northing;
  json["utm_zone"] = spec.utm_zone == 0 ? Json(nullptr) : Json(spec.utm_zone);
  json["origin"] = {{"easting", record->origin.easting}, {"northing", record->origin.northing}};
  const double worst = record->worst_scale_error;
  json["worst_scale_error"] = {{"error", std::isfinite(worst) ? Json(worst) : Json(nullptr)},
                               {"longitude", record->worst_place.longitude},
                               {"latitude", record->worst_place.latitude}};
  json["why"] = record->why;
  return json;
}

Json statistics_to_json(const Statistics& statistics) {
  Json json;
  json["min"] = or_null(statistics.min);
  json["max"] = or_null(statistics.max);
  json["mean"] = or_null(statistics.mean);
  json["vertices"] = statistics.vertices;
  json["voids"] = statistics.voids;
  json["clamped"] = statistics.clamped;
  json["worst_rounding"] = statistics.worst_rounding;
  return json;
}

}  // namespace

std::string format_metadata(const Metadata& metadata) {
  const TileGrid& grid = metadata.grid;
  const TileShape& shape = grid.shape();
  const Quantisation& quantisation = metadata.quantisation;
  const bool is_float = quantisation.type == CodeType::kF32;
  Json json;
  json["format"] = kFormatName;
  json["version"] = kFormatVersion;
  json["producer"] = metadata.producer;
  json["tile_shape"] = {{"columns", shape.columns()}, {"rows", shape.rows()}, {"levels", shape.levels()}};
  json["tiles"] = {{"columns", grid.tile_columns()}, {"rows", grid.tile_rows()}, {"stored", metadata.tiles_stored}};
  json["extent"] = {{"x", grid.extent_x()}, {"z", grid.extent_z()}};
  // Follows from shape and extent; written down for people.
  json["lattice"] = {{"origin", {{"x", 0.0}, {"z", 0.0}}},
                     {"column_step", 2.0 * grid.sigma_x()},
                     {"row_step", grid.sigma_z()},
                     {"odd_row_shift", grid.sigma_x()}};
  json["samples"] = {{"type", to_string(quantisation.type)},
                     {"offset", quantisation.offset},
                     {"scale", quantisation.scale},
                     {"void", is_float ? Json("nan") : Json(quantisation.void_code())}};
  if (metadata.z_range) json["samples"]["range"] = {metadata.z_range->first, metadata.z_range->second};
  json["units"] = {{"horizontal", metadata.horizontal_unit}, {"vertical", metadata.vertical_unit}};
  const WorldBounds& valid = metadata.valid;
  json["valid"] = {{"x0", valid.x0}, {"z0", valid.z0}, {"x1", valid.x1}, {"z1", valid.z1}};
  json["outside"] = name_of(metadata.outside);
  json["projection"] = projection_to_json(metadata.projection);
  json["wraps_x"] = metadata.wraps_x;
  json["filter"] = name_of(metadata.filter);
  json["edges"] = name_of(metadata.edges);
  json["acquisition"] = name_of(metadata.acquisition);
  if (metadata.level) json["level"] = *metadata.level;
  json["source"] = source_to_json(metadata.source);
  json["statistics"] = statistics_to_json(metadata.statistics);
  json["textures"] = metadata.textures;
  json["content_sha256"] = metadata.content_sha256;
  for (const auto& [name, text] : metadata.extensions) {
    if (is_format_member(name)) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("metadata: extension \"{}\" has a name of the format", name));
    }
    json[name] = parse_json<Json>(text);
  }
  // Text of unknown encoding (a WKT, a file name) must not make the whole unreadable.
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

std::string format_ground(const MapGround& ground) {
  return ground_to_json(ground).dump();
}

std::string format_projection(const ProjectionRecord& record) {
  return projection_to_json(record).dump();
}

}  // namespace isohf
