#include "isohf/convert/stages/seed_stage.h"

#include <fmt/format.h>

#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

ShadowSeedInfo info_of(const ShadowSeedRequest& request, double elevation_units_per_world_unit) {
  ShadowSeedInfo info;
  info.sun_min_deg = request.sun_min_deg;
  info.elevation_units_per_world_unit = elevation_units_per_world_unit;
  return info;
}

}  // namespace

void check_seed_request(const ShadowSeedRequest& request, const SourceInfo& info, const Plan& plan) {
  if (!(request.sun_min_deg >= kMinSunDeg && request.sun_min_deg < 90.0)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("`sun_min_deg` is {} degrees, must be a sun elevation from {} to below 90",
                            request.sun_min_deg, kMinSunDeg));
  }
  if (info.georeference.unit == HorizontalUnit::kDegree && !plan.frame.in_metres) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: `shadow_seeds` needs a world in metres, and `projection` none lays this one out in "
                            "degrees; leave one of them out",
                            info.path));
  }
  if (!has_room_for_seeds(plan.grid)) {
    throw Error(
        ErrorCode::kUnsupported,
        "`shadow_seeds`: rows of 2^31 lattice vertices and more have no room for seeds; use a larger `spacing`");
  }
}

SeedStage::SeedStage(const TileGrid& grid, const WorldBounds& valid, const Quantisation& quantisation,
                     const ShadowSeedRequest& request, double elevation_units_per_world_unit,
                     const ScratchFolder& scratch)
    : grid_(grid),
      info_(info_of(request, elevation_units_per_world_unit)),
      row_(grid, quantisation, info_, valid),
      tiles_(scratch) {}

std::int64_t SeedStage::first_tile_needed(const TileGrid& grid, std::int64_t next_tile) {
  return next_tile == 0 ? 0 : (next_tile - 1) / grid.tile_columns() * grid.tile_columns();
}

std::unique_ptr<Stage::Made> SeedStage::make(TileIndex tile, const TileCodes& codes, const EncodedTile& encoded) const {
  auto made = std::make_unique<MadeOf<SeedRow::Tile>>(row_.prepare(tile, codes));
  made->value.is_empty = encoded.is_empty;
  return made;
}

void SeedStage::add_after(TileIndex tile, const Made* made, ArchiveWriter& writer) {
  ISOHF_ASSERT(static_cast<std::int64_t>(tiles_.count()) == tile.column);
  tiles_.add(static_cast<const MadeOf<SeedRow::Tile>*>(made)->value);
  if (static_cast<std::int64_t>(tiles_.count()) < grid_.tile_columns()) return;
  row_.write(tiles_, tile.row, writer);
  tiles_.clear();
}

void SeedStage::describe(const ArchiveWriter& writer, Metadata& metadata, ConvertSummary& summary) const {
  ShadowSeedInfo info = info_;
  const MemberTotals totals = writer.members_in("seeds/");
  info.members = totals.members;
  summary.seed_bytes = info.bytes = totals.bytes;
  metadata.extensions.emplace_back(kShadowSeedsName, format_shadow_seed_info(info));
}

}  // namespace isohf
