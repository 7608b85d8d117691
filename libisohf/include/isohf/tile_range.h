// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "isohf/lattice.h"

namespace isohf {

/// A rectangle of tiles of one plane, `end` past the last ones.
struct TileRange {
  TileIndex first{};
  TileIndex end{};

  [[nodiscard]] bool contains(TileIndex tile) const {
    return tile.column >= first.column && tile.column < end.column && tile.row >= first.row && tile.row < end.row;
  }
  [[nodiscard]] std::int64_t count() const { return (end.column - first.column) * (end.row - first.row); }
  friend bool operator==(const TileRange&, const TileRange&) = default;
};

}  // namespace isohf
