#pragma once

#include <functional>
#include <vector>

#include "isohf/lattice/planes.h"
#include "isohf/mesh.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// A tile of one plane.
struct PlaneTile {
  int plane = 0;
  TileIndex tile{};
  friend bool operator==(const PlaneTile&, const PlaneTile&) = default;
};

/// A tile to draw; on the sides of which bit int(TileSide) is set it lies beside a coarser one.
struct ChosenTile {
  PlaneTile at;
  unsigned coarser_sides = 0;
};

/// What the choice depends on.
struct PlaneWishes {
  std::function<bool(PlaneTile)> is_stored;
  std::function<bool(PlaneTile)> wants_finer;  ///< of planes above 0
  std::function<bool(PlaneTile)> is_resident;
};

/// Which tiles of which planes make up a picture: each place once, no tile beside one that is more than a plane coarser.
/// A tile gives way to those below it where it wants finer ones and all of them that are stored are resident, so that a
/// coarse picture stands until the finer one is whole. From the coarsest plane on; `top` are that plane's tiles.
[[nodiscard]] std::vector<ChosenTile> choose_tiles(const Planes& planes, const TileRange& top,
                                                   const PlaneWishes& wishes);

}  // namespace isohf::view
