#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/lattice/tile_shape.h"

/// Linear prediction on the hexagonal neighbourhood of a tile's vertices, in integers, so that every decoder on every
/// machine predicts what the encoder predicted (docs/archive_format.md, "Prediction").
///
///             NNNW . NNNE             row r-3      weights: one each, in this order, for W, NW, WW, NEE, NWW, NN, NNE,
///     NNWW . NNW . NN . NNE . NNEE    row r-2      NNW, NNEE, NNWW, and the two of row r-3 (East, West); NE has what
///        NWW . NW . NE . NEE          row r-1      is left to make the sum 1
///          WW . W  . (x)              row r
///
/// Rows are worked on in lattice order: even rows keep column 0 in place 1 and column C-1 in place C-2, where the
/// lattice has them (errata E5), and their two slid vertices apart; these are predicted from their row once it is
/// known.

namespace isohf {

inline constexpr int kWeightCount = 12;
inline constexpr int kWeightBits = 12;  ///< weights are multiples of 2^-12
using PredictorWeights = std::array<std::int16_t, kWeightCount>;

/// Weights of the first three rows, which lack rows above: W; then W + NE - NW; then what terrain has on average.
inline constexpr PredictorWeights kFirstRowWeights = {4096};
inline constexpr PredictorWeights kSecondRowWeights = {4096, -4096};
inline constexpr PredictorWeights kThirdRowWeights = {4750, -1050, -1180, 370, -1230, 350, -1230, -290, 50, 660};

/// The weights of row r, of which `fitted` are a tile's own.
[[nodiscard]] inline const PredictorWeights& weights_of_row(const PredictorWeights& fitted, int r) {
  if (r > 2) return fitted;
  return r == 0 ? kFirstRowWeights : r == 1 ? kSecondRowWeights : kThirdRowWeights;
}

/// The sum of |weight| must stay below this, so that 16-bit samples are predicted in 32 bits.
inline constexpr int kWeightSumLimit = 1 << 15;

/// The samples of a tile in lattice order, with two places of margin West and East and three rows North. Wide: int32
/// for codes, int64 for floats.
template <typename Wide>
class Lattice {
 public:
  static constexpr int kMargin = 2;
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

  /// Place 0 of row r; rows -3 to -1 exist, as do places -2, -1, C and C+1.
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
    Wide* const samples = row(r);
    for (int place = -kMargin; place < first(r); ++place) samples[place] = samples[first(r)];
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

/// Predictions for all lattice places of row r, limited to [low, high]; `predictions` is indexed by place. The row must
/// be open.
template <typename Wide>
void predict_row(const Lattice<Wide>& lattice, int r, const PredictorWeights& weights, Wide low, Wide high,
                 std::span<Wide> predictions);

/// The part of a row's predictions that the rows above decide: prediction = clamp((part + wW·W + wWW·WW) >> 12).
template <typename Wide>
void predict_row_from_above(const Lattice<Wide>& lattice, int r, const PredictorWeights& weights,
                            std::span<Wide> parts);

/// The rows above the one that is predicted, by place: NE stands at north[place], NN at far[place], NNNE at
/// farther[place].
struct RowsAbove {
  const std::int32_t* north;
  const std::int32_t* far;
  const std::int32_t* farther;
};

/// predict_row_from_above for rows of codes that are no Lattice. parts: indexed by place, first to last are written.
void predict_from_above(const RowsAbove& rows, int first, int last, const PredictorWeights& weights,
                        std::int32_t* parts);

/// The weights that predict the tile's rows from the fourth on best: least squares, then twice more with every sample
/// weighted by how well it and its surroundings were predicted, which is what their codes' lengths go by. In large
/// tiles every seventh row takes part. All rows must be closed; low and high are the range of the samples.
template <typename Wide>
[[nodiscard]] PredictorWeights fit_weights(const Lattice<Wide>& lattice, Wide low, Wide high);

}  // namespace isohf
