#pragma once

#include "isohf/archive/codec/predict/predictor_fit.h"
#include "isohf/archive/codec/residuals/residual_streams.h"
#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// What the encoder does at a level.
struct CodingEffort {
  FitEffort fit;
  StreamEffort streams;
};

/// The effort of a level. Throws Error{kInvalidArgument} where it is not kMinLevel to kMaxLevel.
[[nodiscard]] CodingEffort coding_effort(int level);

/// The versions of payloads. The best: 2 where codes are coarse for their ground, else 1 (decision 44), at high levels the
/// shorter one (decision 62).
enum class PayloadVersion : std::uint8_t { kBest, kFirst, kAdaptive };

/// Codes one tile: hexagonal prediction, residuals in contexts, Deflate. Deterministic; thread-safe.
/// `tile` holds shape.stored_vertex_count() samples; `level` is kMinLevel to kMaxLevel; `version` is for tests: kAdaptive
/// also for few samples. Never fails on data; throws Error{kOutOfMemory}, and Error{kInvalidArgument} for another level.
[[nodiscard]] EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, int level = kDefaultLevel,
                                      PayloadVersion version = PayloadVersion::kBest);

}  // namespace isohf
