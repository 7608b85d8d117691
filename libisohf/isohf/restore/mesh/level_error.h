#pragma once

#include <span>

#include "isohf/lattice.h"

namespace isohf {

/// How far the strip of `level` lies from the full-detail surface of a tile, at the visible vertices of level 0:
/// largest absolute difference, in the elevations' unit. Infinite if one of the two has an elevation where the other
/// has none.
/// elevations  [C x R], NaN at nodata
[[nodiscard]] double level_error(const TileShape& shape, int level, std::span<const double> elevations);

}  // namespace isohf
