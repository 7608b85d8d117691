#pragma once

#include <cstdint>
#include <span>

#include "isohf/lattice.h"
#include "isohf/surface/source/source_band.h"

namespace isohf {

/// Resamples the source at every stored vertex of a tile: visible ones, slid ones where they lie (errata E6), padding.
///
/// An elevation is a pure function of the vertex's place in the whole heightfield, so tiles that share a vertex hold
/// the same bits of it. Thread-safe.
class VertexCutter {
 public:
  virtual ~VertexCutter() = default;

  /// The source rows that a row of tiles reads; at least one.
  [[nodiscard]] virtual RowRange rows_needed(std::int64_t tile_row) const = 0;

  /// The source columns that a column of tiles reads; at least one.
  [[nodiscard]] virtual RowRange columns_needed(std::int64_t tile_column) const = 0;

  /// Cuts one tile. `band` holds at least rows_needed(tile.row) and columns_needed(tile.column).
  /// heights [C x R] out, relative to the band's datum; NaN where void: outside the source, or where less than half of
  /// the kernel's weight, or none of the nearest samples, is valid.
  virtual void cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const = 0;

 protected:
  VertexCutter() = default;
  VertexCutter(const VertexCutter&) = default;
  VertexCutter& operator=(const VertexCutter&) = default;
};

}  // namespace isohf
