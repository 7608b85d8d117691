#pragma once

#include <cstddef>

#include "isohf/archive/codec/predict/predictor_fit.h"
#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// What the encoder does at a level.
struct CodingEffort {
  FitEffort fit;
  std::size_t context_thinning = 3;  ///< one residual in so many decides on the contexts of a large tile; odd
  bool has_pairs = true;             ///< symbols may be paired
};

/// The effort of a level. Throws Error{kInvalidArgument} where it is not kMinLevel to kMaxLevel.
[[nodiscard]] CodingEffort coding_effort(int level);

}  // namespace isohf
