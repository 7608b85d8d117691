// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isohf/archive.h"

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

struct VerifyOptions {
  int threads = 0;                                                      ///< 0: all cores
  std::size_t max_findings = 1000;                                      ///< further ones are counted, not kept
  std::function<bool(std::int64_t done, std::int64_t total)> progress;  ///< false cancels
};

struct VerifyReport {
  std::vector<Finding> findings;
  std::int64_t findings_total = 0;
  std::int64_t tiles_checked = 0;
  std::int64_t shared_vertices_checked = 0;
  [[nodiscard]] bool passed() const;  ///< no finding above kNote
};

/// Checks a whole archive: ZIP structure, index against directory, every CRC, every tile's decoding, code range, void
/// counts and statistics against the metadata, content hash, shared vertices and padding equal between neighbours (the
/// eight around each tile), normals equal across every edge and corner. Parallel, memory bounded by two rows of tiles.
/// Throws only what prevents checking at all (Error{kIo}, kCancelled).
[[nodiscard]] VerifyReport verify_archive(const std::string& path, const VerifyOptions& options);

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
inline constexpr int kTileNotDeflate = 20;
inline constexpr int kTexture = 21;
inline constexpr int kVertex = 22;
inline constexpr int kShadowSeeds = 23;
inline constexpr int kMetadata = 24;
inline constexpr int kAccuracy = 25;
// What drawing shows: isohf view --verify.
inline constexpr int kDrawnVertex = 26;
inline constexpr int kDrawnCoverage = 27;
inline constexpr int kDrawnWinding = 28;
inline constexpr int kDrawnHeight = 29;
inline constexpr int kDrawnNormal = 30;
inline constexpr int kDrawnTransition = 31;
inline constexpr int kDrawnCrack = 32;
inline constexpr int kDrawnMesh = 33;
inline constexpr int kDrawnShadow = 34;
inline constexpr int kDrawnSunShare = 35;
}  // namespace finding

/// Severity of a catalogue id.
[[nodiscard]] Severity severity_of(int id);

}  // namespace isohf
