#pragma once

#include <cstdint>
#include <span>

#include "isohf/lattice.h"
#include "isohf/surface/resample/kernels.h"
#include "isohf/surface/resample/row_sampler.h"
#include "isohf/surface/resample/vertex_cutter.h"
#include "isohf/surface/source/source_axis.h"
#include "isohf/surface/source/source_scan.h"

namespace isohf {

/// The cutter of a source whose rows are rows of the world: taps are found once for a tile's columns and rows.
class TileCutter final : public VertexCutter {
 public:
  /// `limits`, relative to the band's datum, hold the continuation beyond the source's edge only; elevations of the
  /// source itself are never touched.
  TileCutter(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
             const ElevationRange& limits);

  [[nodiscard]] RowRange rows_needed(std::int64_t tile_row) const override;
  [[nodiscard]] RowRange columns_needed(std::int64_t tile_column) const override;
  /// O(C*R*taps); no allocation proportional to anything but the tile.
  void cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const override;

 private:
  TileGrid grid_;
  SourceAxis axis_x_;
  Kernel kernel_;
  RowSampler sampler_;
};

}  // namespace isohf
