#include "tile_cache.h"

#include <algorithm>
#include <cmath>

namespace isohf::cli {

TileCache::TileCache(const ArchiveReader& archive, std::uint64_t memory_bytes) : archive_(archive) {
  const auto per_tile =
      static_cast<std::uint64_t>(archive.grid().shape().stored_vertex_count()) * (sizeof(double) + sizeof(float));
  capacity_ = static_cast<std::size_t>(std::max<std::uint64_t>(1, memory_bytes / per_tile));
}

const CachedTile& TileCache::tile(TileIndex index) {
  const std::int64_t flat = archive_.grid().flat_index(index);
  if (const auto found = by_index_.find(flat); found != by_index_.end()) {
    tiles_.splice(tiles_.begin(), tiles_, found->second);
    return tiles_.front();
  }
  CachedTile tile;
  tile.flat_index = flat;
  tile.elevations = archive_.read_elevations(index);
  const auto first =
      std::find_if(tile.elevations.begin(), tile.elevations.end(), [](double e) { return !std::isnan(e); });
  const double datum = first == tile.elevations.end() ? 0.0 : *first;
  tile.relative.reserve(tile.elevations.size());
  for (const double elevation : tile.elevations) tile.relative.push_back(static_cast<float>(elevation - datum));
  if (tiles_.size() >= capacity_) {
    by_index_.erase(tiles_.back().flat_index);
    tiles_.pop_back();
  }
  tiles_.push_front(std::move(tile));
  by_index_[flat] = tiles_.begin();
  return tiles_.front();
}

}  // namespace isohf::cli
