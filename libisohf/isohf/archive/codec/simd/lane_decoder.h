#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/codec/tile_codec.h"

namespace isohf {

/// Tiles that are decoded side by side, one in each lane of the machine's registers: a tile's samples wait for the one
/// before, the samples of other tiles do not.
inline constexpr std::size_t kDecoderLanes = 8;

/// Decodes up to kDecoderLanes payloads into `tiles`, of the same number: the fast twin of decode_tile's loop.
/// `decoded[i]` tells whether tile i was; where not, the payload is not one for this decoder (equal samples) or is
/// broken, and decode_tile has the answer.
void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded);

}  // namespace isohf
