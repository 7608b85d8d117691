#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/tile_codec.h"

namespace isohf {

/// Tiles that are decoded side by side. Each of a tile's samples waits for the one before it; samples of other tiles
/// fill the time.
inline constexpr std::size_t kDecoderLanes = 4;

/// Decodes up to kDecoderLanes payloads of 16- or 8-bit codes into `tiles`, of the same number: the fast twin of
/// decode_tile's loop. `decoded[i]` tells whether tile i was; where not, the payload is not one for this decoder
/// (floats, voids, equal samples) or is broken, and decode_tile has the answer.
void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded);

}  // namespace isohf
