#include "paging/tile_source.h"

#include <algorithm>
#include <limits>

#include "isohf/error.h"

namespace isohf::view {

void TileSource::read_lit(TileIndex, const RowSun&, std::span<std::uint16_t>, std::span<std::uint16_t>) const {
  throw Error(ErrorCode::kUnsupported, "this source has no shadow seeds");
}

Picture TileSource::read_texture(TileIndex, int) const {
  throw Error(ErrorCode::kUnsupported, "this source has no textures");
}

TileBounds whole_bounds(const TileSource& source) {
  TileBounds whole{false, false, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const TileGrid& grid = source.grid();
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    const TileBounds tile = source.bounds(grid.tile_at(flat));
    if (!tile.stored) continue;
    whole.stored = true;
    whole.has_voids |= tile.has_voids;
    whole.low = std::min(whole.low, tile.low);
    whole.high = std::max(whole.high, tile.high);
  }
  if (!whole.stored) return {};
  return whole;
}

}  // namespace isohf::view
