#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const std::string& member, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, fmt::format("shadow_seeds.{}: {}", member, why));
}

double number(const Json& json, const char* member) {
  if (!json.contains(member) || !json[member].is_number()) refuse(member, "is no number");
  return json[member].get<double>();
}

std::uint64_t count(const Json& json, const char* member) {
  if (!json.contains(member) || !json[member].is_number_unsigned()) refuse(member, "is no whole number");
  return json[member].get<std::uint64_t>();
}

double checked_sun(const char* member, double degrees) {
  if (!(degrees >= kMinSunDeg && degrees < 90.0)) {
    refuse(member, fmt::format("is {}, must be an elevation from {} to below 90", degrees, kMinSunDeg));
  }
  return degrees;
}

}  // namespace

double ShadowSeedInfo::fall_per_half_step(const TileGrid& grid, const Quantisation& quantisation,
                                          double sun_elevation_deg) const {
  const double rise = std::tan(sun_elevation_deg * std::numbers::pi / 180.0);
  return rise * grid.sigma_x() * elevation_units_per_world_unit / quantisation.scale;
}

std::string format_shadow_seed_info(const ShadowSeedInfo& info) {
  Json json;
  if (info.kind == ShadowSeedInfo::Kind::kHulls) {
    json["kind"] = "hulls";
    json["sun_min_deg"] = info.sun_min_deg;
  } else {
    json["kind"] = "angles";
    json["sun_deg"] = info.sun_deg;
  }
  json["directions"] = {"east", "west"};
  json["elevation_units_per_world_unit"] = info.elevation_units_per_world_unit;
  json["members"] = info.members;
  json["bytes"] = info.bytes;
  return json.dump();
}

ShadowSeedInfo parse_shadow_seed_info(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) throw Error(ErrorCode::kCorrupt, "shadow_seeds: is no object");
  ShadowSeedInfo info;
  const std::string kind = json.contains("kind") && json["kind"].is_string() ? json["kind"].get<std::string>() : "";
  if (kind == "hulls") {
    info.sun_min_deg = checked_sun("sun_min_deg", number(json, "sun_min_deg"));
  } else if (kind == "angles") {
    info.kind = ShadowSeedInfo::Kind::kAngles;
    if (!json.contains("sun_deg") || !json["sun_deg"].is_array()) refuse("sun_deg", "is no array");
    for (const Json& angle : json["sun_deg"]) {
      if (!angle.is_number()) refuse("sun_deg", "holds something that is no number");
      info.sun_deg.push_back(checked_sun("sun_deg", angle.get<double>()));
      const std::size_t n = info.sun_deg.size();
      if (n > 1 && info.sun_deg[n - 2] >= info.sun_deg[n - 1]) refuse("sun_deg", "is not in ascending order");
    }
    if (info.sun_deg.empty() || info.sun_deg.size() > kMaxSeedAngles) {
      refuse("sun_deg", fmt::format("has {} angles, must have 1 to {}", info.sun_deg.size(), kMaxSeedAngles));
    }
  } else {
    throw Error(ErrorCode::kUnsupported, fmt::format("shadow_seeds.kind: is \"{}\", hulls and angles are read", kind));
  }
  info.elevation_units_per_world_unit = number(json, "elevation_units_per_world_unit");
  if (!(info.elevation_units_per_world_unit > 0.0 && std::isfinite(info.elevation_units_per_world_unit))) {
    refuse("elevation_units_per_world_unit", "must be above 0");
  }
  info.members = static_cast<std::int64_t>(count(json, "members"));
  info.bytes = count(json, "bytes");
  return info;
}

std::optional<ShadowSeedInfo> shadow_seed_info(const Metadata& metadata) {
  for (const auto& [name, text] : metadata.extensions) {
    if (name == kShadowSeedsName) return parse_shadow_seed_info(text);
  }
  return std::nullopt;
}

}  // namespace isohf
