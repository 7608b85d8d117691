#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "isohf/archive/tile/predict/predictors.h"
#include "isohf/lattice.h"

/// The order that a tile's samples are coded in. Rows are worked on in lattice order: even rows keep column 0 in place
/// 1 and column C-1 in place C-2, where the lattice has them (errata E5), and their two slid vertices apart; these are
/// predicted from their row once it is known.

namespace isohf {

/// The samples of a tile in lattice order, with three places of margin West and East and three rows North. Wide: int32
/// for codes, int64 for floats.
template <typename Wide>
class Lattice {
 public:
  static constexpr int kMargin = 3;
  static constexpr int kRowsAbove = 3;

  explicit Lattice(const TileShape& shape)
      : columns_(shape.columns()),
        rows_(shape.rows()),
        stride_(columns_ + 2 * kMargin),
        samples_(std::make_unique_for_overwrite<Wide[]>(static_cast<std::size_t>(stride_) *
                                                        static_cast<std::size_t>(rows_ + kRowsAbove))),
        slid_(2 * static_cast<std::size_t>(rows_)) {}

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }

  /// Places of row r that hold lattice samples: first(r) <= place <= last(r).
  [[nodiscard]] static int first(int row) { return row % 2 == 0 ? 1 : 0; }
  [[nodiscard]] int last(int row) const { return row % 2 == 0 ? columns_ - 2 : columns_ - 1; }

  /// Place 0 of row r; rows -3 to -1 exist, as do places -3 to -1 and C to C+2.
  [[nodiscard]] Wide* row(int r) {
    return samples_.get() + static_cast<std::ptrdiff_t>(r + kRowsAbove) * stride_ + kMargin;
  }
  [[nodiscard]] const Wide* row(int r) const {
    return samples_.get() + static_cast<std::ptrdiff_t>(r + kRowsAbove) * stride_ + kMargin;
  }
  /// The slid vertices of even row r: 0 West, 1 East.
  [[nodiscard]] Wide& slid(int r, int side) {
    return slid_[2 * static_cast<std::size_t>(r) + static_cast<std::size_t>(side)];
  }

  /// Rows -3 to -1, all of them `base`.
  void fill_rows_above(Wide base) { std::fill_n(samples_.get(), kRowsAbove * stride_, base); }
  /// What stands West of row r while it is predicted: the sample North-East of its first place.
  void open_row(int r) {
    Wide* const samples = row(r);
    const int start = first(r);
    samples[start - 1] = samples[start - 2] = row(r - 1)[start + r % 2];
  }
  /// What the rows below find in the margins of row r: its outermost samples again.
  void close_row(int r) {
    close_west(r);
    close_east(r);
  }
  /// Either side alone; the West once the row's first two samples are known.
  void close_west(int r) {
    Wide* const samples = row(r);
    for (int place = -kMargin; place < first(r); ++place) samples[place] = samples[first(r)];
  }
  void close_east(int r) {
    Wide* const samples = row(r);
    for (int place = last(r) + 1; place < columns_ + kMargin; ++place) samples[place] = samples[last(r)];
  }
  /// What a slid vertex is predicted as: the mean of its two neighbours on the row, rounded down.
  [[nodiscard]] Wide slid_prediction(int r, int side) const {
    const Wide* const samples = row(r);
    const int at = side == 0 ? 1 : columns_ - 3;
    return (samples[at] + samples[at + 1]) >> 1;
  }

 private:
  int columns_;
  int rows_;
  int stride_;
  std::unique_ptr<Wide[]> samples_;  ///< set row by row, before it is read
  std::vector<Wide> slid_;
};

/// What a void sample counts as while its neighbours are predicted: the mean of W and NE, rounded down.
template <typename Wide>
[[nodiscard]] inline Wide void_fill(const Wide* own, const Wide* north, int place) {
  return (own[place - 1] + north[place]) >> 1;
}

/// The column whose sample stands at a lattice place, and that of a slid vertex (even rows; 0 West, 1 East). A row is
/// coded place by place from West to East, an even row's slid vertices after it.
[[nodiscard]] inline int column_of_place(int columns, int row, int place) {
  if (row % 2 != 0) return place;
  if (place == 1) return 0;
  return place == columns - 2 ? columns - 1 : place;
}
[[nodiscard]] inline int column_of_slid(int columns, int side) {
  return side == 0 ? 1 : columns - 2;
}

}  // namespace isohf
