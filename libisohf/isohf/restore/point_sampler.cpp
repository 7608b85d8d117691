#include "isohf/restore/point_sampler.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/light/normals.h"

namespace isohf {
namespace {

/// Points that follow each other on one tile; ordered by tile, and within one as they came.
struct Run {
  std::int64_t tile;
  std::size_t first;
  std::size_t end;

  friend bool operator<(const Run& a, const Run& b) { return a.tile != b.tile ? a.tile < b.tile : a.first < b.first; }
};

/// One tile's surface, from its codes.
class TileSurface {
 public:
  /// grid_m   whose lengths are metres; metres are those in one elevation unit
  /// scratch  nothing, or C*R heights of any value
  TileSurface(const TileGrid& grid_m, double metres, const Quantisation& quantisation, const TileCodes& codes,
              std::vector<float>& scratch)
      : grid_m_(grid_m), metres_(metres), quantisation_(quantisation), codes_(codes), scratch_(scratch) {}

  [[nodiscard]] double elevation(const Barycentric& where) const {
    return isohf::elevation_at(grid_m_.shape(), codes_, quantisation_, where);
  }

  void sample(ObjectPoint point, SurfaceSample& sample) {
    const Barycentric where = snapped(barycentric(grid_m_.shape(), point));
    sample.elevation = elevation(where);
    sample.state = std::isnan(sample.elevation) ? SurfaceState::kNodata : SurfaceState::kSurface;
    if (sample.state == SurfaceState::kNodata) return;
    fill_around(where);
    const View2D<const float> heights(scratch_.data(), grid_m_.shape().columns(), grid_m_.shape().rows());
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (where.weights[i] <= 0.0) continue;
      const Normal normal = vertex_normal(grid_m_, heights, where.vertices[i]);
      sum[0] += where.weights[i] * static_cast<double>(normal.x);
      sum[1] += where.weights[i] * static_cast<double>(normal.y);
      sum[2] += where.weights[i] * static_cast<double>(normal.z);
    }
    // The blend is never 0: every normal points upwards. Adding 0 turns -0, which would print as such, into 0.
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (std::size_t i = 0; i < 3; ++i) sample.normal[i] = sum[i] / length + 0.0;
  }

 private:
  [[nodiscard]] std::size_t at(GridVertex vertex) const {
    return static_cast<std::size_t>(vertex.row) * static_cast<std::size_t>(grid_m_.shape().columns()) +
           static_cast<std::size_t>(vertex.column);
  }

  [[nodiscard]] double elevation_at(std::size_t i) const { return elevation_of_vertex(codes_, quantisation_, i); }

  /// The tile's first elevation.
  [[nodiscard]] double datum() {
    for (std::size_t i = 0; std::isnan(datum_); ++i) datum_ = elevation_at(i);
    return datum_;
  }

  /// Metres above the datum, of all vertices that the normals of a triangle's vertices depend on: single precision is
  /// enough for differences.
  void fill_around(const Barycentric& where) {
    const auto& [g, h, i] = where.vertices;
    const int first_row = std::min(g.row, h.row) - 1;
    const int last_row = std::max(g.row, h.row) + 1;
    const int first_column = std::max(std::min(g.column, h.column) - 1, 0);
    const int last_column = std::min(std::max(h.column, i.column) + 2, grid_m_.shape().columns() - 1);
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        const std::size_t vertex = at({column, row});
        scratch_[vertex] = static_cast<float>((elevation_at(vertex) - datum()) * metres_);
      }
    }
  }

  const TileGrid& grid_m_;
  double metres_;
  const Quantisation& quantisation_;
  const TileCodes& codes_;
  std::vector<float>& scratch_;
  double datum_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace

double elevation_at(const TileShape& shape, const TileCodes& codes, const Quantisation& quantisation,
                    const Barycentric& where) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (where.weights[i] <= 0.0) continue;
    const GridVertex vertex = where.vertices[i];
    sum += where.weights[i] *
           elevation_of_vertex(codes, quantisation,
                               static_cast<std::size_t>(vertex.row) * static_cast<std::size_t>(shape.columns()) +
                                   static_cast<std::size_t>(vertex.column));
  }
  return sum;
}

ReadTile tiles_of(const ArchiveReader& archive, int plane) {
  return [&archive, plane](TileIndex tile) { return archive.read_tile(tile, plane); };
}

void for_each_tile(const ReadTile& read_tile, TileIndex first, std::int64_t tiles,
                   const std::function<void(std::int64_t, const TileCodes&)>& use) {
  oneapi::tbb::parallel_for(std::int64_t{0}, tiles, [&](std::int64_t tile) {
    use(tile, read_tile({first.column + tile, first.row}));
  });
}

PointSampler::PointSampler(const TileGrid& grid, const Quantisation& quantisation, ReadTile read_tile,
                           std::uint64_t memory_bytes, const GroundScale& scale, const std::optional<TileGrid>& world)
    : grid_(grid),
      grid_m_(scaled(grid, scale)),
      metres_(scale.elevation),
      end_{world.value_or(grid).world_width(), world.value_or(grid).world_height()},
      quantisation_(quantisation),
      read_tile_(std::move(read_tile)) {
  const std::uint64_t bytes = quantisation.type == CodeType::kF32 ? 4 : 2;
  const std::uint64_t tile_bytes = static_cast<std::uint64_t>(grid.shape().stored_vertex_count()) * bytes;
  capacity_ = static_cast<std::size_t>(std::max<std::uint64_t>(1, memory_bytes / tile_bytes));
}

