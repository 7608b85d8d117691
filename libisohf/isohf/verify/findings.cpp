#include "isohf/verify.h"

#include <fmt/format.h>

#include "isohf/error.h"

namespace isohf {

const std::vector<FindingKind>& finding_catalogue() {
  static const std::vector<FindingKind> kinds = {
      {finding::kNotReadable, Severity::kError, "the file is no archive that this build can read"},
      {finding::kReadByDirectory, Severity::kWarning,
       "the index disagrees with the ZIP directory (the file was zipped again); tiles are read by the directory"},
      {finding::kTileUndecodable, Severity::kError, "a tile cannot be inflated or decoded"},
      {finding::kTileCodeRange, Severity::kError, "a tile's smallest or largest code differs from the index"},
      {finding::kTileVoidFlag, Severity::kError, "a tile's void flag differs from its contents"},
      {finding::kTileEmpty, Severity::kError, "a stored tile holds no elevation, or an absent one is not marked so"},
      {finding::kSharedVertex, Severity::kError, "two tiles hold different elevations for a vertex that they share"},
      {finding::kPadding, Severity::kError, "a tile's padding differs from its neighbour's vertices"},
      {finding::kNormal, Severity::kError, "two tiles compute different normals for a vertex that they share"},
      {finding::kStatistics, Severity::kError, "the metadata's statistics differ from the elevations"},
      {finding::kContentHash, Severity::kError, "the content hash differs from the elevations"},
      {finding::kTileCount, Severity::kError, "the number of stored tiles differs from the metadata"},
      {finding::kElevationRange, Severity::kError,
       "a code lies beyond the last one, or an elevation beyond the range that the metadata allow"},
      {finding::kMemberUnreadable, Severity::kError, "a member beside the tiles cannot be read, or its CRC is wrong"},
      {finding::kStructure, Severity::kError, "the ZIP structure breaks the profile of docs/archive_format.md"},
      {finding::kSourceLost, Severity::kError,
       "the source has an elevation well inside valid ground where the archive has none"},
      {finding::kSourceInvented, Severity::kError, "the archive has an elevation deep inside a void of the source"},
      {finding::kLossless, Severity::kError,
       "the residuals do not give the source's samples: one cannot be decoded, or their SHA-256 differs"},
      {finding::kTexture, Severity::kError,
       "a texture is missing, cannot be decoded, or has another size than the metadata says"},
      {finding::kVertex, Severity::kError,
       "a stored vertex is further from the source, resampled as the metadata say, than half a step"},
      {finding::kShadowSeeds, Severity::kError,
       "shadow seeds are missing, cannot be read, or are not those of the archive's tiles"},
      {finding::kMetadata, Severity::kError,
       "a member of the metadata contradicts another one, or names nothing known"},
      {finding::kAccuracy, Severity::kError,
       "the error that the metadata state cannot be, or is not what comparing with the source gives"},
      {finding::kDrawnVertex, Severity::kError,
       "a vertex is drawn in another place, or with another elevation or normal, than the library computes"},
      {finding::kDrawnCoverage, Severity::kError,
       "a point of a tile is not drawn, or drawn more than once, or something outside the tile is drawn"},
      {finding::kDrawnHeight, Severity::kError, "inside a triangle the drawn elevation is not the interpolated one"},
      {finding::kDrawnCrack, Severity::kError, "neighbouring tiles draw a shared vertex in two places"},
      {finding::kDrawnMesh, Severity::kError,
       "triangles of the index arrays do not join side to side, or do not meet the full-detail border"},
      {finding::kDrawnShadow, Severity::kError,
       "a vertex's drawn shadow is not that of light swept over its row of tiles, or too many are not those of rays"},
      {finding::kPlane, Severity::kError,
       "a coarse plane's tile is missing, or does not hold the elevations of the tiles below it"},
      {finding::kPlaneRange, Severity::kError,
       "the range that the index states for a coarse plane's tile is not that of the tiles below it"},
  };
  return kinds;
}

Severity severity_of(int id) {
  for (const FindingKind& kind : finding_catalogue()) {
    if (kind.id == id) return kind.severity;
  }
  throw Error(ErrorCode::kInvalidArgument, "there is no finding " + finding_name(id));
}

std::string finding_name(int id) {
  return fmt::format("ISOHF-{:04}", id);
}

bool VerifyReport::passed() const {
  for (const Finding& found : findings) {
    if (found.severity != Severity::kNote) return false;
  }
  return findings_total <= static_cast<std::int64_t>(findings.size());
}

}  // namespace isohf
