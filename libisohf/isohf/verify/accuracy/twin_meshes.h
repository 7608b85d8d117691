#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/job.h"
#include "isohf/metadata.h"
#include "isohf/raster.h"

namespace isohf {

/// The diagonal that cuts every square of an ortho mesh into its two triangles.
enum class Diagonal {
  kFalling,  ///< from North-West to South-East
  kRising,   ///< from South-West to North-East
};

/// A regular mesh over a surface's ground; lengths are world units.
struct MeshLayout {
  enum class Kind {
    kOrtho,      ///< rectangles
    kIso,        ///< every second row slid by half a spacing, without the straight edges that tiles have
    kDecimated,  ///< ortho, its vertices at every k-th sample of the source: spacings are k times the source's
  };
  Kind kind = Kind::kOrtho;
  double spacing_x = 0.0;  ///< between neighbouring vertices of a row
  double spacing_z = 0.0;  ///< between rows
  bool in_full = false;    ///< also p99 and plain_bytes

  [[nodiscard]] static MeshLayout squares(double spacing, bool in_full = false);
  /// The equilateral lattice with one vertex for each `area` of ground.
  [[nodiscard]] static MeshLayout equilateral(double area);
  [[nodiscard]] static MeshLayout every(std::int64_t stride, const SourceRecord& source);
};

/// How far a mesh lies from the source; see measure_meshes.
struct MeshErrors {
  MeshLayout layout;
  std::int64_t vertices = 0;  ///< world area over that of a vertex; triangles are twice as many
  std::int64_t compared = 0;  ///< source samples with an elevation on both sides, mean over the placements
  double rms = 0.0;           ///< quadratic mean over the placements, vertical units
  double max = 0.0;           ///< mean over the placements
  std::int64_t clamped = 0;   ///< elevations of the first placement beyond the archive's codes, moved to their ends
  // Of ortho meshes: rms and what stands below are of the one diagonal for all squares that has the lower rms.
  Diagonal diagonal{};
  double rms_of_other = 0.0;         ///< with the other diagonal
  double rms_least_curvature = 0.0;  ///< each square cut along the diagonal on which its vertices bend less
  double rms_best = 0.0;             ///< each cut as suits the source's samples in it: no rule can do better
  double p99 = 0.0;                  ///< of all errors of all placements, to 1.1 %, rounded up
  double psnr_db = 0.0;              ///< against the same range as AccuracyReport::psnr_db
  std::uint64_t plain_bytes = 0;     ///< of the first placement's samples, in tiles of 256x256 (plain_coding.h)
};

/// Where a mesh's first vertex lies, North-West of the world's corner, in spacings. A mesh may fall onto the source's
/// own samples, or just between them, and its error depends on it where the spacings are near to each other. So each
/// is laid at four places that share out both axes evenly, and none of them decides. Decimated meshes begin at the
/// sample before that place.
struct MeshPlacement {
  double x;
  double z;
};
inline constexpr MeshPlacement kMeshPlacements[] = {{0.125, 0.375}, {0.375, 0.875}, {0.625, 0.125}, {0.875, 0.625}};

/// The ground of a vertex, world units squared, where a mesh has as many vertices and triangles for an area as the
/// tiles of this grid, each shared vertex counted once.
[[nodiscard]] double vertex_area(const TileGrid& grid);

/// Lays meshes over the surface's ground, resamples the source at their vertices by the surface's own filter,
/// acquisition, rule for its outside and quantisation, and compares their triangles with the source at every source
/// sample as compare_with_source does. Streams: the source is read once from North to South for all of them, twice where
/// the filter has a prefilter; memory is bounded by a few bands of rows. The same result for any number of threads.
/// layouts  one or more, [i] of the result is of layouts[i]    stage  that the job hears of, in source rows
/// Works on the caller's oneTBB arena. Throws Error as the source does, Error{kInvalidArgument, kIo} where a FIR file
/// of the acquisition is gone, Error{kCancelled}.
[[nodiscard]] std::vector<MeshErrors> measure_meshes(const Metadata& surface, HeightSource& source,
                                                     std::span<const MeshLayout> layouts, const std::string& stage,
                                                     const Job& job);

}  // namespace isohf
