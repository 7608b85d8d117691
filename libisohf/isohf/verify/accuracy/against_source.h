#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/lattice.h"
#include "isohf/raster.h"

namespace isohf {

/// The largest error of a row of the source.
struct ErrorPeak {
  double error = 0.0;
  std::int64_t column = 0;  ///< of the sample
  std::int64_t row = 0;
};

/// How far an archive's surface (barycentric, as the renderer draws it) lies from the source it was made from.
struct AccuracyReport {
  std::int64_t samples = 0;           ///< source samples
  std::int64_t samples_void = 0;      ///< of these, void in the source
  std::int64_t samples_compared = 0;  ///< elevations on both sides
  std::int64_t samples_lost = 0;      ///< elevations in the source where the archive has none
  std::int64_t lost_inside = 0;       ///< of these, with no void and no edge of the source within reach of a triangle
  std::int64_t samples_invented = 0;  ///< elevations in the archive at void source samples
  std::int64_t invented_inside = 0;   ///< of these, with nothing but voids within reach of a triangle
  double rms = 0.0;                   ///< vertical units
  double max = 0.0;
  double p99 = 0.0;                ///< 99th percentile of the absolute error, to 1.1 %, rounded up
  double psnr_db = 0.0;            ///< 20 log10(elevation range / rms); infinite where rms is 0
  WorldPoint worst{};              ///< where the largest error lies
  std::int64_t random_points = 0;  ///< random places compared with bilinear interpolation of the source
  double random_rms = 0.0;
  double random_max = 0.0;
  std::vector<ErrorPeak> peaks;  ///< the largest of all rows, 256 at most
};

/// Compares at every source sample and at `random_points` random places (fixed seed). Streams both sides: memory is
/// bounded by two rows of tiles and a band of source rows. Throws Error{kInvalidArgument} where the source's size or
/// place does not match the archive's record of it.
[[nodiscard]] AccuracyReport compare_with_source(const ArchiveReader& archive, HeightSource& source,
                                                 std::int64_t random_points, int threads,
                                                 const std::function<void(std::int64_t, std::int64_t)>& progress,
                                                 const std::atomic<bool>& cancel);

/// What contradicts the error that the archive's metadata state; empty where they state none, or just that.
[[nodiscard]] std::string contradiction(const Metadata& metadata, const AccuracyReport& found);

}  // namespace isohf
