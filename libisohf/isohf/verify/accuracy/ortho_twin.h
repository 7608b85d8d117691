#pragma once

#include <cstdint>
#include <string>

#include "isohf/job.h"
#include "isohf/metadata.h"
#include "isohf/raster.h"

namespace isohf {

/// The diagonal that cuts every square of an ortho mesh into its two triangles.
enum class Diagonal {
  kFalling,  ///< from North-West to South-East
  kRising,   ///< from South-West to North-East
};

/// How far an ortho mesh lies from the source; see measure_ortho_twin.
struct OrthoErrors {
  double spacing = 0.0;           ///< world units between neighbouring vertices of a row or column
  std::int64_t vertices = 0;      ///< world area over the area of a square; triangles are twice as many
  std::int64_t compared = 0;      ///< source samples with an elevation on both sides, mean over the phases
  Diagonal diagonal{};            ///< the one with the lower rms; the figures below are its
  double rms = 0.0;               ///< quadratic mean over the phases, vertical units
  double rms_of_other = 0.0;      ///< with the other diagonal
  double max = 0.0;               ///< mean over the phases
  double p99 = 0.0;               ///< of all errors of all phases, to 1.1 %, rounded up
  double psnr_db = 0.0;           ///< against the same range as AccuracyReport::psnr_db
  std::int64_t clamped = 0;       ///< elevations of the first phase beyond the archive's codes, moved to their ends
  std::uint64_t plain_bytes = 0;  ///< of the first phase's samples, in tiles of 256x256 (plain_coding.h); if asked for
};

/// Where the twin's first vertex lies, North-West of the world's corner, in spacings. An ortho mesh may fall onto the
/// source's own samples, or just between them, and its error depends on it where the spacings are near to each other.
/// The iso lattice, whose steps are no simple fractions of the source's, meets them at all places. So the twin is laid
/// at four places that share out both axes evenly, and none of them decides.
struct OrthoPhase {
  double x;
  double z;
};
inline constexpr OrthoPhase kOrthoPhases[] = {{0.125, 0.375}, {0.375, 0.875}, {0.625, 0.125}, {0.875, 0.625}};

/// The spacing at which a square grid has as many vertices and triangles for an area as the tiles of this grid, each
/// shared vertex counted once.
[[nodiscard]] double ortho_spacing(const TileGrid& grid);

/// Lays a square grid over the surface's ground, resamples the source at its vertices by the surface's own filter,
/// acquisition, rule for its outside and quantisation, and compares its triangles with the source at every source
/// sample as compare_with_source does. Streams: the source is read once from North to South, twice where the filter has
/// a prefilter; memory is bounded by a few bands of rows. The same result for any number of threads.
/// spacing  world units, > 0    in_full  also p99 and plain_bytes   stage  that the job hears of, in source rows
/// Works on the caller's oneTBB arena. Throws Error as the source does, Error{kInvalidArgument, kIo} where a FIR file
/// of the acquisition is gone, Error{kCancelled}.
[[nodiscard]] OrthoErrors measure_ortho_twin(const Metadata& surface, HeightSource& source, double spacing,
                                             bool in_full, const std::string& stage, const Job& job);

}  // namespace isohf
