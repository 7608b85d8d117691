#include "isohf/restore/scattered_surface.h"

#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <utility>

#include "isohf/base/assert.h"
#include "isohf/base/view.h"
#include "isohf/lattice/barycentric.h"

namespace isohf {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

/// Neighbouring places on one tile.
struct Run {
  std::size_t first;
  std::size_t end;
};

}  // namespace

ScatteredSurface::ScatteredSurface(const TileGrid& grid, const Quantisation& quantisation,
                                   SurfaceRows::ReadTile read_tile)
    : grid_(grid), quantisation_(quantisation), read_tile_(std::move(read_tile)) {}

ScatteredSurface::Heights ScatteredSurface::decode(std::int64_t tile) const {
  return std::make_shared<const std::vector<double>>(elevations_of(read_tile_(grid_.tile_at(tile)), quantisation_));
}

void ScatteredSurface::read(std::span<const WorldPoint> places, std::span<double> elevations) {
  ISOHF_ASSERT(places.size() == elevations.size());
  std::map<std::int64_t, std::vector<Run>> runs;
  std::int64_t last = -1;
  for (std::size_t i = 0; i < places.size(); ++i) {
    elevations[i] = kVoid;
    const bool is_inside = !std::isnan(places[i].x) && !std::isnan(places[i].z) && grid_.contains(places[i]);
    const std::int64_t tile = is_inside ? grid_.flat_index(grid_.locate(places[i]).tile) : -1;
    if (tile >= 0 && tile != last) runs[tile].push_back({i, i});
    if (tile >= 0) runs[tile].back().end = i + 1;
    last = tile;
  }
  std::erase_if(kept_, [&](const auto& tile) { return runs.find(tile.first) == runs.end(); });
  std::vector<std::pair<std::int64_t, const std::vector<Run>*>> tiles;
  for (const auto& [tile, of_tile] : runs) tiles.emplace_back(tile, &of_tile);
  const std::size_t tile_bytes = static_cast<std::size_t>(grid_.shape().stored_vertex_count()) * sizeof(double);
  // The last ones are the southernmost: the next call most likely meets them again.
  const std::size_t may_keep = kKeptBytes / tile_bytes;
  const std::size_t first_kept = tiles.size() > may_keep ? tiles.size() - may_keep : 0;
  std::vector<Heights> decoded(tiles.size());
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const auto found = kept_.find(tiles[i].first);
    if (found != kept_.end()) decoded[i] = found->second;
  }
  kept_.clear();
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    Heights heights = decoded[i] ? decoded[i] : decode(tiles[i].first);
    const View2D<const double> view(heights->data(), grid_.shape().columns(), grid_.shape().rows());
    for (const Run& run : *tiles[i].second) {
      for (std::size_t at = run.first; at < run.end; ++at) {
        elevations[at] = interpolate(barycentric(grid_.shape(), grid_.locate(places[at]).point), view);
      }
    }
    decoded[i] = i >= first_kept ? std::move(heights) : nullptr;
  });
  for (std::size_t i = first_kept; i < tiles.size(); ++i) kept_.emplace(tiles[i].first, std::move(decoded[i]));
}

}  // namespace isohf
