#include "reading/place.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "isohf/restore/ground_scale.h"

namespace isohf::view {
namespace {

using nlohmann::ordered_json;

constexpr int kProfilePoints = 256;

double rounded(double value, int decimals) {
  const double unit = std::pow(10.0, decimals);
  return std::round(value * unit) / unit + 0.0;
}

/// Seven digits, or all of a number that is longer.
std::string plain(double value) {
  return std::abs(value) < 1e7 ? fmt::format("{:.7g}", value) : fmt::format("{:.0f}", value);
}

}  // namespace

std::vector<std::string> lines_of(const Place& place) {
  std::vector<std::string> lines{"x " + plain(place.at.x) + "  z " + plain(place.at.z)};
  const std::string unit = place.unit.empty() ? "" : " " + short_unit(place.unit);
  lines.back() += fmt::format("  elevation {:.{}f}{}", rounded(place.elevation, place.decimals), place.decimals, unit);
  if (place.map) lines.push_back(fmt::format("E {:.2f}  N {:.2f}", place.map->easting, place.map->northing));
  if (place.geo) {
    const double east = place.geo->longitude;
    const double north = place.geo->latitude;
    lines.push_back(fmt::format("{:.6f} {}  {:.6f} {}", std::abs(north), north < 0.0 ? 'S' : 'N', std::abs(east),
                                east < 0.0 ? 'W' : 'E'));
  }
  return lines;
}

ordered_json json_of(const Place& place) {
  ordered_json json{{"x", place.at.x}, {"z", place.at.z}, {"elevation", place.elevation}};
  json["unit"] = place.unit.empty() ? ordered_json(nullptr) : ordered_json(place.unit);
  if (place.map) json["map"] = {place.map->easting, place.map->northing};
  if (place.geo) json["longitude"] = place.geo->longitude;
  if (place.geo) json["latitude"] = place.geo->latitude;
  return json;
}

double distance_between(const TileSource& source, WorldPoint from, WorldPoint to) {
  const Place first = source.describe(from, 0.0);
  const Place second = source.describe(to, 0.0);
  const bool is_known = source.metadata() != nullptr && source.ground_unit() == "metre" && first.geo && second.geo &&
                        !std::isnan(first.geo->latitude + second.geo->latitude);
  return is_known ? ground_distance_m(*source.metadata(), *first.geo, *second.geo)
                  : std::hypot(to.x - from.x, to.z - from.z);
}

Profile profile_between(const TileSource& source, Ground& ground, WorldPoint from, WorldPoint to) {
  Profile profile;
  profile.length = distance_between(source, from, to);
  for (int i = 0; i < kProfilePoints; ++i) {
    const double share = i / (kProfilePoints - 1.0);
    const WorldPoint at{from.x + share * (to.x - from.x), from.z + share * (to.z - from.z)};
    const auto height = ground.height(at);
    profile.heights.push_back(height ? *height / source.world_per_elevation()
                                     : std::numeric_limits<double>::quiet_NaN());
  }
  return profile;
}

}  // namespace isohf::view
