#pragma once

#include "isohf/archive/codec/simd/batch_residuals.h"
#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// Decodes one tile's codes of version 1, eight rows at once (slanted_rows.h): twice as fast as a batch of one. `tile` has
/// room for all codes. False where the payload has a map of predictors, or is broken: others have to judge of these.
[[nodiscard]] bool decode_single(const TileShape& shape, const BatchPayload<std::uint16_t>& payload, TileCodes& tile);

}  // namespace isohf
