#pragma once

#include <cstdint>
#include <span>

#include "isohf/archive/metadata.h"
#include "isohf/archive/tile_codec.h"

namespace isohf {

/// What quantising one tile did.
struct QuantiserCounts {
  std::int64_t below = 0;       ///< elevations below code 0
  std::int64_t above = 0;       ///< elevations above the last code
  double worst_rounding = 0.0;  ///< largest |stored - computed|, without the clamped ones, vertical units
};

/// Turns heights relative to `datum` into codes (or floats). NaN becomes the void code; elevations outside the codes'
/// range become the first or last code and are counted.
/// heights [n]   tile out, resized to n. Rounds halves up. O(n), vectorised.
QuantiserCounts quantise(const Quantisation& quantisation, double datum, std::span<const float> heights,
                         TileCodes& tile);

/// The elevations of the first and the last code, which nothing stored lies beyond; infinities for floats.
struct CodeLimits {
  double lowest;
  double highest;
};
[[nodiscard]] CodeLimits code_limits(const Quantisation& quantisation);

/// The elevation that a code stands for.
[[nodiscard]] inline double elevation_from_code(const Quantisation& quantisation, std::uint32_t code) {
  return quantisation.offset + quantisation.scale * code;
}

}  // namespace isohf
