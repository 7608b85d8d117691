#pragma once

#include <vector>

#include "isohf/lattice.h"

namespace isohf {

/// One lattice vertex as two neighbouring tiles store it, visible or padding.
struct SharedVertex {
  GridVertex here;
  GridVertex there;
  bool visible;  ///< in both tiles: on their common edge or corner; else padding of at least one of them
};

/// The neighbours that a tile is compared with; the other four compare themselves with it.
inline constexpr TileIndex kComparedNeighbours[] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};

/// All vertices that a tile and its neighbour at `step` (one of kComparedNeighbours) both store, row by row.
[[nodiscard]] std::vector<SharedVertex> shared_vertices(const TileShape& shape, TileIndex step);

}  // namespace isohf
