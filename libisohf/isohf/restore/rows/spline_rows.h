#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/lattice.h"

/// The separable way back from the lattice (docs/decisions/0012): along each lattice row a quintic B-spline gives
/// heights at the columns that are wanted; all rows then stand in line, and a second quintic B-spline goes down the
/// columns. Doubles, and nothing but + - * / and square roots: the same bits everywhere.

namespace isohf {

/// Quintic B-spline weights: value(u) = sum of weights[i] * c[first + i].
struct QuinticWeights {
  std::int64_t first;
  std::array<double, 6> weights;
};
[[nodiscard]] QuinticWeights quintic_weights(double u);

/// The weights of the samples themselves, prefilter included, cut off where they fall below 1e-10.
struct QuinticResponse {
  static constexpr int kHalo = 28;
  static constexpr int kTaps = 6 + 2 * kHalo;
  std::int64_t first;
  std::array<double, kTaps> weights;
};
[[nodiscard]] QuinticResponse quintic_response(double u);

/// Samples -> coefficients of the quintic B-spline through them, in place, mirrored at both ends. O(n).
void quintic_prefilter(std::span<double> line);

/// Stands for row or vertex k of a line of `count` >= 2, any k. Beyond its ends a line is turned about the end by half a
/// circle, so that planes go on.
/// sign * line[at] + first * line[0] + last * line[count - 1]
struct StandIn {
  std::int64_t at;
  double sign = 1.0;
  double first = 0.0;
  double last = 0.0;
};
[[nodiscard]] StandIn stand_in(std::int64_t k, std::int64_t count);

/// The rows of the whole lattice, padding rows included: row k lies at object-space z = k - 1.
class SplineRows {
 public:
  /// columns_x [n]  the world x of the columns that are wanted, increasing
  /// wraps_x        rows go all the way round: behind their East end they begin again
  /// scratch        keeps their weights where memory has no room for them
  SplineRows(const TileGrid& grid, const std::vector<double>& columns_x, bool wraps_x, const ScratchFolder& scratch);

  [[nodiscard]] std::int64_t rows() const { return grid_.tile_rows() * grid_.shape().cell_rows() + 3; }
  [[nodiscard]] std::int64_t tile_row_of(std::int64_t row) const;
  /// Fractional row number of a world z.
  [[nodiscard]] double row_at(double z) const { return z / grid_.sigma_z() + 1.0; }

  /// Its number among the vertex rows of its tiles.
  [[nodiscard]] int vertex_row_of(std::int64_t row) const {
    return static_cast<int>(row - tile_row_of(row) * grid_.shape().cell_rows());
  }

  /// Heights of lattice row `row` at the columns. vertices: its C elevations of all tiles.
  /// heights [n] out; near_void [n] out: 1 where a void is among the six vertices around the column: the height means
  /// nothing there. Returns whether any is. Vertices that slid onto a tile's edge are left out: their lattice
  /// neighbours are in the tile beside.
  bool straighten(std::int64_t row, std::span<const double> vertices, std::span<double> heights,
                  std::span<char> near_void) const;

 private:
  [[nodiscard]] std::vector<double> line_of(std::int64_t row, std::span<const double> vertices) const;

  TileGrid grid_;
  bool wraps_x_;
  KeptRows<QuinticWeights> taps_;  ///< on padding-first rows (even k), and on odd ones
};

}  // namespace isohf
