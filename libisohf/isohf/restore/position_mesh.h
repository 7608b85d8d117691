#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "isohf/lattice.h"

namespace isohf {

/// Places of the samples of a raster in old archives, by bicubic polynomials between nodes that lie at most step() samples apart: 32,
/// or twice that as often as need be for no more than 2^20 cells.
///
///     node 0 ------ node 1 ------ ... ------ node n     n = max(3, ceil((samples - 1) / step)), evenly spaced from the
///     sample 0                               the last   first sample to the last, along either axis
class PositionMesh {
 public:
  /// values [value_count()]  x and z of each node, row by row; NaN where there is none: all samples of the cells around
  /// then have none.
  PositionMesh(std::int64_t columns, std::int64_t rows, std::vector<double> values);

  [[nodiscard]] static std::int64_t step(std::int64_t columns, std::int64_t rows);
  /// Cells along an axis: n.
  [[nodiscard]] static std::int64_t cells(std::int64_t samples, std::int64_t step);
  [[nodiscard]] static std::size_t value_count(std::int64_t columns, std::int64_t rows);

  /// Places of all samples of a row: out [columns].
  void row(std::int64_t row, std::span<WorldPoint> out) const;

 private:
  std::int64_t columns_;
  std::int64_t rows_;
  std::int64_t step_;
  std::vector<double> values_;
};

}  // namespace isohf
