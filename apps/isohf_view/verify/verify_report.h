#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "isohf/lattice.h"

namespace isohf::view {

/// What a check looks at. The numbers are stable.
enum class Check {
  kReadable = 1,    ///< the tile can be decoded
  kShared = 2,      ///< vertices that tiles share, padding included, hold one code and get one normal
  kVertex = 3,      ///< place, height and normal of each vertex as the vertex shader has them
  kCoverage = 4,    ///< every point of the tile is drawn exactly once, nothing outside
  kWinding = 5,     ///< every triangle faces up
  kHeight = 6,      ///< heights inside triangles against the library's barycentric ones
  kNormal = 7,      ///< normals inside triangles, likewise
  kTransition = 8,  ///< heights while one level fades into the next
  kCrack = 9,       ///< no background shows between tiles, at any pair of levels
  kMesh = 10,       ///< triangles join side to side, and meet the full-detail border
  kShadow = 11,     ///< shadow height of each vertex as the shader has it, against shadows carried along the row
  kSunShare = 12,   ///< the share of the sun inside triangles (Eq. 16)
};
[[nodiscard]] std::string to_string(Check check);

/// The worst place of one check in one tile at one level.
struct Finding {
  Check check;
  TileIndex tile;
  double level = 0.0;      ///< fractional in transitions
  std::string where;       ///< place, what was found, what was required
  double deviation = 0.0;  ///< codes, normal components, shares of the sun, or pixels not drawn once
  std::int64_t count = 1;  ///< places at fault
};

struct VerifyOptions {
  std::vector<double> fractions{0.25, 0.5, 0.8};  ///< β of the transitions looked at between each two levels
  bool seams = true;
  bool shadows = true;  ///< where the source has seeds
  /// Called now and then with tiles done and all tiles.
  std::function<void(std::int64_t, std::int64_t)> progress;
};

struct VerifyReport {
  std::int64_t tiles = 0;
  std::int64_t pictures = 0;  ///< draws read back and compared
  std::int64_t pixels = 0;    ///< compared with the library
  std::int64_t vertices = 0;
  std::int64_t shared_vertices = 0;  ///< compared between tiles
  std::int64_t seam_pixels = 0;      ///< of oblique and perspective pictures
  std::int64_t shadow_vertices = 0;
  std::vector<double> suns_deg;  ///< that shadows were looked at for, from either side
  double worst_shadow = 0.0;     ///< codes
  double worst_share = 0.0;      ///< of the sun
  double worst_height = 0.0;     ///< codes, within tolerance or not
  double worst_normal = 0.0;
  std::int64_t failures = 0;      ///< findings in all
  std::vector<Finding> findings;  ///< at most kMaxFindings, the first ones

  static constexpr std::size_t kMaxFindings = 50;
  [[nodiscard]] bool passed() const { return failures == 0; }
  void add(Finding finding) {
    ++failures;
    if (findings.size() < kMaxFindings) findings.push_back(std::move(finding));
  }
};

}  // namespace isohf::view
