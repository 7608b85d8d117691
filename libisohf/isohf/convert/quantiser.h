#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "isohf/archive/metadata.h"
#include "isohf/archive/tile_codec.h"
#include "isohf/surface/heightmap.h"
#include "isohf/surface/source_scan.h"

namespace isohf {

/// How codes are to be chosen.
struct QuantisationRequest {
  CodeType type = CodeType::kU16;
  std::optional<double> step;  ///< elevation of one code; 0: the finest that the type holds; nullopt: chosen
};

/// One scale and offset for the whole dataset.
///
/// The chosen step is half of the source's own for integer samples, doubled until the range fits, and the finest
/// that fits for floats. The offset is a multiple of the step, so that whole elevations stay whole.
/// Throws Error{kInvalidArgument} where a step that was asked for needs more codes than the type has, naming the
/// smallest one that fits.
[[nodiscard]] Quantisation choose_quantisation(const QuantisationRequest& request, const ElevationRange& range,
                                               const SourceInfo& info);

/// True where steps of this scale reach over the whole range with the codes that the type has.
[[nodiscard]] bool has_codes_for(const Quantisation& quantisation, const ElevationRange& range);

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

/// The elevation that a code stands for.
[[nodiscard]] inline double elevation_from_code(const Quantisation& quantisation, std::uint32_t code) {
  return quantisation.offset + quantisation.scale * code;
}

}  // namespace isohf
