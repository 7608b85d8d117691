#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "isohf/restore/predict/fixed_point.h"

namespace isohf {

/// Places of the samples of a raster in integers, by bicubic polynomials between nodes (docs/archive_format.md, section
/// 7): a projection is made of sines, whose last bits differ between machines; the nodes are stored, rounded. They lie at
/// most step() samples apart: 32, or twice that as often as it takes for no more than 2^20 cells.
///
///     node 0 ------ node 1 ------ ... ------ node n     n = max(3, ceil((samples - 1) / step)), evenly spaced from the
///     sample 0                               the last   first sample to the last, along either axis
class PlaceMesh {
 public:
  /// `at` gives the world place of any position between samples; NaN where there is none: all samples of the cells
  /// around then have none.
  PlaceMesh(std::int64_t columns, std::int64_t rows, const TileGrid& grid,
            const std::function<WorldPoint(double column, double row)>& at);
  /// As bytes() gave them. Throws Error{kCorrupt} where they are no mesh of that size.
  PlaceMesh(std::int64_t columns, std::int64_t rows, std::span<const std::byte> bytes);

  [[nodiscard]] static std::int64_t step(std::int64_t columns, std::int64_t rows);
  /// x and z of all nodes.
  [[nodiscard]] static std::size_t value_count(std::int64_t columns, std::int64_t rows);

  [[nodiscard]] std::vector<std::byte> bytes() const;
  /// Places of all samples of a row: out [columns].
  void row(std::int64_t row, std::span<FixedPlace> out) const;

 private:
  /// Cells along an axis: n.
  [[nodiscard]] static std::int64_t cells(std::int64_t samples, std::int64_t step);

  std::int64_t columns_;
  std::int64_t rows_;
  std::int64_t across_;  ///< cells
  std::int64_t down_;
  std::vector<FixedPlace> nodes_;
};

}  // namespace isohf
