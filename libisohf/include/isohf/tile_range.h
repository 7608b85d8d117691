// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "isohf/lattice.h"

namespace isohf {

/// A rectangle of tiles of one plane, `end` past the last ones.
struct TileRange {
  TileIndex first{};
  TileIndex end{};

  [[nodiscard]] bool contains(TileIndex tile) const {
    return tile.column >= first.column && tile.column < end.column && tile.row >= first.row && tile.row < end.row;
  }
  [[nodiscard]] bool is_empty() const { return first.column >= end.column || first.row >= end.row; }
  [[nodiscard]] std::int64_t count() const { return (end.column - first.column) * (end.row - first.row); }
  friend bool operator==(const TileRange&, const TileRange&) = default;
};

/// The tiles that both hold; may be empty.
[[nodiscard]] inline TileRange intersection(const TileRange& a, const TileRange& b) {
  return {{std::max(a.first.column, b.first.column), std::max(a.first.row, b.first.row)},
          {std::min(a.end.column, b.end.column), std::min(a.end.row, b.end.row)}};
}
/// The least rectangle around both.
[[nodiscard]] inline TileRange around(const TileRange& a, const TileRange& b) {
  return {{std::min(a.first.column, b.first.column), std::min(a.first.row, b.first.row)},
          {std::max(a.end.column, b.end.column), std::max(a.end.row, b.end.row)}};
}

}  // namespace isohf
