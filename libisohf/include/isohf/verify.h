// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/job.h"
#include "isohf/raster.h"

namespace isohf {

enum class Severity { kNote, kWarning, kError };

/// One thing that verifying found: a stable id ("ISOHF-0012"), its severity, where, and a sentence.
struct Finding {
  int id;
  Severity severity;
  std::optional<TileIndex> tile;
  std::string text;
};

/// "ISOHF-0012".
[[nodiscard]] std::string finding_name(int id);
/// The catalogue: what each id means, one sentence; for documentation and --json. Ids are never reused.
struct FindingKind {
  int id;
  Severity severity;
  const char* meaning;
};
[[nodiscard]] const std::vector<FindingKind>& finding_catalogue();

struct VerifyReport {
  std::vector<Finding> findings;
  std::int64_t findings_total = 0;
  std::int64_t tiles_checked = 0;  ///< of a part, its own
  std::int64_t shared_vertices_checked = 0;
  [[nodiscard]] bool passed() const;  ///< no finding above kNote
};

/// Checks a whole archive: ZIP structure, index against directory, every CRC, every tile's decoding, code range, void
/// counts and statistics against the metadata, content hash, shared vertices and padding equal between neighbours (the
/// eight around each tile), normals equal across every edge and corner. Parallel. Memory: two rows of tiles, and 32
/// bytes a member.
/// Stage "verify". Of the findings `max_findings` are kept, the others only counted.
/// Throws only what prevents checking at all (Error{kIo}, kCancelled).
[[nodiscard]] VerifyReport verify_archive(const std::string& path, const Job& job = {},
                                          std::size_t max_findings = 1000);

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
  std::int64_t samples_off_map = 0;   ///< at places that the archive's map does not show
  std::int64_t samples_lost = 0;      ///< elevations in the source where the archive has none
  std::int64_t lost_inside = 0;       ///< of these, with no void and no edge of the source within reach of a triangle
  std::int64_t samples_invented = 0;  ///< elevations in the archive at void source samples
  std::int64_t invented_inside = 0;   ///< of these, with nothing but voids within reach of a triangle
  double rms = 0.0;                   ///< vertical units
  double max = 0.0;
  double p99 = 0.0;              ///< 99th percentile of the absolute error, to 1.1 %, rounded up
  double psnr_db = 0.0;          ///< 20 log10(elevation range / rms); infinite where rms is 0
  WorldPoint worst{};            ///< where the largest error lies
  std::vector<ErrorPeak> peaks;  ///< the largest of all rows, 256 at most
};

/// Compares at every source sample. Streams both sides: memory is bounded by two rows of tiles and a band of source
/// rows. Stage "compare". Throws Error{kInvalidArgument} where the source's size or georeference does not match the
/// archive's record of it.
[[nodiscard]] AccuracyReport compare_with_source(const ArchiveReader& archive, HeightSource& source,
                                                 const Job& job = {});

/// What contradicts the error that the archive's metadata state; empty where they state none, or just that.
[[nodiscard]] std::string contradiction(const Metadata& metadata, const AccuracyReport& found);

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

/// Streams both sides; memory as for converting. Stage "resample". Throws Error{kUnsupported} where the metadata name a
/// filter that this build does not have; otherwise what reading throws.
[[nodiscard]] VertexReport check_vertices(const ArchiveReader& archive, HeightSource& source, const Job& job = {});

/// Ids of the catalogue in findings.cpp; numbers are for ever.
namespace finding {
inline constexpr int kNotReadable = 1;
inline constexpr int kReadByDirectory = 2;
inline constexpr int kTileUndecodable = 3;
inline constexpr int kTileCodeRange = 4;
inline constexpr int kTileVoidFlag = 5;
inline constexpr int kTileEmpty = 6;
inline constexpr int kSharedVertex = 7;
inline constexpr int kPadding = 8;
inline constexpr int kNormal = 9;
inline constexpr int kStatistics = 10;
inline constexpr int kContentHash = 11;
inline constexpr int kTileCount = 12;
inline constexpr int kElevationRange = 13;
inline constexpr int kMemberUnreadable = 14;
inline constexpr int kStructure = 15;
inline constexpr int kSourceLost = 16;
inline constexpr int kSourceInvented = 17;
inline constexpr int kLossless = 18;
inline constexpr int kTexture = 21;
inline constexpr int kVertex = 22;
inline constexpr int kShadowSeeds = 23;
inline constexpr int kMetadata = 24;
inline constexpr int kAccuracy = 25;
// What drawing shows: isohf view --verify.
inline constexpr int kDrawnVertex = 26;
inline constexpr int kDrawnCoverage = 27;
inline constexpr int kDrawnHeight = 29;
inline constexpr int kDrawnCrack = 32;
inline constexpr int kDrawnMesh = 33;
inline constexpr int kDrawnShadow = 34;
// Coarse planes.
inline constexpr int kPlane = 36;
inline constexpr int kPlaneRange = 37;
}  // namespace finding

/// Severity of a catalogue id.
[[nodiscard]] Severity severity_of(int id);

}  // namespace isohf
