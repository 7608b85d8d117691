#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "isohf/restore/predict/fixed_point.h"
#include "isohf/restore/rows/vertex_rows.h"
#include "isohf/sampling/source/source_band.h"

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
  /// scratch  keeps tile rows and lattice rows where memory has no room for them
  SplinePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, int fraction_bits,
                  ReadTile read_tile, const SampleGrid& samples, const ScratchFolder& scratch = {});

  /// Estimates: of what is held for the columns; of tiles and lattice rows, where those in hand span so many lattice
  /// rows; of making lattice rows.
  [[nodiscard]] static std::uint64_t kept_bytes(std::int64_t width, bool in_scratch);
  [[nodiscard]] static double rows_bytes(const TileGrid& grid, std::int64_t width, double lattice_rows, int threads,
                                         bool in_scratch);
  [[nodiscard]] static double lines_bytes(const TileGrid& grid, int threads, bool in_scratch);

  /// The rows of tiles that read() reads.
  [[nodiscard]] RowRange tile_rows_needed(std::int64_t first, std::int64_t rows) const;
  /// Rows `first` to `first + rows - 1`; calls come in increasing order.
  /// elevations [rows * width] out, vertical units; NaN where there is no prediction.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

 private:
  struct LatticeRow {
    bool has_coefficients = false;
    bool is_near_void = false;  ///< some columns have voids around
    bool is_void = false;       ///< all of it
  };
  struct Block;
  /// Where the columns read a lattice row of either parity.
  struct Taps {
    KeptRows<std::int32_t> start;  ///< [width] of the first of six
    KeptRows<double> weights;      ///< [6] of each block of columns
  };

  void keep_lattice_rows(std::int64_t first, std::int64_t last);
  [[nodiscard]] std::int64_t lattice_rows() const;
  [[nodiscard]] std::int64_t tile_row_of(std::int64_t lattice_row) const;
  [[nodiscard]] const LatticeRow& at(std::int64_t lattice_row) const;
  [[nodiscard]] std::int64_t z_of(std::int64_t row) const;
  [[nodiscard]] RowRange middles(std::int64_t first, std::int64_t rows) const;
  [[nodiscard]] RowRange lattice_rows_needed(const RowRange& middles) const;
  [[nodiscard]] std::int64_t kept(std::int64_t lattice_row) const;
  [[nodiscard]] std::vector<double> line_of(std::int64_t lattice_row) const;
  void straighten(std::int64_t lattice_row);
  void make_coefficients(std::int64_t lattice_row, Block& block);
  void read_row(std::int64_t row, Block& block, std::span<double> out) const;
  void read_triangles(std::int64_t z, std::int64_t first, const std::vector<char>& here, std::span<double> out) const;
  template <typename Use>
  void for_each_block(std::int64_t rows, const Use& use);

  TileGrid grid_;
  bool wraps_x_;
  FixedHeights numbers_;
  SampleGrid samples_;
  std::vector<std::int64_t> x_;  ///< of the columns
  Taps taps_;                    ///< of even lattice rows, and of odd ones
  VertexRows tiles_;
  bool in_scratch_;
  KeptRows<double> heights_;       ///< of lattice rows, at the samples' columns
  KeptRows<double> coefficients_;  ///< the same, of the spline down the columns; made where they are needed
  KeptRows<char> near_void_;       ///< 1 where a column has a void around; written where any has
  std::deque<LatticeRow> lattice_rows_;
  std::int64_t first_lattice_row_ = 0;
};

}  // namespace isohf
