#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "isohf/lattice.h"

namespace isohf {

/// Places of the samples of a raster, by bicubic polynomials between nodes that lie at most step() samples apart: 32,
/// or twice that as often as need be for no more than 2^20 cells.
///
/// Between nodes there is nothing but + - * /, so that the same nodes give the same bits on every machine; a
/// projection, which is made of sines, does not.
///
///     node 0 ------ node 1 ------ ... ------ node n     n = max(3, ceil((samples - 1) / step)), evenly spaced from the
///     sample 0                               the last   first sample to the last, along either axis
class PositionMesh {
 public:
  /// `at` gives the place of any position between samples; NaN where there is none: all samples of the cells around
  /// then have none.
  PositionMesh(std::int64_t columns, std::int64_t rows, const std::function<WorldPoint(double column, double row)>& at);
  /// values [value_count()]  as values() gave them
  PositionMesh(std::int64_t columns, std::int64_t rows, std::vector<double> values);

  [[nodiscard]] static std::int64_t step(std::int64_t columns, std::int64_t rows);
  [[nodiscard]] static std::size_t value_count(std::int64_t columns, std::int64_t rows);
  /// x and z of each node, row by row.
  [[nodiscard]] std::span<const double> values() const { return values_; }

  /// Places of all samples of a row: out [columns].
  void row(std::int64_t row, std::span<WorldPoint> out) const;

 private:
  std::int64_t columns_;
  std::int64_t rows_;
  std::int64_t step_;
  std::vector<double> values_;
};

}  // namespace isohf
