#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/lattice.h"

/// The paths along which light casts shadows: rows of visible vertices, followed eastwards or westwards (paper section
/// 3.13). Pure geometry and plain data; casting is in light/shadow.h.
///
///   row r odd    #-----o-----o---- ... -----#     ordinals 0, 1, ... C-4 from either edge, 2 half steps apart
///   row r even   s--o-----o---- ... -----o--s     ordinals 0, 1, ... C-3; the first and last step is one half step
///
/// Distances are counted in half lattice steps (object-space x), so they are integers. Counted from a tile's edge they
/// go on through the tiles beyond it; there an ordinal counts the vertices on the way, those on tile edges once.

namespace isohf {

/// Which way the light travels along the rows. Eastwards: the sun stands in the West.
enum class LightTravel { kEastward, kWestward };

/// Visible rows are 1 to R-2; their number.
[[nodiscard]] inline int visible_rows(const TileShape& shape) {
  return shape.rows() - 2;
}

/// Visible columns of a row are 1 to this one.
[[nodiscard]] inline int last_visible_column(const TileShape& shape, int row) {
  return shape.columns() - (row % 2 == 0 ? 2 : 3);
}

/// A tile's width in half steps, 2(C-4).
[[nodiscard]] inline int half_steps_across(const TileShape& shape) {
  return 2 * shape.cell_columns();
}

/// The last step of `sigma` that the source covers, whose ground extends to `end`; nothing beyond it casts shadows.
[[nodiscard]] inline std::int64_t last_casting_step(double end, double sigma) {
  return static_cast<std::int64_t>(std::floor(end / sigma + 1e-6));
}

/// Distance from a tile's edge of the last vertex of the row before it: what the tile stores in column 0 and behind its
/// last visible column.
[[nodiscard]] inline int padding_distance(int row) {
  return row % 2 != 0 ? 2 : 1;
}

/// Distance of the n-th vertex from a tile's edge along the row, n >= 0, through as many tiles as it takes.
[[nodiscard]] inline std::int64_t distance_from_ordinal(const TileShape& shape, int row, std::int64_t ordinal) {
  if (row % 2 != 0) return 2 * ordinal;
  const std::int64_t steps = shape.cell_columns() + 1;
  const std::int64_t place = ordinal % steps;
  return ordinal / steps * half_steps_across(shape) + (place == 0 ? 0 : 2 * place - 1);
}

/// The inverse of distance_from_ordinal; -1 where no vertex of the row lies at that distance, distance >= 0.
[[nodiscard]] inline std::int64_t ordinal_from_distance(const TileShape& shape, int row, std::int64_t distance) {
  if (row % 2 != 0) return distance % 2 == 0 ? distance / 2 : -1;
  const std::int64_t place = distance % half_steps_across(shape);
  if (place != 0 && place % 2 == 0) return -1;
  return distance / half_steps_across(shape) * (shape.cell_columns() + 1) + (place + 1) / 2;
}

/// A vertex that can cast its shadow over a tile's edge.
struct ShadowCaster {
  std::int64_t distance;  ///< from the edge, against the light, half steps
  double height;          ///< in the archive's codes, or the elevation itself where codes are floats
  friend bool operator==(const ShadowCaster&, const ShadowCaster&) = default;
};

/// For each visible row of a tile the casters at one of its edges, nearest first.
struct CasterRows {
  std::vector<std::uint32_t> starts;  ///< [visible rows + 1] where each row's casters begin
  std::vector<ShadowCaster> casters;

  /// Casters of stored row 1 <= row <= R-2.
  [[nodiscard]] std::span<const ShadowCaster> row(int row) const {
    const auto at = static_cast<std::size_t>(row - 1);
    return std::span(casters).subspan(starts[at], starts[at + 1] - starts[at]);
  }
  friend bool operator==(const CasterRows&, const CasterRows&) = default;
};

}  // namespace isohf
