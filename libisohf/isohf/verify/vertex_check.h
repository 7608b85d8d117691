#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>

#include "isohf/archive.h"
#include "isohf/raster.h"

namespace isohf {

/// Every stored vertex of an archive against the source, resampled once more as the metadata say that it was.
struct VertexReport {
  std::int64_t vertices = 0;  ///< C*R of all tiles: slid ones and padding included
  std::int64_t voids = 0;     ///< of these, void on both sides
  std::int64_t clamped = 0;   ///< beyond the codes' range in the source, and stored at its end
  std::int64_t wrong = 0;     ///< void on one side only, or further off than `bound`
  double bound = 0.0;         ///< vertical units: half a step, and the rounding of the heights' floats
  double worst = 0.0;         ///< largest |stored - resampled| of those that are not clamped
  std::optional<TileIndex> first_wrong;
};

/// Streams both sides; memory as for converting. Throws Error{kInvalidArgument} where the metadata name a filter that
/// this build does not have; otherwise what reading throws.
[[nodiscard]] VertexReport check_vertices(const ArchiveReader& archive, HeightSource& source, int threads,
                                          const std::function<void(std::int64_t, std::int64_t)>& progress,
                                          const std::atomic<bool>& cancel);

}  // namespace isohf
