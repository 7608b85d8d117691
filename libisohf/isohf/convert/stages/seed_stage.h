#pragma once

#include <cstdint>

#include "isohf/archive/writer.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/stages/seed_row.h"

namespace isohf {

/// Throws Error{kInvalidArgument, kUnsupported} naming the option where the request cannot be met.
void check_seed_request(const ShadowSeedRequest& request, const SourceInfo& info, const Plan& plan);

/// Shadow seeds in the pass that makes the tiles. What a tile's neighbours cast over its edges is known when its row of
/// tiles is complete, for westward light from the East; so one row is kept, as hulls, and the members of a row follow
/// its last tile. They depend on nothing but that row: a conversion that is resumed in a row begins that row again.
class SeedStage {
 public:
  /// elevation_units_per_world_unit as in ShadowSeedInfo.
  /// scratch  keeps what the tiles of a row bring along where memory has no room for it
  SeedStage(const TileGrid& grid, const WorldBounds& valid, const Quantisation& quantisation,
            const ShadowSeedRequest& request, double elevation_units_per_world_unit, const ScratchFolder& scratch);

  using Tile = SeedRow::Tile;
  /// Any tile, on any thread.
  [[nodiscard]] Tile prepare(TileIndex index, const TileCodes& codes) const { return row_.prepare(index, codes); }

  /// The tile with which a writer that goes on at `next_tile` must begin: whose seeds are not yet written.
  [[nodiscard]] static std::int64_t first_tile_needed(const TileGrid& grid, std::int64_t next_tile);

  /// Takes the next tile in flat order, from first_tile_needed on; after the last of a row the row's members go to the
  /// writer. One thread.
  void add(TileIndex index, const Tile& tile, ArchiveWriter& writer);

  /// The metadata's record, once all tiles are in.
  [[nodiscard]] ShadowSeedInfo info(const ArchiveWriter& writer) const;

 private:
  void finish_row(std::int64_t row, ArchiveWriter& writer);

  TileGrid grid_;
  ShadowSeedInfo info_;
  SeedRow row_;
  SeedRow::Tiles tiles_;  ///< of the current row of tiles, so far
};

}  // namespace isohf
