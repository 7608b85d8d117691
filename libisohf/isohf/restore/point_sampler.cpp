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

#include "isohf/archive/codec/quantise.h"
#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/base/assert.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/surface/shade/normals.h"

namespace isohf {
namespace {

/// A place by the tile that holds it; ordered so, and within a tile as they came.
using PlaceOfTile = std::pair<std::int64_t, std::size_t>;

/// One tile's surface, from its codes.
class TileSurface {
 public:
  /// scratch  C*R heights, whatever they are
  TileSurface(const TileGrid& grid, const Quantisation& quantisation, const TileCodes& codes,
              std::vector<float>& scratch)
      : grid_(grid), quantisation_(quantisation), codes_(codes), scratch_(scratch) {
    const auto count = static_cast<std::size_t>(grid.shape().stored_vertex_count());
    for (std::size_t i = 0; i < count; ++i) {
      const double elevation = elevation_at(i);
      if (std::isnan(elevation)) continue;
      datum_ = elevation;
      break;
    }
  }

  void sample(ObjectPoint point, SurfaceSample& sample) {
    const Barycentric where = barycentric(grid_.shape(), point);
    sample.elevation = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      if (where.weights[i] > 0.0) sample.elevation += where.weights[i] * elevation_at(at(where.vertices[i]));
    }
    sample.state = std::isnan(sample.elevation) ? SurfaceSample::State::kVoid : SurfaceSample::State::kSurface;
    if (sample.state == SurfaceSample::State::kVoid) return;
    fill_around(where);
    const View2D<const float> heights(scratch_.data(), grid_.shape().columns(), grid_.shape().rows());
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (where.weights[i] <= 0.0) continue;
      const Normal normal = vertex_normal(grid_, heights, where.vertices[i]);
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
    return static_cast<std::size_t>(vertex.row) * static_cast<std::size_t>(grid_.shape().columns()) +
           static_cast<std::size_t>(vertex.column);
  }

  [[nodiscard]] double elevation_at(std::size_t i) const {
    if (codes_.type == CodeType::kF32) return double{codes_.heights[i]};
    const std::uint32_t code = codes_.codes[i];
    return code == quantisation_.void_code() ? std::numeric_limits<double>::quiet_NaN()
                                             : elevation_from_code(quantisation_, code);
  }

  /// Heights above the datum of all vertices that the normals of a triangle's vertices depend on: single precision is
  /// enough for differences.
  void fill_around(const Barycentric& where) {
    const auto& [g, h, i] = where.vertices;
    const int first_row = std::min(g.row, h.row) - 1;
    const int last_row = std::max(g.row, h.row) + 1;
    const int first_column = std::max(std::min(g.column, h.column) - 1, 0);
    const int last_column = std::min(std::max(h.column, i.column) + 2, grid_.shape().columns() - 1);
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        const std::size_t vertex = at({column, row});
        scratch_[vertex] = static_cast<float>(elevation_at(vertex) - datum_);
      }
    }
  }

  const TileGrid& grid_;
  const Quantisation& quantisation_;
  const TileCodes& codes_;
  std::vector<float>& scratch_;
  double datum_ = 0.0;
};

}  // namespace

PointSampler::PointSampler(const ArchiveReader& archive, std::uint64_t memory_bytes) : archive_(archive) {
  const std::uint64_t bytes = archive.metadata().quantisation.type == CodeType::kF32 ? 4 : 2;
  const std::uint64_t tile_bytes = static_cast<std::uint64_t>(archive.grid().shape().stored_vertex_count()) * bytes;
  const auto threads = static_cast<std::uint64_t>(oneapi::tbb::this_task_arena::max_concurrency());
  capacity_ = static_cast<std::size_t>(std::max<std::uint64_t>(1, memory_bytes / tile_bytes));
  // Large tiles in all lanes of all threads would take more than is to be kept.
  tiles_together_ = std::clamp<std::size_t>(capacity_ / threads, 1, kBatchLanes);
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
  if (used_.size() >= capacity_) {
    by_tile_.erase(used_.back().tile);
    used_.pop_back();
  }
  used_.push_front({tile, codes});
  by_tile_[tile] = used_.begin();
}

void PointSampler::sample(std::span<const WorldPoint> places, std::span<SurfaceSample> samples) {
  ISOHF_ASSERT(places.size() == samples.size());
  const TileGrid& grid = archive_.grid();
  std::vector<PlaceOfTile> order;
  order.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    samples[i] = {};
    if (!grid.contains(places[i])) continue;
    samples[i].tile = grid.locate(places[i]).tile;
    order.emplace_back(grid.flat_index(samples[i].tile), i);
  }
  oneapi::tbb::parallel_sort(order.begin(), order.end());
  std::vector<std::span<const PlaceOfTile>> tiles;  // the places of each
  for (std::size_t first = 0, i = 1; first < order.size(); ++i) {
    if (i < order.size() && order[i].first == order[first].first) continue;
    tiles.emplace_back(order.data() + first, i - first);
    first = i;
  }
  oneapi::tbb::enumerable_thread_specific<std::vector<float>> scratches(
      [&] { return std::vector<float>(static_cast<std::size_t>(grid.shape().stored_vertex_count())); });
  const std::size_t groups = (tiles.size() + tiles_together_ - 1) / tiles_together_;
  oneapi::tbb::parallel_for(std::size_t{0}, groups, [&](std::size_t group) {
    const std::size_t first = group * tiles_together_;
    const auto of_group = std::span(tiles).subspan(first, std::min(tiles_together_, tiles.size() - first));
    std::vector<Codes> codes;
    std::vector<TileIndex> missing;
    for (const auto& tile : of_group) {
      codes.push_back(kept(tile.front().first));
      if (!codes.back()) missing.push_back(grid.tile_at(tile.front().first));
    }
    std::vector<TileCodes> read = missing.empty() ? std::vector<TileCodes>{} : archive_.read_tiles(missing);
    for (std::size_t i = 0, next = 0; i < codes.size(); ++i) {
      if (codes[i]) continue;
      codes[i] = std::make_shared<const TileCodes>(std::move(read[next++]));
      keep(of_group[i].front().first, codes[i]);
    }
    for (std::size_t i = 0; i < codes.size(); ++i) {
      TileSurface surface(grid, archive_.metadata().quantisation, *codes[i], scratches.local());
      for (const auto& [tile, place] : of_group[i]) surface.sample(grid.locate(places[place]).point, samples[place]);
    }
  });
}

}  // namespace isohf
