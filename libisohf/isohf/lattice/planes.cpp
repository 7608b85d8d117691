#include "isohf/lattice/planes.h"

#include <algorithm>
#include <bit>

#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr int kStrides[] = {8, 4};

std::int64_t tiles_above(std::int64_t tiles, int stride) {
  return (tiles + stride - 1) / stride;
}

TileShape with_levels(const TileShape& shape, int levels) {
  return levels <= shape.levels() ? shape : TileShape::make(shape.columns(), shape.rows(), levels);
}

}  // namespace

bool allows_planes(const TileShape& shape, int stride) {
  return stride >= 2 && std::has_single_bit(static_cast<unsigned>(stride)) && shape.cell_columns() % stride == 0 &&
         shape.cell_rows() / 2 % stride == 0;
}

int plane_stride(const TileShape& shape) {
  for (const int stride : kStrides) {
    if (allows_planes(shape, stride)) return stride;
  }
  return 0;
}

int plane_count(const TileGrid& grid, int stride) {
  int count = 0;
  for (std::int64_t tiles = std::max(grid.tile_columns(), grid.tile_rows()); tiles > 1; ++count) {
    tiles = tiles_above(tiles, stride);
  }
  return count;
}

Planes::Planes(const TileGrid& grid, int stride, int count, bool wraps_x)
    : stride_(stride), wraps_x_(wraps_x), mesh_shape_(grid.shape()) {
  grids_.push_back(grid);
  if (count == 0) return;
  ISOHF_ASSERT(allows_planes(grid.shape(), stride));
  step_ = std::countr_zero(static_cast<unsigned>(stride));
  mesh_shape_ = with_levels(grid.shape(), step_ + 1);
  for (int plane = 1; plane <= count; ++plane) {
    const TileGrid& below = grids_.back();
    grids_.push_back(TileGrid::make(grid.shape(), tiles_above(below.tile_columns(), stride),
                                    tiles_above(below.tile_rows(), stride), below.extent_x() * stride,
                                    below.extent_z() * stride));
  }
}

int Planes::plane_for_spacing(double step_x, double step_z) const {
  int plane = 0;
  while (plane < count() && 2.0 * grid(plane + 1).sigma_x() <= step_x && grid(plane + 1).sigma_z() <= step_z) ++plane;
  return plane;
}

bool Planes::is_joined(int plane) const {
  return wraps_x_ && grid(plane).tile_columns() * scale(plane) == grid(0).tile_columns();
}

bool Planes::is_beyond(int plane, LatticeVertex vertex) const {
  const TileShape& shape = grid(0).shape();
  const std::int64_t reach = std::int64_t{1} << (mesh_shape_.levels() - 1);
  const auto is_far = [&](std::int64_t at, std::int64_t cells, std::int64_t step) {
    return (at - reach * step) * scale(plane) > cells;
  };
  return plane > 0 && ((!is_joined(plane) && is_far(vertex.x, grid(0).tile_columns() * 2 * shape.cell_columns(), 2)) ||
                       is_far(vertex.z, grid(0).tile_rows() * shape.cell_rows(), 1));
}

std::int64_t Planes::x_below(int below, int plane, std::int64_t x) const {
  const std::int64_t width = grid(below).tile_columns() * 2 * grid(below).shape().cell_columns();
  x *= scale(plane - below);
  if (is_joined(plane)) {
    if (x < 0) return x + width;
    if (x > width) return x - width;
  }
  return std::clamp(x, std::int64_t{0}, width);
}

std::int64_t Planes::z_below(int below, int plane, std::int64_t z) const {
  return std::clamp(z * scale(plane - below), std::int64_t{0},
                    grid(below).tile_rows() * grid(below).shape().cell_rows());
}

TileRange Planes::below(int plane, TileIndex tile) const {
  const TileGrid& fine = grid(plane - 1);
  const TileIndex first{tile.column * stride_, tile.row * stride_};
  return {first,
          {std::min(first.column + stride_, fine.tile_columns()), std::min(first.row + stride_, fine.tile_rows())}};
}

}  // namespace isohf