PointSampler::Codes PointSampler::kept(std::int64_t tile) {
  const std::lock_guard lock(mutex_);
  const auto found = by_tile_.find(tile);
  if (found == by_tile_.end()) return nullptr;
  used_.splice(used_.begin(), used_, found->second);
  return found->second->codes;
}

void PointSampler::keep(std::int64_t tile, const Codes& codes) {
  const std::lock_guard lock(mutex_);
  if (by_tile_.contains(tile)) return;  // another thread has decoded it too
  if (used_.size() >= capacity_) {
    by_tile_.erase(used_.back().tile);
    used_.pop_back();
  }
  used_.push_front({tile, codes});
  by_tile_[tile] = used_.begin();
}

PointSampler::Codes PointSampler::codes(TileIndex tile) {
  const std::int64_t index = grid_.flat_index(tile);
  Codes found = kept(index);
  if (found) return found;
  found = std::make_shared<const TileCodes>(read_tile_(tile));
  keep(index, found);
  return found;
}

/// Calls sample(codes, points of a tile) for each tile, `points` as runs of their numbers. tile_of(i) is the flat index
/// of the tile under a point, -1 where there is none.
template <typename TileOf, typename Sample>
void PointSampler::visit(std::size_t points, const TileOf& tile_of, const Sample& sample) {
  std::vector<Run> runs;
  std::int64_t last = -1;
  for (std::size_t i = 0; i < points; ++i) {
    const std::int64_t tile = tile_of(i);
    if (tile >= 0 && tile != last) runs.push_back({tile, i, i});
    if (tile >= 0) runs.back().end = i + 1;
    last = tile;
  }
  oneapi::tbb::parallel_sort(runs.begin(), runs.end());
  std::vector<std::span<const Run>> tiles;  // the runs of each
  for (std::size_t first = 0, i = 1; first < runs.size(); ++i) {
    if (i < runs.size() && runs[i].tile == runs[first].tile) continue;
    tiles.emplace_back(runs.data() + first, i - first);
    first = i;
  }
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(),
                            [&](std::size_t i) { sample(*codes(grid_.tile_at(tiles[i].front().tile)), tiles[i]); });
}

std::int64_t PointSampler::tile_under(WorldPoint point) const {
  // A place on the outline that went through degrees or a map, or was rounded, comes back off it.
  const double slack = 0.001 * std::min(2.0 * grid_.sigma_x(), grid_.sigma_z());
  const bool is_inside = std::abs(std::clamp(point.x, 0.0, end_.x) - point.x) <= slack &&
                         std::abs(std::clamp(point.z, 0.0, end_.z) - point.z) <= slack;
  return is_inside ? grid_.flat_index(grid_.locate(point).tile) : -1;
}

void PointSampler::sample(std::span<const WorldPoint> points, std::span<SurfaceSample> samples) {
  ISOHF_ASSERT(points.size() == samples.size());
  std::fill(samples.begin(), samples.end(), SurfaceSample{});
  oneapi::tbb::enumerable_thread_specific<std::vector<float>> scratches(
      [&] { return std::vector<float>(static_cast<std::size_t>(grid_.shape().stored_vertex_count())); });
  const auto tile_of = [&](std::size_t i) { return tile_under(points[i]); };
  visit(points.size(), tile_of, [&](const TileCodes& codes, std::span<const Run> runs) {
    TileSurface surface(grid_m_, metres_, quantisation_, codes, scratches.local());
    for (const Run& run : runs) {
      for (std::size_t i = run.first; i < run.end; ++i) {
        const TilePoint at = grid_.locate(points[i]);
        samples[i].tile = at.tile;
        surface.sample(at.point, samples[i]);
      }
    }
  });
}

void PointSampler::sample(std::span<const WorldPoint> points, std::span<double> elevations) {
  ISOHF_ASSERT(points.size() == elevations.size());
  std::fill(elevations.begin(), elevations.end(), std::numeric_limits<double>::quiet_NaN());
  const auto tile_of = [&](std::size_t i) { return tile_under(points[i]); };
  visit(points.size(), tile_of, [&](const TileCodes& codes, std::span<const Run> runs) {
    std::vector<float> no_scratch;
    const TileSurface surface(grid_m_, metres_, quantisation_, codes, no_scratch);
    for (const Run& run : runs) {
      for (std::size_t i = run.first; i < run.end; ++i) {
        elevations[i] = surface.elevation(snapped(barycentric(grid_.shape(), grid_.locate(points[i]).point)));
      }
    }
  });
}

void PointSampler::sample(std::span<const FixedPlace> places, const FixedHeights& heights,
                          std::span<double> elevations) {
  ISOHF_ASSERT(places.size() == elevations.size());
  std::fill(elevations.begin(), elevations.end(), std::numeric_limits<double>::quiet_NaN());
  const TileShape& shape = grid_.shape();
  FixedTilePlace under{};
  const auto tile_of = [&](std::size_t i) {
    return isohf::locate(grid_, places[i], under) ? grid_.flat_index(under.tile) : -1;
  };
  visit(places.size(), tile_of, [&](const TileCodes& codes, std::span<const Run> runs) {
    FixedTilePlace at{};
    for (const Run& run : runs) {
      for (std::size_t i = run.first; i < run.end; ++i) {
        (void)isohf::locate(grid_, places[i], at);
        elevations[i] = heights.elevation(fixed_height(fixed_triangle(shape, at.place), [&](GridVertex vertex) {
          return heights.at(codes, static_cast<std::size_t>(vertex.row * shape.columns() + vertex.column));
        }));
      }
    }
  });
}

}  // namespace isohf
