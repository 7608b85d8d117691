#pragma once

#include <cstddef>
#include <span>

#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// Decodes one tile's codes of version 1, eight rows at once (slanted_rows.h). False where the samples are all equal or
/// the payload is broken: the plain decoder has the answer.
[[nodiscard]] bool decode_single(const TileShape& shape, CodeType type, std::span<const std::byte> bytes,
                                 TileCodes& tile);

}  // namespace isohf
