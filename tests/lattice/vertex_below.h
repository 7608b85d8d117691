#pragma once

#include <algorithm>

#include "isohf/lattice/planes.h"

namespace isohf::test {

/// A vertex of plane 0.
struct TileVertex {
  TileIndex tile;
  GridVertex vertex;
  friend bool operator==(const TileVertex&, const TileVertex&) = default;
};

/// The vertex of plane 0 whose code the stored vertex of a plane's tile, padding included, has if it isn't beyond.
inline TileVertex vertex_below(const Planes& planes, int plane, TileIndex tile, GridVertex vertex) {
  if (plane == 0) return {tile, vertex};
  const LatticeVertex at = planes.place(plane, planes.grid(plane).lattice_vertex(tile, vertex));
  const TileGrid& fine = planes.grid(0);
  const std::int64_t width = 2 * fine.shape().cell_columns();
  const std::int64_t height = fine.shape().cell_rows();
  const TileIndex holds{std::min(at.x / width, fine.tile_columns() - 1), std::min(at.z / height, fine.tile_rows() - 1)};
  return {holds,
          {static_cast<int>((at.x - holds.column * width) / 2 + 1), static_cast<int>(at.z - holds.row * height + 1)}};
}

}  // namespace isohf::test
