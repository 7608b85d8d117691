#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/void_rule.h"
#include "isohf/sampling/source/source_axis.h"
#include "isohf/sampling/source/source_band.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// Where the vertices of a row read the source's columns: their taps, and those of the source's two edges after them,
/// which continued vertices read as well. The line they read holds `width` coefficients, from unmirrored source column
/// `first` on.
struct ColumnTaps {
  std::size_t count = 0;               ///< vertices + 2: the West edge and the East edge come last
  std::vector<std::int32_t> start;     ///< [count] first tap's place in the line
  std::vector<float> weights;          ///< [taps][count]
  std::vector<double> position;        ///< [count] in source columns
  std::vector<std::size_t> continued;  ///< vertices beyond the source's edge whose slope goes on
  std::vector<std::size_t> edge;       ///< for each of these, the edge's place: count - 2 or count - 1
  std::int64_t first = 0;
  std::int64_t width = 0;
};

/// world_x [vertices]  world places, any order. At least one.
[[nodiscard]] ColumnTaps make_column_taps(const SourceAxis& axis, const Kernel& kernel,
                                          std::span<const double> world_x);

/// Widens `range` by the source columns that the taps read, and `reach` more to either side.
void add_columns_needed(const SourceAxis& axis, const ColumnTaps& taps, std::int64_t reach, RowRange& range);

/// Resamples the source along rows of vertices. An elevation is a pure function of its place. Thread-safe.
class RowSampler {
 public:
  /// `limits`, relative to the bands' datum, hold the continuation beyond the source's edge only.
  RowSampler(const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel, const ElevationRange& limits,
             const LatticeAround& around = {});

  /// Widens `range` by the source rows that a row of vertices reads.
  void add_rows_needed(double world_z, RowRange& range) const;

  /// Memory that one thread uses again from row to row.
  struct Scratch {
    std::vector<float> line;
    std::vector<float> least;
    std::vector<float> most;
    std::vector<char> void_line;
    std::vector<char> near_void;
    std::vector<float> values;
    std::vector<float> edge_values;
  };
  /// The row of vertices at world_z. `band` holds at least what add_rows_needed and add_columns_needed ask for.
  /// heights [columns.count - 2] out, relative to the band's datum; NaN where void, by the rules of kernels.h.
  void sample(const SourceBand& band, double world_z, const ColumnTaps& columns, Scratch& scratch,
              std::span<float> heights) const;

 private:
  void sample_at(const SourceBand& band, double v, const ColumnTaps& columns, Scratch& scratch,
                 std::vector<float>& values) const;
  void resample_near_voids(const SourceBand& band, double v, const ColumnTaps& columns, const TapWeights& rows,
                           Scratch& scratch, std::vector<float>& values) const;

  SourceAxis axis_x_;
  SourceAxis axis_z_;
  Kernel kernel_;
  LatticeAround around_;
  float lowest_;
  float highest_;
};

}  // namespace isohf
