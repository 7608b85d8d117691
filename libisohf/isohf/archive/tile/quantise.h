#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/metadata.h"

namespace isohf {

/// What quantising one tile did.
struct QuantiserCounts {
  std::int64_t below = 0;       ///< elevations below code 0
  std::int64_t above = 0;       ///< elevations above the last code
  double worst_rounding = 0.0;  ///< largest |stored - computed|, without the clamped ones, vertical units
};

/// The elevations of the first and the last code, which nothing stored lies beyond; infinities for floats.
struct CodeLimits {
  double lowest;
  double highest;
};
[[nodiscard]] CodeLimits code_limits(const Quantisation& quantisation);
/// The same where a range was asked for: that range.
[[nodiscard]] CodeLimits code_limits(const Metadata& metadata);

/// Turns heights relative to `datum` into codes (or floats). NaN becomes the void code; elevations beyond `limits`,
/// which are code 0 and another one, become these and are counted where more than half a step beyond (floats: never).
/// heights [n]   tile out, resized to n. Rounds halves up. O(n), vectorised.
QuantiserCounts quantise(const Quantisation& quantisation, const CodeLimits& limits, double datum,
                         std::span<const float> heights, TileCodes& tile);
/// The same of codes alone, each the nearest to `smooth`, heights likewise, of those that lie within `most_off` of the
/// elevation; where none does, or `smooth` is NaN, the nearest to the elevation. most_off > half a step.
QuantiserCounts quantise_within(const Quantisation& quantisation, const CodeLimits& limits, double datum,
                                double most_off, std::span<const float> heights, std::span<const float> smooth,
                                TileCodes& tile);
/// With all the codes that there are.
QuantiserCounts quantise(const Quantisation& quantisation, double datum, std::span<const float> heights,
                         TileCodes& tile);

/// The elevation that a code stands for.
[[nodiscard]] inline double elevation_from_code(const Quantisation& quantisation, std::uint32_t code) {
  return quantisation.offset + quantisation.scale * code;
}

/// The elevation of a tile's i-th vertex, NaN where void.
[[nodiscard]] inline double elevation_of_vertex(const TileCodes& tile, const Quantisation& quantisation,
                                                std::size_t i) {
  if (tile.type == CodeType::kF32) return static_cast<double>(tile.heights[i]);
  return tile.codes[i] == quantisation.void_code() ? std::numeric_limits<double>::quiet_NaN()
                                                   : elevation_from_code(quantisation, tile.codes[i]);
}

/// All C*R elevations of a tile, NaN where void.
[[nodiscard]] std::vector<double> elevations_of(const TileCodes& tile, const Quantisation& quantisation);

}  // namespace isohf
