#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

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

/// The rows of the whole lattice, padding rows included: row k lies at object-space z = k - 1.
class SplineRows {
 public:
  /// columns_x [n]  the world x of the columns that are wanted, increasing
  /// wraps_x        rows go all the way round: behind their East end they begin again
  SplineRows(const TileGrid& grid, const std::vector<double>& columns_x, bool wraps_x);

  [[nodiscard]] std::int64_t rows() const { return grid_.tile_rows() * grid_.shape().cell_rows() + 3; }
  [[nodiscard]] std::int64_t tile_row_of(std::int64_t row) const;
  /// Fractional row number of a world z.
  [[nodiscard]] double row_at(double z) const { return z / grid_.sigma_z() + 1.0; }

  /// Heights of lattice row `row` at the columns. `tiles`: the C*R elevations of all tiles of its tile row.
  /// heights [n] out; near_void [n] out: 1 where a void is among the six vertices around the column: the height means
  /// nothing there. Returns whether any is. Vertices that slid onto a tile's edge are left out: their lattice
  /// neighbours are in the tile beside.
  bool straighten(std::int64_t row, const std::vector<std::vector<double>>& tiles, std::span<double> heights,
                  std::span<char> near_void) const;

 private:
  [[nodiscard]] std::vector<double> line_of(std::int64_t row, const std::vector<std::vector<double>>& tiles) const;

  TileGrid grid_;
  bool wraps_x_;
  std::array<std::vector<QuinticWeights>, 2> taps_;  ///< on padding-first rows (even k), and on odd ones
};

}  // namespace isohf
