#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "isohf/surface/resample/kernels.h"
#include "isohf/surface/resample/source_warp.h"
#include "isohf/surface/resample/vertex_cutter.h"
#include "isohf/surface/source/source_axis.h"
#include "isohf/surface/source/source_scan.h"

namespace isohf {

/// The cutter of a source that was projected: each vertex has a position of its own in the source (SourceWarp), and
/// weights of its own along both axes.
class WarpedCutter final : public VertexCutter {
 public:
  /// The axes are those of positions (SourceAxis::of_positions, or one that wraps with spacing 1 for x). `limits` as in
  /// TileCutter.
  WarpedCutter(const TileGrid& grid, const WarpPlace& place, const SourceAxis& axis_x, const SourceAxis& axis_z,
               Outside outside, const Kernel& kernel, const ElevationRange& limits);

  [[nodiscard]] RowRange rows_needed(std::int64_t tile_row) const override;
  /// All: a column of tiles is no column of the source.
  [[nodiscard]] RowRange columns_needed(std::int64_t) const override { return {0, axis_x_.samples() - 1}; }
  /// O(C*R*taps^2).
  void cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const override;

 private:
  struct Row;
  void sample_row(const SourceBand& band, const double* u, const double* v, Row& row, float* heights) const;
  /// Any position: continued, held, void or not.
  [[nodiscard]] float sample(const SourceBand& band, double u, double v) const;
  [[nodiscard]] float sample_inside(const SourceBand& band, double u, double v) const;

  TileGrid grid_;
  SourceAxis axis_x_;
  SourceAxis axis_z_;
  Kernel kernel_;
  SourceWarp warp_;
  std::vector<SourceWarp::RowBounds> bounds_;  ///< by tile row
  float lowest_;
  float highest_;
};

}  // namespace isohf
