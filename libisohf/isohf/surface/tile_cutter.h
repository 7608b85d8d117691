#pragma once

#include <cstdint>
#include <span>

#include "isohf/base/view.h"
#include "isohf/lattice/tile_grid.h"
#include "isohf/surface/kernels.h"
#include "isohf/surface/source_axis.h"
#include "isohf/surface/source_scan.h"

namespace isohf {

/// A run of source rows, both ends included.
struct RowRange {
  std::int64_t first;
  std::int64_t last;
};

/// Consecutive whole rows of the source as heights relative to a datum, NaN where void: what a kernel's taps read
/// (coefficients, where the kernel has a prefilter).
struct SourceBand {
  View2D<const float> heights;  ///< all columns of the source
  std::int64_t first_row = 0;   ///< source row of heights.row(0)
  /// As large as heights, not 0 where the sample is void: coefficients go on into voids (Prefilter). No data where the
  /// NaN among heights are the voids.
  View2D<const char> voids = {};
};

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

  /// Cuts one tile. `band` holds at least rows_needed(tile.row).
  /// heights [C x R] out, relative to the band's datum; NaN where void: outside the source by Outside::kVoid, or where
  /// less than half of the kernel's weight, or none of the nearest samples, is valid.
  /// O(C*R*taps); no allocation proportional to anything but the tile.
  void cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const;

 private:
  TileGrid grid_;
  SourceAxis axis_x_;
  SourceAxis axis_z_;
  Kernel kernel_;
  float lowest_;
  float highest_;
};

}  // namespace isohf
