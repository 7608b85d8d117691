#pragma once

#include <cstdint>

#include "isohf/archive/writer.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/stages/seed_row.h"
#include "isohf/convert/stages/stage.h"

namespace isohf {

/// Throws Error{kInvalidArgument, kUnsupported} naming the option where the request cannot be met.
void check_seed_request(const ShadowSeedRequest& request, const SourceInfo& info, const Plan& plan);

/// Shadow seeds in the pass that makes the tiles. What a tile's neighbours cast over its edges is known when its row of
/// tiles is complete, for westward light from the East; so one row is kept, as hulls, and the members of a row follow
/// its last tile. They depend on nothing but that row: a conversion that is resumed in a row begins that row again.
class SeedStage final : public Stage {
 public:
  /// elevation_units_per_world_unit as in ShadowSeedInfo.
  /// scratch  keeps what the tiles of a row bring along where memory has no room for it
  SeedStage(const TileGrid& grid, const WorldBounds& valid, const Quantisation& quantisation,
            const ShadowSeedRequest& request, double elevation_units_per_world_unit, const ScratchFolder& scratch);

  /// The tile with which a writer that goes on at `next_tile` must begin: whose seeds are not yet written.
  [[nodiscard]] static std::int64_t first_tile_needed(const TileGrid& grid, std::int64_t next_tile);

  [[nodiscard]] std::int64_t first_tile(std::int64_t next_tile) const override {
    return first_tile_needed(grid_, next_tile);
  }
  [[nodiscard]] std::unique_ptr<Made> make(TileIndex tile, const TileCodes& codes,
                                           const EncodedTile& encoded) const override;
  /// After the last tile of a row the row's members go to the writer.
  void add_after(TileIndex tile, const Made* made, ArchiveWriter& writer) override;
  void describe(const ArchiveWriter& writer, Metadata& metadata, ConvertSummary& summary) const override;

 private:
  TileGrid grid_;
  ShadowSeedInfo info_;
  SeedRow row_;
  SeedRow::Tiles tiles_;  ///< of the current row of tiles, so far
};

}  // namespace isohf
