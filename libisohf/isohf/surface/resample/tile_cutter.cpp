#include "isohf/surface/resample/tile_cutter.h"

#include <array>
#include <vector>

#include "isohf/base/assert.h"

namespace isohf {
namespace {

/// Taps of all columns of a tile's rows of one parity.
ColumnTaps taps_of_tile(const TileGrid& grid, const SourceAxis& axis, const Kernel& kernel, TileIndex tile,
                        int parity) {
  std::vector<double> world_x(static_cast<std::size_t>(grid.shape().columns()));
  const std::int64_t round = grid.tile_columns() * 2 * grid.shape().cell_columns();
  for (std::size_t c = 0; c < world_x.size(); ++c) {
    LatticeVertex vertex = grid.lattice_vertex(tile, {static_cast<int>(c), parity});
    // The same vertex has the same bits on both sides of the join.
    if (axis.wraps()) vertex.x = ((vertex.x % round) + round) % round;
    world_x[c] = grid.world_from_lattice(vertex).x;
  }
  return make_column_taps(axis, kernel, world_x);
}

}  // namespace

TileCutter::TileCutter(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
                       const ElevationRange& limits)
    : grid_(grid), axis_x_(axis_x), kernel_(kernel), sampler_(axis_x, axis_z, kernel, limits) {}

RowRange TileCutter::rows_needed(std::int64_t tile_row) const {
  RowRange range = RowSampler::no_rows();
  for (int r = 0; r < grid_.shape().rows(); ++r) {
    sampler_.add_rows_needed(grid_.world_from_lattice(grid_.lattice_vertex({0, tile_row}, {0, r})).z, range);
  }
  return range;
}

RowRange TileCutter::columns_needed(std::int64_t tile_column) const {
  RowRange range = RowSampler::no_rows();
  for (const int parity : {0, 1}) {
    add_columns_needed(axis_x_, taps_of_tile(grid_, axis_x_, kernel_, {tile_column, 0}, parity), range);
  }
  return range;
}

void TileCutter::cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const {
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  ISOHF_ASSERT(heights.size() == static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  const std::array<ColumnTaps, 2> taps = {taps_of_tile(grid_, axis_x_, kernel_, tile, 0),
                                          taps_of_tile(grid_, axis_x_, kernel_, tile, 1)};
  RowSampler::Scratch scratch;
  for (int r = 0; r < grid_.shape().rows(); ++r) {
    const double world_z = grid_.world_from_lattice(grid_.lattice_vertex(tile, {0, r})).z;
    sampler_.sample(band, world_z, taps[static_cast<std::size_t>(r & 1)], scratch,
                    heights.subspan(static_cast<std::size_t>(r) * columns, columns));
  }
}

}  // namespace isohf
