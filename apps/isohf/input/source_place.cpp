#include "input/source_place.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/georeference/reference_system.h"
#include "isohf/archive/metadata/cut_record.h"
#include "isohf/error.h"
#include "isohf/surface.h"
#include "options/describe.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

/// Of a source in degrees: what it says, longitudes of the centre within half a turn.
MapGround ground_in_degrees(const MapBounds& bounds) {
  MapGround ground;
  ground.extent = {bounds.west, bounds.south, bounds.east, bounds.north};
  const MapPoint middle = bounds.middle();
  ground.centre = {std::remainder(middle.easting, 360.0), middle.northing};
  return ground;
}

}  // namespace

std::optional<SourcePlace> source_place(const Georeference& place, std::int64_t width, std::int64_t height,
                                        bool is_area, const std::optional<MapGround>& stored) {
  if (!place.has_origin) return std::nullopt;
  const double margin = is_area ? 0.5 : 0.0;
  SourcePlace found;
  found.unit = place.unit;
  found.bounds = {place.origin_x - margin * place.spacing_x,
                  place.origin_y - (static_cast<double>(height - 1) + margin) * place.spacing_y,
                  place.origin_x + (static_cast<double>(width - 1) + margin) * place.spacing_x,
                  place.origin_y + margin * place.spacing_y};
  if (place.unit == HorizontalUnit::kDegree) {
    found.ground = ground_in_degrees(found.bounds);
    return found;
  }
  const std::string text = system_text(place.system);
  found.has_map_scale = true;
  if (stored) {
    found.ground = stored;
  } else if (place.unit == HorizontalUnit::kMetre && !text.empty()) {
    try {
      found.ground = ground_under(*understand_map(text, place.metres_per_unit), found.bounds);
      if (!found.ground) found.why_no_ground = "the reference system shows no place there";
    } catch (const Error& error) {
      found.why_no_ground = error.what();
    }
  }
  return found;
}

std::optional<SourcePlace> source_place(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  if (is_cut(metadata) && !is_warped(metadata)) {
    const SampleGrid grid = natural_grid(metadata);
    const auto there = grid_georeference(metadata, grid);
    if (!there) return std::nullopt;
    return source_place(*there, grid.width, grid.height, source.registration == Registration::kArea, std::nullopt);
  }
  Georeference place = source_georeference(source);
  place.has_origin = place.has_origin && source.crs_spacing_x > 0.0 && source.crs_spacing_y > 0.0;
  return source_place(place, source.width, source.height, source.registration == Registration::kArea, source.ground);
}

std::string text_from(const SourcePlace& place) {
  std::string text;
  const auto say = [&](const char* what, const std::string& value) { text += fmt::format("{:<12} {}\n", what, value); };
  const MapBounds& bounds = place.bounds;
  say("bounds", fmt::format("{:.12g} to {:.12g} East, {:.12g} to {:.12g} North", bounds.west, bounds.east, bounds.south,
                            bounds.north));
  const MapPoint middle = bounds.middle();
  say("centre", fmt::format("{:.12g} East, {:.12g} North", middle.easting, middle.northing));
  if (!place.has_map_scale) return text;
  if (place.ground) {
    const GeoExtent& extent = place.ground->extent;
    const GeoPoint& centre = place.ground->centre;
    const std::string longitudes = extent.east - extent.west > 360.0 - 1e-6
                                       ? "all longitudes"
                                       : fmt::format("longitude {:.9g} to {:.9g}", extent.west, extent.east);
    say("lon/lat",
        fmt::format("{}, latitude {:.9g} to {:.9g}", longitudes, extent.south, extent.north) +
            (std::isfinite(centre.longitude) ? fmt::format("; centre {:.9g}, {:.9g}", centre.longitude, centre.latitude)
                                             : std::string()));
    say("map scale", describe_map_scale(*place.ground));
  } else if (!place.why_no_ground.empty()) {
    say("lon/lat", "not known: " + place.why_no_ground);
  }
  return text;
}

void add_source_place(const std::optional<SourcePlace>& place, ordered_json& json) {
  for (const char* member : {"bounds", "centre", "lonlat", "map_scale"}) json[member] = nullptr;
  if (!place) return;
  const MapBounds& bounds = place->bounds;
  json["bounds"] = {{"west", bounds.west}, {"south", bounds.south}, {"east", bounds.east}, {"north", bounds.north}};
  json["centre"] = {{"x", bounds.middle().easting}, {"y", bounds.middle().northing}};
  if (!place->ground) return;
  ordered_json ground = ordered_json::parse(format_ground(*place->ground));
  json["lonlat"] = {{"bounds", ground["bounds"]}, {"centre", ground["centre"]}};
  if (place->has_map_scale) json["map_scale"] = ground["map_scale"];
}

}  // namespace isohf::cli
