#pragma once

#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// The metadata member that says what statistics count, an extension: its one value is JSON text.
inline constexpr const char* kStatisticsOfName = "statistics_of";
inline constexpr const char* kStatisticsOfSource = "\"source ground\"";

/// Throws Error{kCorrupt} for another value of the member.
void check_statistics_of(const Metadata& metadata);

/// Which of a tile's vertices statistics count: those on the source's ground, Metadata::valid, where a vertex that
/// tiles share counts in the North-West one of them.
class CountedVertices {
 public:
  /// metadata  grid, valid and wraps_x are used
  explicit CountedVertices(const Metadata& metadata);

  /// Columns of a tile's row; none where last < first.
  struct Columns {
    int first;
    int last;
  };
  [[nodiscard]] Columns of_row(TileIndex tile, int row) const;
  /// All of a tile.
  [[nodiscard]] std::int64_t of_tile(TileIndex tile) const;
  [[nodiscard]] const TileShape& shape() const { return grid_.shape(); }

 private:
  TileGrid grid_;
  bool wraps_x_;
  std::int64_t last_x_;  ///< on the lattice, of the source's ground
  std::int64_t last_z_;
};

/// Counts, sum and range of one tile's vertices that count; clamped and worst_rounding are left 0.
[[nodiscard]] TileStatistics tile_statistics(const CountedVertices& counted, TileIndex index, const TileCodes& tile,
                                             const Quantisation& quantisation);

/// The same of a tile without elevations.
[[nodiscard]] TileStatistics void_statistics(const CountedVertices& counted, TileIndex index);

/// All tiles' statistics as the metadata has them.
[[nodiscard]] Statistics total_statistics(const TileStatistics& all);

}  // namespace isohf
