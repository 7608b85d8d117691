#include "isohf/lattice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"

namespace isohf {

TileGrid TileGrid::make(const TileShape& shape, std::int64_t tile_columns, std::int64_t tile_rows, double extent_x,
                        double extent_z) {
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, "tile grid: " + why); };
  if (tile_columns < 1 || tile_rows < 1)
    refuse(fmt::format("{}x{} tiles, must be at least 1x1", tile_columns, tile_rows));
  if (tile_columns > kMaxTilesPerAxis || tile_rows > kMaxTilesPerAxis || tile_columns > kMaxTiles / tile_rows) {
    refuse(fmt::format("{}x{} tiles, must be at most {} in one direction and {} in all", tile_columns, tile_rows,
                       kMaxTilesPerAxis, kMaxTiles));
  }
  const auto usable = [](double extent) { return extent >= kMinExtent && extent <= kMaxExtent; };
  if (!usable(extent_x) || !usable(extent_z)) {
    refuse(fmt::format("tile extent is {} x {}, must lie in {} to {}", extent_x, extent_z, kMinExtent, kMaxExtent));
  }
  return {shape, tile_columns, tile_rows, extent_x, extent_z};
}

bool TileGrid::contains(WorldPoint point) const {
  return point.x >= 0.0 && point.z >= 0.0 && point.x <= world_width() && point.z <= world_height();
}

TilePoint TileGrid::locate(WorldPoint point) const {
  const auto axis = [](double world, double extent, std::int64_t tiles, double cells) {
    if (std::isnan(world)) return std::pair{std::int64_t{0}, 0.0};
    const double tile = std::clamp(std::floor(world / extent), 0.0, static_cast<double>(tiles - 1));
    const double object = std::clamp((world - tile * extent) / extent * cells, 0.0, cells);
    return std::pair{static_cast<std::int64_t>(tile), object};
  };
  const auto [column, x] = axis(point.x, extent_x_, tile_columns_, 2.0 * shape_.cell_columns());
  const auto [row, z] = axis(point.z, extent_z_, tile_rows_, shape_.cell_rows());
  return {{column, row}, {x, z}};
}

LatticeVertex TileGrid::lattice_vertex(TileIndex tile, GridVertex vertex) const {
  const ObjectVertex object = object_from_grid(shape_, vertex);
  return {tile.column * 2 * shape_.cell_columns() + object.x, tile.row * shape_.cell_rows() + object.z};
}

WorldPoint TileGrid::world_from_object(TileIndex tile, ObjectPoint point) const {
  const double x = static_cast<double>(tile.column * 2 * shape_.cell_columns()) + point.x;
  const double z = static_cast<double>(tile.row * shape_.cell_rows()) + point.z;
  return {x * sigma_x(), z * sigma_z()};
}

}  // namespace isohf
