#pragma once

#include "isohf/archive/tile_codec.h"

namespace isohf {

/// Counts, sum and range of one tile's visible vertices as stored; clamped and worst_rounding are left 0.
[[nodiscard]] TileStatistics tile_statistics(const TileShape& shape, const TileCodes& tile,
                                             const Quantisation& quantisation);

/// All tiles' statistics as the metadata has them.
[[nodiscard]] Statistics total_statistics(const TileStatistics& all);

}  // namespace isohf
