#pragma once

#include <cstdint>
#include <optional>

#include "isohf/archive.h"
#include "isohf/raster.h"

/// What the iso lattice buys on a raster: its archive beside meshes of squares over the same ground.

namespace isohf::experiment {

/// How far meshes of squares lie from the source's samples: root mean squares, vertical units.
struct SquareErrors {
  double one_diagonal = 0.0;     ///< all cut along one diagonal, the better of the two
  double least_curvature = 0.0;  ///< each cut along the diagonal on which its vertices bend less
  double best = 0.0;             ///< each cut as suits the source's samples in it: no rule can do better
};

struct RasterComparison {
  std::int64_t triangles = 0;  ///< of the archive, at full detail
  SquareErrors squares;        ///< of as many triangles
  double regular_rms = 0.0;    ///< of the iso lattice as dense, placed as the squares are
  /// How many times the archive's triangles squares of one diagonal need to err as little as it: meshes of other
  /// spacings are measured until one lies beyond its error, then log spacing is interpolated over log rms. nullopt
  /// where that is not met with a quarter to four times as many.
  std::optional<double> triangles_of_equal_rms;
};

/// Resamples the source at the vertices of meshes by the archive's own filter, acquisition, rule for its outside and
/// quantisation, and compares their triangles with the source at every sample, as compare_with_source() does for the
/// archive, which found `iso_rms`. A mesh may fall onto the source's own samples, or just between them: each is laid at
/// four places that share out both axes evenly. Keeps the raster whole in memory. The same result for any number of
/// threads. Not for sources that were projected.
[[nodiscard]] RasterComparison compare_with_squares(const ArchiveReader& archive, HeightSource& source, double iso_rms);

}  // namespace isohf::experiment
