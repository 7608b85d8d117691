#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "isohf/archive/metadata/json_members.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/error.h"

namespace isohf {
namespace {

void check_sun(const JsonMembers& json, const char* key, double degrees) {
  if (!(degrees >= kMinSunDeg && degrees < 90.0))
    json.refuse(key, fmt::format("is {}, must be an elevation from {} to below 90", degrees, kMinSunDeg));
}

}  // namespace

double ShadowSeedInfo::fall_per_half_step(const TileGrid& grid, const Quantisation& quantisation,
                                          double sun_elevation_deg) const {
  const double rise = std::tan(sun_elevation_deg * std::numbers::pi / 180.0);
  return rise * grid.sigma_x() * elevation_units_per_world_unit / quantisation.scale;
}

void shadow_seed_members(JsonMembers& json, ShadowSeedInfo& info) {
  constexpr JsonRule kAbsent{.presence = JsonRule::kAbsent};
  std::string kind = info.kind == ShadowSeedInfo::Kind::kHulls ? "hulls" : "angles";
  json("kind", kind);
  if (kind != "hulls" && kind != "angles")
    throw Error(ErrorCode::kUnsupported, fmt::format("shadow_seeds.kind: is \"{}\", hulls and angles are read", kind));
  const bool is_hulls = kind == "hulls";
  info.kind = is_hulls ? ShadowSeedInfo::Kind::kHulls : ShadowSeedInfo::Kind::kAngles;
  std::optional<double> lowest = is_hulls ? std::optional(info.sun_min_deg) : std::nullopt;
  std::optional<std::vector<double>> angles = is_hulls ? std::nullopt : std::optional(info.sun_deg);
  json("sun_min_deg", lowest, kAbsent);
  json("sun_deg", angles, kAbsent);
  if (is_hulls) {
    if (!lowest) json.refuse("sun_min_deg", "is missing");
    info.sun_min_deg = *lowest;
    check_sun(json, "sun_min_deg", info.sun_min_deg);
  } else {
    info.sun_deg = angles.value_or(std::vector<double>{});
    for (std::size_t n = 0; n < info.sun_deg.size(); ++n) {
      check_sun(json, "sun_deg", info.sun_deg[n]);
      if (n > 0 && info.sun_deg[n - 1] >= info.sun_deg[n]) json.refuse("sun_deg", "is not in ascending order");
    }
    if (info.sun_deg.empty() || info.sun_deg.size() > kMaxSeedAngles) {
      json.refuse("sun_deg", fmt::format("has {} angles, must have 1 to {}", info.sun_deg.size(), kMaxSeedAngles));
    }
  }
  json.derived("directions", {"east", "west"}, {{"type", "array"}, {"items", {{"type", "string"}}}});
  json("elevation_units_per_world_unit", info.elevation_units_per_world_unit, {.least = 0.0, .above_least = true});
  json.all("members", info.members, "bytes", info.bytes);
}

std::string format_shadow_seed_info(const ShadowSeedInfo& info) {
  return write_extension(info, shadow_seed_members);
}

std::optional<ShadowSeedInfo> shadow_seed_info(const Metadata& metadata) {
  return read_extension(metadata, kShadowSeedsName, shadow_seed_members);
}

}  // namespace isohf
