#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "isohf/archive/codec/tile_codes.h"
#include "isohf/metadata.h"
#include "isohf/surface/resample/row_sampler.h"
#include "isohf/verify/accuracy/ortho_twin.h"

namespace isohf {

/// What all grids over one surface share.
struct OrthoGround {
  const Metadata& surface;
  SourceAxis axis_x;
  SourceAxis axis_z;
  Kernel kernel;
  RowSampler sampler;
  double datum;

  static OrthoGround make(const Metadata& surface, const Kernel& kernel, double datum, double spacing);
};

/// The rows of one square grid, made from North to South and kept while they are needed; elevations as an archive of
/// them would give them back.
///
///   open(z, z')     add_rows_needed     fill(0) ... fill(opened - 1), in any order, on any thread     close()
class OrthoRows {
 public:
  OrthoRows(const OrthoGround& ground, double spacing, OrthoPhase phase, bool is_coded);

  /// Drops the rows North of world_z, and makes room for those down to the first at or South of world_end; down to the
  /// end of the ground where that is infinite.
  void open(double world_z, double world_end);
  [[nodiscard]] std::int64_t opened() const { return end_row_ - filled_row_; }
  void add_rows_needed(RowRange& range) const;
  void fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch);
  /// Codes what has become whole tiles. The calling thread's task arena works on them.
  void close();

  /// A place between four vertices, along one axis.
  struct Place {
    std::int64_t index;  ///< of the vertex at or before it
    double share;        ///< of the way to the next one
  };
  [[nodiscard]] Place column_at(double world_x) const { return place(world_x, first_x_, columns_); }
  [[nodiscard]] Place row_at(double world_z) const { return place(world_z, first_z_, rows_); }
  /// A row that is kept. [columns], NaN where void.
  [[nodiscard]] const double* row(std::int64_t row) const {
    return kept_[static_cast<std::size_t>(row - first_row_)].data();
  }

  [[nodiscard]] std::int64_t clamped() const { return clamped_total_; }
  [[nodiscard]] std::uint64_t plain_bytes() const { return plain_bytes_; }

 private:
  [[nodiscard]] Place place(double world, double first, std::int64_t count) const;
  void code_tiles(std::int64_t rows);

  const OrthoGround& ground_;
  double spacing_;
  double first_x_;
  double first_z_;
  std::int64_t columns_;
  std::int64_t rows_;
  ColumnTaps taps_;
  bool is_coded_;
  std::int64_t first_row_ = 0;   ///< of those that are kept
  std::int64_t filled_row_ = 0;  ///< one past the last that is filled
  std::int64_t end_row_ = 0;     ///< one past the last that is open
  std::deque<std::vector<double>> kept_;
  std::vector<std::int64_t> clamped_;  ///< of the open rows
  std::int64_t clamped_total_ = 0;
  std::deque<TileCodes> codes_;  ///< rows that are not coded yet
  std::int64_t coded_rows_ = 0;
  std::uint64_t plain_bytes_ = 0;
};

}  // namespace isohf
