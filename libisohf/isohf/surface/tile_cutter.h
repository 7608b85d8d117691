#pragma once

#include <cstdint>
#include <span>

#include "isohf/lattice/tile_grid.h"
#include "isohf/surface/kernels.h"
#include "isohf/surface/row_sampler.h"
#include "isohf/surface/source_axis.h"
#include "isohf/surface/source_scan.h"

namespace isohf {

/// Resamples the source at every stored vertex of a tile: visible ones, slid ones where they lie (errata E6), padding.
///
/// An elevation is a pure function of the vertex's place in the whole heightfield, so tiles that share a vertex hold
/// the same bits of it. Thread-safe.
class TileCutter {
 public:
  /// `limits`, relative to the band's datum, hold the continuation beyond the source's edge only; elevations of the
  /// source itself are never touched.
  TileCutter(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
             const ElevationRange& limits);

  /// The source rows that a row of tiles reads.
  [[nodiscard]] RowRange rows_needed(std::int64_t tile_row) const;

  /// The source columns that a column of tiles reads.
  [[nodiscard]] RowRange columns_needed(std::int64_t tile_column) const;

  /// Cuts one tile. `band` holds at least rows_needed(tile.row) and columns_needed(tile.column).
  /// heights [C x R] out, relative to the band's datum; NaN where void: outside the source by Outside::kVoid, or where
  /// less than half of the kernel's weight, or none of the nearest samples, is valid.
  /// O(C*R*taps); no allocation proportional to anything but the tile.
  void cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const;

 private:
  TileGrid grid_;
  SourceAxis axis_x_;
  Kernel kernel_;
  RowSampler sampler_;
};

}  // namespace isohf
