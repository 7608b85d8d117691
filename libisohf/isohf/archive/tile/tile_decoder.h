#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// Decodes one tile from its inflated payload. Trusts nothing: throws Error{kCorrupt} for whatever encode_tile would
/// not have made and that cannot be read exactly, Error{kUnsupported} for a codec version of the future. Thread-safe.
[[nodiscard]] TileCodes decode_tile(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

/// The same by the plain loop alone, one sample after the other: what decode_tile is held against.
[[nodiscard]] TileCodes decode_tile_slowly(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

}  // namespace isohf
