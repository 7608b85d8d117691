#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "isohf/archive/metadata/json_members.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/error.h"

namespace isohf {
double ShadowSeedInfo::fall_per_half_step(const TileGrid& grid, const Quantisation& quantisation,
                                          double sun_elevation_deg) const {
  const double rise = std::tan(sun_elevation_deg * std::numbers::pi / 180.0);
  return rise * grid.sigma_x() * elevation_units_per_world_unit / quantisation.scale;
}

void shadow_seed_members(JsonMembers& json, ShadowSeedInfo& info) {
  std::string kind = "hulls";
  json("kind", kind);
  if (kind != "hulls") {
    throw Error(ErrorCode::kUnsupported, fmt::format("shadow_seeds.kind: is \"{}\", hulls are read", kind));
  }
  json("sun_min_deg", info.sun_min_deg);
  if (!(info.sun_min_deg >= kMinSunDeg && info.sun_min_deg < 90.0)) {
    json.refuse("sun_min_deg",
                fmt::format("is {}, must be an elevation from {} to below 90", info.sun_min_deg, kMinSunDeg));
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
