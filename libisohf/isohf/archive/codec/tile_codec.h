#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// Codes one tile: hexagonal prediction, residuals in context streams, Deflate. Deterministic; thread-safe.
/// `tile` holds shape.stored_vertex_count() samples; `level` is kMinLevel to kMaxLevel. Never fails on data; throws
/// Error{kOutOfMemory}, and Error{kInvalidArgument} for another level.
[[nodiscard]] EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, int level = kDefaultLevel);

/// Decodes one tile from its inflated payload. Trusts nothing: throws Error{kCorrupt} for whatever encode_tile would
/// not have made and that cannot be read exactly, Error{kUnsupported} for a codec version of the future. Thread-safe.
[[nodiscard]] TileCodes decode_tile(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

/// The same by the plain loop alone, one sample after the other: what decode_tile is held against.
[[nodiscard]] TileCodes decode_tile_slowly(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

}  // namespace isohf
