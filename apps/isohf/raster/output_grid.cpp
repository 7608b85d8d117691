#include "raster/output_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"

namespace isohf::cli {
namespace {

/// One axis of the cut: how many tiles, and of how many samples.
struct AxisCut {
  std::int64_t tiles = 1;
  std::int64_t samples = 0;
};

AxisCut cut_axis(std::int64_t& size, bool free, std::optional<std::int64_t> tiles, std::optional<std::int64_t> samples,
                 std::int64_t overlap, const char* axis) {
  const auto own = [&](std::int64_t of_tile) {
    if (of_tile <= overlap || of_tile < 2 * overlap) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("tiles of {} {} with an overlap of {}: a tile must have at least twice the overlap, and one "
                      "sample of its own",
                      of_tile, axis, overlap));
    }
    return of_tile - overlap;
  };
  if (samples) {
    const std::int64_t step = own(*samples);
    const auto near = std::max<std::int64_t>((size - overlap + step / 2) / step, 1);
    const std::int64_t count = tiles.value_or(near);
    const std::int64_t whole = count * step + overlap;
    if (free) size = whole;
    if (size != whole) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{} {} do not make {} whole tiles of {} that share {}; {} do", size, axis, count,
                              *samples, overlap, whole));
    }
    return {count, *samples};
  }
  const std::int64_t count = tiles.value_or(1);
  const std::int64_t all = size - overlap;
  if (all < count || (all % count != 0 && !free)) {
    const std::int64_t step = std::max<std::int64_t>((all + count / 2) / count, overlap + 1);
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} {} do not make {} equal tiles that share {}; {} do", size,
                                                         axis, count, overlap, count * step + overlap));
  }
  const std::int64_t of_tile = (all + count / 2) / count + overlap;
  (void)own(of_tile);
  if (free) size = (of_tile - overlap) * count + overlap;
  return {count, of_tile};
}

}  // namespace

SampleGrid grid_over(const WorldBounds& ground, bool area, const std::optional<GridSize>& size,
                     const std::optional<double>& spacing) {
  const double width = ground.x1 - ground.x0;
  const double height = ground.z1 - ground.z0;
  const auto count = [&](double length) {
    const double steps = std::floor(length / *spacing * (1.0 + 1e-12));
    return std::max<std::int64_t>(static_cast<std::int64_t>(steps) + (area ? 0 : 1), 1);
  };
  const auto step = [&](double length, std::int64_t samples) {
    const std::int64_t steps = area ? samples : samples - 1;
    return spacing ? *spacing : (steps > 0 ? length / static_cast<double>(steps) : length);
  };
  SampleGrid grid;
  grid.width = size ? size->first : count(width);
  grid.height = size ? size->second : count(height);
  grid.spacing_x = step(width, grid.width);
  grid.spacing_z = step(height, grid.height);
  grid.first_x = ground.x0 + (area ? grid.spacing_x / 2.0 : 0.0);
  grid.first_z = ground.z0 + (area ? grid.spacing_z / 2.0 : 0.0);
  return grid;
}

bool may_have_voids(const Metadata& metadata, const SampleGrid& grid) {
  const TileGrid& tiles = metadata.grid;
  const double last_x = grid.first_x + static_cast<double>(grid.width - 1) * grid.spacing_x;
  const double last_z = grid.first_z + static_cast<double>(grid.height - 1) * grid.spacing_z;
  return is_warped(metadata) || metadata.statistics.voids > 0 || metadata.outside == Outside::kVoid ||
         grid.first_x < 0.0 || grid.first_z < 0.0 || last_x > tiles.world_width() || last_z > tiles.world_height();
}

TileCut cut_into_tiles(GridSize& size, bool free, const std::optional<GridSize>& count,
                       const std::optional<GridSize>& tile_size, std::int64_t overlap) {
  const auto first = [](const std::optional<GridSize>& pair) {
    return pair ? std::optional(pair->first) : std::nullopt;
  };
  const auto second = [](const std::optional<GridSize>& pair) {
    return pair ? std::optional(pair->second) : std::nullopt;
  };
  const AxisCut x = cut_axis(size.first, free, first(count), first(tile_size), overlap, "columns");
  const AxisCut z = cut_axis(size.second, free, second(count), second(tile_size), overlap, "rows");
  return {x.tiles, z.tiles, x.samples, z.samples, overlap, count || tile_size};
}

}  // namespace isohf::cli
