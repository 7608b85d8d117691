#pragma once

#include <string>

#include "isohf/tile_range.h"

namespace isohf::cli {

/// "A:B,C:D": columns A to B-1 and rows C to D-1 of tiles. Throws Error{kInvalidArgument}.
[[nodiscard]] TileRange parse_tile_range(const std::string& text);

}  // namespace isohf::cli
