#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "isohf/surface/source_scan.h"

namespace isohf {

/// Bounds the elevations that a surface continued beyond its source's edge can take (Outside::kCover), from the samples
/// along that edge. Fed with all rows from North to South; keeps `depth_rows` + 1 rows and a few columns.
///
/// A continued elevation is 2 F(edge) - F(inside), with both values between samples of at most `depth` from the edge;
/// the bound takes the largest of the two edge samples beside it and the smallest of those inside, and the other way
/// round.
class EdgeRange {
 public:
  EdgeRange(const SourceInfo& info, std::int64_t depth_columns, std::int64_t depth_rows);

  /// raw [rows * width samples], following the rows added before.
  void add_rows(std::span<const std::byte> raw);

  /// After all rows: `range` widened to hold every continued elevation, but by no more than an eighth at either end;
  /// steeper edges are held at the end of the codes (TileCutter's limits).
  [[nodiscard]] ElevationRange widen(const ElevationRange& range) const;

 private:
  /// Smallest and largest height at the edge and within the depth from it, at one place along it.
  struct Profile {
    ElevationRange edge;
    ElevationRange inside;
  };
  static Profile profile_of(std::span<const float> from_edge);
  static void add_between(const Profile& a, const Profile& b, ElevationRange& bound);
  void add_row_profiles(std::span<const float> row);
  void add_edge_rows(bool from_end, ElevationRange& bound) const;

  const SourceInfo& info_;
  std::size_t depth_columns_;
  std::size_t depth_rows_;
  std::int64_t rows_ = 0;
  std::deque<std::vector<float>> first_rows_;
  std::deque<std::vector<float>> last_rows_;
  std::vector<Profile> last_profiles_;  ///< West and East, of the row before
  ElevationRange bound_;
};

}  // namespace isohf
