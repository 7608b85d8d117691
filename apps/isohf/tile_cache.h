#pragma once

#include <cstdint>
#include <list>
#include <unordered_map>
#include <vector>

#include "isohf/archive/reader.h"
#include "isohf/base/view.h"

namespace isohf::cli {

/// A decoded tile.
struct CachedTile {
  std::int64_t flat_index = 0;
  std::vector<double> elevations;  ///< C*R, NaN where void
  /// The same less the tile's first elevation, for slopes: single precision is enough for differences.
  std::vector<float> relative;
};

/// The tiles used last, decoded. Keeps at most `memory_bytes` of them, but always one. One thread.
class TileCache {
 public:
  TileCache(const ArchiveReader& archive, std::uint64_t memory_bytes);

  /// The tile, from the cache or decoded now; valid until the next call. Throws as ArchiveReader does.
  const CachedTile& tile(TileIndex index);

 private:
  const ArchiveReader& archive_;
  std::size_t capacity_;
  std::list<CachedTile> tiles_;  ///< last used first
  std::unordered_map<std::int64_t, std::list<CachedTile>::iterator> by_index_;
};

}  // namespace isohf::cli
