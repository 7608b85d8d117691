#pragma once

#include <functional>
#include <span>
#include <vector>

#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/base/memory/spill_buffer.h"
#include "isohf/light/shadow_hull.h"

namespace isohf {

class ArchiveWriter;

/// Shadow seeds of one row of tiles: what its tiles cast over each other's edges. They depend on the tiles' codes and
/// on nothing else, bit for bit.
class SeedRow {
 public:
  /// info   its suns and units
  /// valid  the part of the world that the source covers; nothing beyond it casts shadows
  SeedRow(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedInfo& info, const WorldBounds& valid);

  /// What one tile brings along.
  struct Tile {
    TileCasters casters;
    TileEdges edges;
    bool is_empty = false;  ///< not stored, has no seeds
  };
  /// Any tile, on any thread.
  [[nodiscard]] Tile prepare(TileIndex index, const TileCodes& codes) const;

  /// What the tiles of a row bring along, from West to East; in a scratch file where there is a folder for one.
  class Tiles {
   public:
    explicit Tiles(const ScratchFolder& scratch) : scratch_(scratch), bytes_(scratch) {}
    void add(const Tile& tile);
    void clear();
    [[nodiscard]] std::size_t count() const { return places_.size(); }

   private:
    friend class SeedRow;
    struct Place {
      std::uint64_t eastward;
      std::uint64_t westward;
      std::uint64_t edges;
      CodeType type;
      bool is_empty;
    };
    ScratchFolder scratch_;
    SpillBuffer bytes_;
    std::vector<Place> places_;
  };

  /// Hands over the members of a whole row, some at a time, from West to East; payload_bytes 0 where a tile has none.
  /// On the caller's oneTBB arena.
  using Take = std::function<void(std::size_t first, std::span<const EncodedSeeds> members)>;
  void encode(const Tiles& tiles, const Take& take) const;
  /// Writes the members of row `row`. On the caller's oneTBB arena.
  void write(const Tiles& tiles, std::int64_t row, ArchiveWriter& writer) const;

  /// Peak memory of a row's Tiles and of encode(), bytes; an estimate.
  [[nodiscard]] static std::uint64_t memory_bytes(const TileGrid& grid, bool in_scratch);

 private:
  [[nodiscard]] TileCasters casters(const TileCodes& codes) const;
  [[nodiscard]] EncodedSeeds encode(const TileEdges& edges, const HullSeeds& seeds) const;

  TileGrid grid_;
  Quantisation quantisation_;
  double fall_min_;
  std::int64_t last_x_;  ///< on the lattice, of what the source covers
  std::int64_t last_z_;
};

}  // namespace isohf
