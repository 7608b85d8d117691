#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "isohf/archive.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/error.h"
#include "isohf/mesh.h"
#include "isohf/restore/mesh/level_error.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(std::string what) {
  throw Error(ErrorCode::kInvalidArgument, std::move(what));
}

/// The tiles of a plane that stand for some of plane 0.
TileRange tiles_above(const TileRange& tiles, std::int64_t scale) {
  const auto end = [scale](std::int64_t at) { return (at + scale - 1) / scale; };
  return {{tiles.first.column / scale, tiles.first.row / scale}, {end(tiles.end.column), end(tiles.end.row)}};
}

/// One level of detail through all planes.
MeshPlan plan_of_level(const Planes& planes, const TileRange& tiles, int level) {
  MeshPlan plan;
  const int step = planes.count() > 0 ? std::countr_zero(static_cast<unsigned>(planes.stride())) : planes.levels();
  plan.plane = std::min(level / step, planes.count());
  plan.level = level - plan.plane * step;
  plan.tiles = tiles_above(tiles, planes.scale(plan.plane));
  plan.triangles = plan.tiles.count() * planes.mesh_shape().strip_triangle_count(plan.level);
  return plan;
}

MeshPlan plan_within(const Planes& planes, const TileRange& tiles, std::int64_t most) {
  MeshPlan plan;
  for (int level = 0; level < planes.levels(); ++level) {
    plan = plan_of_level(planes, tiles, level);
    if (plan.triangles <= most) return plan;
  }
  refuse(fmt::format("`max_triangles` is {}, the coarsest level has {}", most, plan.triangles));
}

/// The coarsest level of each tile within an error.
MeshPlan plan_by_error(const ArchiveReader& archive, const TileRange& tiles, double most, const Job& job) {
  const TileShape& shape = archive.grid().shape();
  MeshPlan plan;
  plan.tiles = tiles;
  plan.levels.resize(static_cast<std::size_t>(tiles.count()));
  const std::int64_t columns = tiles.end.column - tiles.first.column;
  constexpr std::int64_t kBatch = 256;
  for (std::int64_t first = 0; first < tiles.count(); first += kBatch) {
    job.throw_if_cancelled();
    const std::int64_t end = std::min(first + kBatch, tiles.count());
    oneapi::tbb::parallel_for(first, end, [&](std::int64_t i) {
      const TileIndex tile{tiles.first.column + i % columns, tiles.first.row + i / columns};
      int level = 0;
      if (archive.tile_entry(tile).stored) {
        const std::vector<double> elevations = archive.read_elevations(tile);
        while (level + 1 < shape.levels() && level_error(shape, level + 1, elevations) <= most) ++level;
      }
      plan.levels[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(level);
    });
    job.report({"levels", "tiles", end, tiles.count()});
  }
  for (const int level : plan.levels) {
    plan.triangles += shape.strip_triangle_count(level) + shape.stitch_triangle_count(level);
  }
  return plan;
}

}  // namespace

int MeshPlan::level_of(TileIndex tile) const {
  if (levels.empty()) return level;
  const std::int64_t columns = tiles.end.column - tiles.first.column;
  return levels[static_cast<std::size_t>((tile.row - tiles.first.row) * columns + tile.column - tiles.first.column)];
}

MeshPlan plan_mesh(const ArchiveReader& archive, const MeshRequest& request, const Job& job) {
  const TileGrid& grid = archive.grid();
  const TileRange whole{{0, 0}, {grid.tile_columns(), grid.tile_rows()}};
  const TileRange tiles = request.tiles.value_or(whole);
  if (tiles.is_empty() || intersection(tiles, whole) != tiles) {
    refuse(fmt::format("`tiles` reach beyond the {} x {} tiles that there are", grid.tile_columns(), grid.tile_rows()));
  }
  if (request.level.has_value() + request.max_triangles.has_value() + request.max_error.has_value() > 1) {
    refuse("`level`, `max_triangles` and `max_error` exclude each other");
  }
  if (!std::isfinite(request.elevation_scale)) refuse("the scale of elevations is not a number");
  const Planes planes = planes_of(archive.metadata());
  MeshPlan plan;
  if (request.max_error) {
    if (!(*request.max_error >= 0.0)) refuse(fmt::format("`max_error` is {}, must be 0 or more", *request.max_error));
    plan = plan_by_error(archive, tiles, *request.max_error, job);
  } else if (request.max_triangles) {
    plan = plan_within(planes, tiles, *request.max_triangles);
  } else {
    const int level = request.level.value_or(0);
    if (level < 0 || level >= planes.levels()) {
      refuse(fmt::format("`level` is {}, must be 0 to {}", level, planes.levels() - 1));
    }
    plan = plan_of_level(planes, tiles, level);
  }
  plan.elevation_scale = request.elevation_scale;
  const TileGrid& used = planes.grid(plan.plane);
  plan.corner = {static_cast<double>(plan.tiles.first.column) * used.extent_x(),
                 static_cast<double>(plan.tiles.first.row) * used.extent_z()};
  plan.size = {
      std::min(static_cast<double>(plan.tiles.end.column) * used.extent_x(), grid.world_width()) - plan.corner.x,
      std::min(static_cast<double>(plan.tiles.end.row) * used.extent_z(), grid.world_height()) - plan.corner.z};
  return plan;
}

}  // namespace isohf
