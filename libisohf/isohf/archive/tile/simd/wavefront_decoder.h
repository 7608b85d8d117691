#pragma once

#include "isohf/archive/tile/adaptive/adaptive_payload.h"
#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// Decodes a payload of version 2, eight rows at once, each some places behind the one above: the fast twin of
/// decode_adaptive's loop. `tile` has room for all codes, voids filled in. False where the payload is broken, of which
/// decode_adaptive has to judge.
[[nodiscard]] bool decode_wavefront(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile);

}  // namespace isohf
