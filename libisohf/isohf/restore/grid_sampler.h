#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "isohf/restore/rows/spline_rows.h"
#include "isohf/restore/rows/vertex_rows.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/sampling/source/source_band.h"

namespace isohf {

/// Throws Error{kInvalidArgument} for a grid without samples or spacing.
void require_samples(const SampleGrid& grid);
/// Throws also where it lies far from the surface, where positions are no longer counted in lattice steps.
const SampleGrid& require_samples_near(const SampleGrid& samples, const TileGrid& grid);

/// The surface of an archive at the samples of a grid, row by row from North to South.
///
/// Keeps the tile rows and lattice rows that the next rows may need: memory grows with the width, not the height.
/// Works on the caller's oneTBB arena. The bits depend on tiles and grid alone, not on threads or on how the rows are
/// cut into calls.
class GridSampler {
 public:
  /// wraps_x  the grid's East edge is its West edge
  /// ground   where the source ends, to a hundredth of a sample, as georeferences are rounded; nullopt: with the grid
  /// scratch  keeps tile rows and lattice rows where memory has no room for them
  /// turn     columns that miss the ground are looked for some turns away
  GridSampler(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTile read_tile,
              const SampleGrid& samples, RestoreMethod method, const std::optional<WorldBounds>& ground = {},
              const ScratchFolder& scratch = {}, const std::optional<Turn>& turn = {});

  /// What a sampler holds that reads so many rows at once, beside the elevations; an estimate.
  [[nodiscard]] static double memory_bytes(const TileGrid& grid, const SampleGrid& samples, RestoreMethod method,
                                           std::int64_t rows, int threads, bool in_scratch);

  /// Rows `first` to `first + rows - 1`; calls come in increasing order.
  /// elevations [rows * width] out, vertical units; NaN where the surface has a void or ends.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

 private:
  struct Column {
    bool inside;
    std::int64_t tile;
    double x;  ///< object space
  };

  struct Block;
  struct Tiles {
    std::int64_t first;
    std::int64_t count;
  };

  /// Under some columns, those between them besides.
  [[nodiscard]] Tiles tiles_under(std::int64_t first, std::int64_t columns) const;
  void keep_lattice_rows(std::int64_t first, std::int64_t last);
  [[nodiscard]] RowRange lattice_rows_of(std::int64_t row) const;
  void read_on_triangles(const TilePoint& at, const Block& block, std::span<double> out) const;
  void read_row(std::int64_t row, Block& block, std::span<double> out) const;
  void blend_lattice_rows(const QuinticResponse& response, bool beside_voids, Block& block,
                          std::span<double> out) const;
  [[nodiscard]] double world_z(std::int64_t row) const {
    return samples_.first_z + static_cast<double>(row) * samples_.spacing_z;
  }

  TileGrid grid_;
  Quantisation quantisation_;
  SampleGrid samples_;
  RestoreMethod method_;
  double end_z_;      ///< of the source, world units
  double tolerance_;  ///< beyond it, samples
  SplineRows spline_;
  std::vector<Column> columns_;
  std::optional<VertexRows> tiles_;  ///< kHex: all of a row, else those under samples
  bool in_scratch_;
  KeptRows<double> heights_;           ///< of lattice rows
  KeptRows<char> near_void_;           ///< written where any is
  std::deque<char> is_any_near_void_;  ///< of the lattice rows that are kept
  std::int64_t first_lattice_row_ = 0;
};

}  // namespace isohf
