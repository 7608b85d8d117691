#pragma once

#include <span>
#include <vector>

#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/surface/shade/shadow_hull.h"

namespace isohf {

/// Shadow seeds of one row of tiles: what its tiles cast over each other's edges. They depend on the tiles' codes and
/// on nothing else, bit for bit.
class SeedRow {
 public:
  /// info: its kind, suns and units.
  SeedRow(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedInfo& info);

  /// What one tile brings along.
  struct Tile {
    TileCasters casters;
    TileEdges edges;
    bool is_empty = false;  ///< not stored, has no seeds
  };
  /// Any tile, on any thread.
  [[nodiscard]] Tile prepare(const TileCodes& codes) const;

  /// The members of a whole row, from West to East; payload_bytes 0 where a tile has none. On the caller's oneTBB
  /// arena.
  [[nodiscard]] std::vector<EncodedSeeds> encode(std::span<const Tile> tiles) const;

 private:
  [[nodiscard]] EncodedSeeds encode(const TileEdges& edges, const HullSeeds& seeds) const;
  [[nodiscard]] std::vector<double> heights_at_angles(const CasterRows& rows) const;

  TileGrid grid_;
  Quantisation quantisation_;
  double fall_min_;
  double lowest_;
  std::vector<double> falls_;  ///< kAngles
};

}  // namespace isohf
