#include "isohf/restore/mesh/level_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/lattice/barycentric.h"

namespace isohf {
namespace {

/// The tile that a level draws: a tile of fewer columns and rows, of which every vertex is one of the full-detail tile.
std::vector<double> coarse_elevations(const TileShape& shape, const TileShape& coarse, int level,
                                      View2D<const double> elevations) {
  const int stride = 1 << level;
  std::vector<double> values(static_cast<std::size_t>(coarse.stored_vertex_count()),
                             std::numeric_limits<double>::quiet_NaN());
  const View2D<double> view(values.data(), coarse.columns(), coarse.rows());
  for (int row = 1; row < coarse.rows() - 1; ++row) {
    const int fine_row = 1 + (row - 1) * stride;
    for (int column = 1; column < coarse.columns() - 1; ++column) {
      if (!is_visible(coarse, {column, row})) continue;
      const int x = std::clamp(object_x(coarse.columns(), column, row) * stride, 0, 2 * shape.cell_columns());
      view(column, row) = elevations(x / 2 + 1, fine_row);
    }
  }
  return values;
}

}  // namespace

double level_error(const TileShape& shape, int level, std::span<const double> elevations) {
  if (level == 0) return 0.0;
  const int stride = 1 << level;
  const TileShape coarse = TileShape::make(shape.cell_columns() / stride + 4, shape.cell_rows() / stride + 3, 1);
  const View2D<const double> fine(elevations.data(), shape.columns(), shape.rows());
  const std::vector<double> values = coarse_elevations(shape, coarse, level, fine);
  const View2D<const double> view(values.data(), coarse.columns(), coarse.rows());
  double worst = 0.0;
  for (int row = 1; row < shape.rows() - 1; ++row) {
    for (int column = 1; column < shape.columns() - 1; ++column) {
      if (!is_visible(shape, {column, row})) continue;
      const ObjectVertex at = object_from_grid(shape, {column, row});
      const Barycentric place =
          snapped(barycentric(coarse, {static_cast<double>(at.x) / stride, static_cast<double>(at.z) / stride}));
      const double found = interpolate(place, view);
      const double expected = fine(column, row);
      if (std::isnan(found) != std::isnan(expected)) return std::numeric_limits<double>::infinity();
      if (!std::isnan(found)) worst = std::max(worst, std::abs(found - expected));
    }
  }
  return worst;
}

}  // namespace isohf
