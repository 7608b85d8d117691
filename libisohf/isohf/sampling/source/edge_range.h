#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isohf/raster.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// Bounds the elevations that a surface continued beyond its source's edge can take from the samples
/// along that edge. Fed with all of the source; keeps `depth_rows` + 2 rows at either end.
///
/// A continued elevation is 2 F(edge) - F(inside), with both values between samples of at most `depth` from the edge;
/// the bound takes the largest of the two edge samples beside it and the smallest of those inside, and the other way
/// round.
class EdgeRange {
 public:
  EdgeRange(const SourceInfo& info, std::int64_t depth_columns, std::int64_t depth_rows);

  /// raw [window.rows * window.columns samples]. Windows come as ReadStep's do: from North to South, and those of the
  /// same rows from West to East.
  void add_window(const Window& window, std::span<const std::byte> raw);

  /// After all windows: what every continued elevation lies in; empty, min above max, where nothing is known.
  [[nodiscard]] ElevationRange bound() const;
  /// `range` widened to hold such a bound, but by no more than an eighth at either end; steeper edges are held at the end
  /// of the codes (TileResampler's limits).
  [[nodiscard]] static ElevationRange widen(const ElevationRange& range, const ElevationRange& bound);

 private:
  /// Smallest and largest height at the edge and within the depth from it, at one place along it.
  struct Profile {
    ElevationRange edge;
    ElevationRange inside;
  };
  /// The columns that count at the West or the East edge, over as many windows as they take.
  struct Side {
    std::int64_t first;                            ///< column
    std::int64_t end;                              ///< behind the last
    std::int64_t edge;                             ///< the outermost
    std::vector<Profile> rows = {};                ///< of the windows' rows, from the columns that came so far
    std::optional<Profile> before = std::nullopt;  ///< of the row before these
  };
  static Profile profile_of(std::span<const float> from_edge);
  static void add_between(const Profile& a, const Profile& b, ElevationRange& bound);
  void add_side(const Window& window, std::span<const std::byte> raw, Side& side);
  void add_edge_rows(const std::vector<float>& rows, ElevationRange& bound) const;

  const SourceInfo& info_;
  std::size_t depth_columns_;
  std::size_t depth_rows_;
  std::vector<float> north_;    ///< [depth_rows][width], from the edge
  std::vector<float> south_;    ///< the same, from the South edge
  std::vector<float> heights_;  ///< scratch
  std::array<Side, 2> sides_;   ///< West and East
  ElevationRange bound_;
};

}  // namespace isohf
