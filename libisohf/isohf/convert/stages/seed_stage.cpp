#include "isohf/convert/stages/seed_stage.h"

#include <fmt/format.h>

#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

ShadowSeedInfo info_of(const ShadowSeedRequest& request, double elevation_units_per_world_unit) {
  ShadowSeedInfo info;
  info.kind = request.sun_deg.empty() ? ShadowSeedInfo::Kind::kHulls : ShadowSeedInfo::Kind::kAngles;
  info.sun_min_deg = request.sun_deg.empty() ? request.sun_min_deg : request.sun_deg.front();
  info.sun_deg = request.sun_deg;
  info.elevation_units_per_world_unit = elevation_units_per_world_unit;
  return info;
}

}  // namespace

void check_seed_request(const ShadowSeedRequest& request, const TileGrid& grid) {
  const auto check = [](const char* option, double degrees) {
    if (degrees >= kMinSunDeg && degrees < 90.0) return;
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("{} is {} degrees, must be a sun elevation from {} to below 90", option, degrees, kMinSunDeg));
  };
  check("`sun_min_deg`", request.sun_min_deg);
  for (std::size_t i = 0; i < request.sun_deg.size(); ++i) {
    check("`shadow_seeds`", request.sun_deg[i]);
    if (i > 0 && request.sun_deg[i] <= request.sun_deg[i - 1]) {
      throw Error(ErrorCode::kInvalidArgument, "`shadow_seeds`: the sun elevations must ascend");
    }
  }
  if (request.sun_deg.size() > kMaxSeedAngles) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("`shadow_seeds`: {} sun elevations, at most {} are possible",
                                                         request.sun_deg.size(), kMaxSeedAngles));
  }
  if (!has_room_for_seeds(grid)) {
    throw Error(
        ErrorCode::kUnsupported,
        "`shadow_seeds`: rows of 2^31 lattice vertices and more have no room for seeds; use a larger `spacing`");
  }
}

SeedStage::SeedStage(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedRequest& request,
                     double elevation_units_per_world_unit, const ScratchFolder& scratch)
    : grid_(grid),
      info_(info_of(request, elevation_units_per_world_unit)),
      row_(grid, quantisation, info_),
      tiles_(scratch) {}

std::int64_t SeedStage::first_tile_needed(const TileGrid& grid, std::int64_t next_tile) {
  return next_tile == 0 ? 0 : (next_tile - 1) / grid.tile_columns() * grid.tile_columns();
}

void SeedStage::add(TileIndex index, const Tile& tile, ArchiveWriter& writer) {
  ISOHF_ASSERT(static_cast<std::int64_t>(tiles_.count()) == index.column);
  tiles_.add(tile);
  if (static_cast<std::int64_t>(tiles_.count()) == grid_.tile_columns()) finish_row(index.row, writer);
}

void SeedStage::finish_row(std::int64_t row, ArchiveWriter& writer) {
  row_.encode(tiles_, [&](std::size_t first, std::span<const EncodedSeeds> members) {
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i].payload_bytes == 0) continue;
      writer.add_deflated_member(seed_name({static_cast<std::int64_t>(first + i), row}), members[i].deflated,
                                 members[i].payload_bytes, members[i].payload_crc32);
    }
  });
  tiles_.clear();
}

ShadowSeedInfo SeedStage::info(const ArchiveWriter& writer) const {
  ShadowSeedInfo info = info_;
  const MemberTotals totals = writer.members_in("seeds/");
  info.members = totals.members;
  info.bytes = totals.bytes;
  return info;
}

}  // namespace isohf
