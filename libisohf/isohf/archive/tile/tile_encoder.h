#pragma once

#include "isohf/archive/tile/predict/predictor_fit.h"
#include "isohf/archive/tile/residuals/residual_streams.h"
#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// What the encoder does for one coding of a tile.
struct CodingEffort {
  FitEffort fit;
  StreamEffort streams;
};

/// The first coding that is tried.
[[nodiscard]] CodingEffort coding_effort(Effort effort);

/// The versions of payloads. The best: 2 where codes are coarse for their ground, else 1 (decision 44), with the best effort the
/// shorter one (decision 62).
enum class PayloadVersion : std::uint8_t { kBest, kFirst, kAdaptive };

/// Codes one tile: hexagonal prediction, residuals in contexts, Deflate. Deterministic; thread-safe.
/// `tile` holds shape.stored_vertex_count() samples; `version` is for tests: kAdaptive also for few samples. Never fails
/// on data; throws Error{kOutOfMemory}.
[[nodiscard]] EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, Effort effort = Effort::kDefault,
                                      PayloadVersion version = PayloadVersion::kBest);

}  // namespace isohf
