#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/codec/simd/batch_rows.h"
#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// Decodes up to kBatchLanes payloads into `tiles`, of the same number: the fast twin of decode_tile's loop.
/// `decoded[i]` tells whether tile i was; where not, the payload is not one for this decoder (equal samples) or is
/// broken, and decode_tile has the answer.
void decode_batch(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded);

}  // namespace isohf
