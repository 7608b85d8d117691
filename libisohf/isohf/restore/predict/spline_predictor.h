#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "isohf/restore/point_sampler.h"
#include "isohf/restore/predict/fixed_point.h"
#include "isohf/surface/source/source_band.h"

namespace isohf {

/// Quintic B-spline weights of six neighbours, in 16384ths that sum to 1: place n / 512 between the third and the fourth.
[[nodiscard]] std::array<int, 6> fixed_quintic(std::int64_t n);

/// Predicts samples by quintic B-splines along the lattice's rows and then down its columns, in integers; on the
/// triangles beside voids. docs/archive_format.md, section 7, says how, to the last bit.
///
/// Keeps the tile rows and lattice rows that the next rows may need: memory grows with the width, not the height.
/// Works on the caller's oneTBB arena.
class SplinePredictor {
 public:
  /// Lattice rows that a sample reads beyond the one at hand, on either side.
  static constexpr int kReach = 12 + 3;

  /// wraps_x  the grid's East edge is its West edge
  SplinePredictor(const TileGrid& grid, bool wraps_x, const FixedHeights& heights, ReadTiles read_tiles,
                  const SampleGrid& samples);

  /// The rows of tiles that read() reads.
  [[nodiscard]] RowRange tile_rows_needed(std::int64_t first, std::int64_t rows) const;
  /// Rows `first` to `first + rows - 1`; calls come in increasing order.
  /// elevations [rows * width] out, vertical units; NaN where there is no prediction.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

 private:
  struct TileRow {
    std::int64_t row;
    std::vector<std::vector<double>> heights;  ///< [tile columns][C*R]
  };
  struct LatticeRow {
    std::vector<double> heights;       ///< at the samples' columns
    std::vector<double> coefficients;  ///< the same, of the spline down the columns; made where they are needed
    std::vector<char> near_void;       ///< empty where no column has a void around; all are void where `is_void`
    bool is_void = false;
  };
  /// Where the columns read a lattice row of one parity.
  struct Taps {
    std::vector<std::int32_t> start;  ///< [width] of the first of six
    std::vector<double> weights;      ///< [6][width]
  };

  const TileRow& tile_row(std::int64_t row);
  void keep_lattice_rows(std::int64_t first, std::int64_t last);
  [[nodiscard]] std::int64_t lattice_rows() const;
  [[nodiscard]] std::int64_t tile_row_of(std::int64_t lattice_row) const;
  [[nodiscard]] const LatticeRow& at(std::int64_t lattice_row) const;
  [[nodiscard]] std::int64_t z_of(std::int64_t row) const;
  [[nodiscard]] RowRange middles(std::int64_t first, std::int64_t rows) const;
  [[nodiscard]] RowRange lattice_rows_needed(const RowRange& middles) const;
  [[nodiscard]] std::vector<double> line_of(const TileRow& tiles, std::int64_t lattice_row) const;
  void straighten(const TileRow& tiles, std::int64_t lattice_row, LatticeRow& made) const;
  void make_coefficients(std::int64_t lattice_row);
  void read_row(std::int64_t row, std::span<double> out) const;
  void read_triangles(std::int64_t z, const std::vector<char>& here, std::span<double> out) const;

  TileGrid grid_;
  bool wraps_x_;
  FixedHeights heights_;
  ReadTiles read_tiles_;
  SampleGrid samples_;
  std::vector<std::int64_t> x_;  ///< of the columns
  std::array<Taps, 2> taps_;     ///< of even lattice rows, and of odd ones
  std::deque<TileRow> tile_rows_;
  std::deque<LatticeRow> lattice_rows_;
  std::int64_t first_lattice_row_ = 0;
};

}  // namespace isohf
