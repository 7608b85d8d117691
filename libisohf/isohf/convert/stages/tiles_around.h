#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/convert/conversion.h"
#include "isohf/sampling/source/source_band.h"

namespace isohf {

/// Tiles North and South of a shard that what it makes of its own ones reads: they are made here as the shards that hold
/// them make them.
class TilesAround {
 public:
  /// Whole rows of tiles; either range may be empty. Codes are chosen. On the caller's oneTBB arena.
  TilesAround(const Conversion& conversion, const RowRange& north, const RowRange& south);

  [[nodiscard]] bool holds(TileIndex tile) const { return tiles_.count(conversion_.plan.grid.flat_index(tile)) != 0; }
  [[nodiscard]] const EncodedTile& entry(TileIndex tile) const {
    return tiles_.at(conversion_.plan.grid.flat_index(tile));
  }
  [[nodiscard]] TileCodes codes(TileIndex tile) const;

  /// What that many rows of them take at most.
  [[nodiscard]] static std::uint64_t memory_bytes(const TileGrid& grid, std::int64_t rows);

 private:
  void make(const RowRange& rows);

  const Conversion& conversion_;
  std::unordered_map<std::int64_t, EncodedTile> tiles_;  ///< by flat index; without digest and statistics
};

}  // namespace isohf
