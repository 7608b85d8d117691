#pragma once

#include <algorithm>

#include "isohf/lattice/planes.h"
#include "isohf/metadata.h"

namespace isohf {

/// The planes that an archive's metadata state.
[[nodiscard]] inline Planes planes_of(const Metadata& metadata) {
  return {metadata.grid, metadata.planes.stride, metadata.planes.count, metadata.wraps_x};
}

/// The planes that such tiles get: none where one tile is all, or where the shape allows no stride.
[[nodiscard]] inline PlaneInfo planes_for(const TileGrid& grid) {
  PlaneInfo info;
  info.stride = plane_stride(grid.shape());
  if (info.stride == 0) return {};
  info.count = plane_count(grid, info.stride);
  double extent = std::max(grid.extent_x(), grid.extent_z());
  for (int plane = 0; plane < info.count; ++plane) extent *= info.stride;
  return extent <= kMaxExtent ? info : PlaneInfo();
}

}  // namespace isohf
