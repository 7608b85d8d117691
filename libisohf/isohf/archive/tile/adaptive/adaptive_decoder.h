#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// Decodes a payload of version 2, sample by sample. Throws Error{kCorrupt}. O(C*R).
[[nodiscard]] TileCodes decode_adaptive(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

}  // namespace isohf
