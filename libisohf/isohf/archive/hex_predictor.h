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
///         NNNWW . NNNW . NNNE . NNNEE            row r-3      weights: one each, in the order of
///         Neighbours::of_weight;
///  NNWWW . NNWW . NNW . NN . NNE . NNEE . NNEEE  row r-2      NE has what is left to make the sum 1; the outermost
///       NWWW . NWW . NW . NE . NEE . NEEE        row r-1      six take part in wide prediction alone
///                WW . W  . (x)                   row r
///
/// Rows are worked on in lattice order: even rows keep column 0 in place 1 and column C-1 in place C-2, where the
/// lattice has them (errata E5), and their two slid vertices apart; these are predicted from their row once it is
/// known.

namespace isohf {

inline constexpr std::size_t kWeightCount = 18;
inline constexpr std::size_t kNearWeightCount = 12;  ///< the first so many are all that near prediction has
inline constexpr int kWeightBits = 12;               ///< weights are multiples of 2^-12
using PredictorWeights = std::array<std::int16_t, kWeightCount>;

/// Weights of the first three rows, which lack rows above: W; then W + NE - NW; then what terrain has on average.
inline constexpr PredictorWeights kFirstRowWeights = {4096};
inline constexpr PredictorWeights kSecondRowWeights = {4096, -4096};
inline constexpr PredictorWeights kThirdRowWeights = {4750, -1050, -1180, 370, -1230, 350, -1230, -290, 50, 660};

/// The sum of |weight| must stay below this, so that 16-bit samples are predicted in 32 bits: 28671 * 65534 + 4096 *
/// 65534 < 2^31.
inline constexpr int kWeightSumLimit = 7 << kWeightBits;

inline constexpr std::size_t kMaxPredictors = 8;
inline constexpr int kBlockPlaces = 16;  ///< a block of places that share a predictor: so many wide and high

/// The weights of a tile, and which of them hold where.
struct Predictors {
  std::vector<PredictorWeights> weights = {kThirdRowWeights};  ///< 1 to kMaxPredictors
  bool is_wide = false;                                        ///< all weights count, not only the near ones
  std::vector<std::uint8_t> map;  ///< block by block, row by row, an index into weights; empty where there is one
  int block_columns = 0;

  [[nodiscard]] static int blocks_across(int places) { return (places + kBlockPlaces - 1) / kBlockPlaces; }
  [[nodiscard]] const PredictorWeights& of_row(int r) const {
    return r == 0 ? kFirstRowWeights : r == 1 ? kSecondRowWeights : kThirdRowWeights;
  }
  /// Calls `use(weights, begin, end)` for stretches of places [begin, end) that have the same weights, from `first` to
  /// `last` of row r.
  template <typename Use>
  void for_stretches(int r, int first, int last, const Use& use) const {
    if (r <= 2) return use(of_row(r), first, last + 1);
    if (map.empty()) return use(weights.front(), first, last + 1);
    const std::uint8_t* const row = map.data() + static_cast<std::ptrdiff_t>(r / kBlockPlaces) * block_columns;
    for (int begin = first; begin <= last;) {
      int block = begin / kBlockPlaces;
      const std::uint8_t index = row[block];
      while (block < block_columns && row[block] == index) ++block;
      const int end = std::min(block * kBlockPlaces, last + 1);
      use(weights[index], begin, end);
      begin = end;
    }
  }
};

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
        samples_(std::make_unique_for_overwrite<Wide[]>(sample_count() + kSpare)),
        slid_(2 * static_cast<std::size_t>(rows_)) {
    std::fill_n(samples_.get() + sample_count(), kSpare, Wide{0});
  }

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
  static constexpr std::size_t kSpare = 2 * kBlockPlaces;  ///< whole blocks are read past the end of a row

  [[nodiscard]] std::size_t sample_count() const {
    return static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_ + kRowsAbove);
  }

  int columns_;
  int rows_;
  int stride_;
  std::unique_ptr<Wide[]> samples_;  ///< set row by row, before it is read
  std::vector<Wide> slid_;
};

/// Predictions for all lattice places of row r, in halves of a sample: 2 * prediction, less 1 where it was rounded up.
/// Limited to the samples' range [low, high]. `halves` is indexed by place. The row must be open.
template <typename Wide>
void predict_row(const Lattice<Wide>& lattice, int r, const Predictors& predictors, Wide low, Wide high,
                 std::span<Wide> halves);

/// The part of a prediction that the rows above decide, by place: halves = (part + wW*W + wWW*WW) >> (kWeightBits - 1),
/// limited to 2*low ... 2*high-1.
void predict_row_from_above(const Lattice<std::int64_t>& lattice, int r, const Predictors& predictors,
                            std::span<std::int64_t> parts);
void predict_row_from_above(const Lattice<std::int32_t>& lattice, int r, const Predictors& predictors,
                            std::span<std::int32_t> parts);

/// The sample that halves predict, and the difference from it that is folded: a sample below it comes first where it
/// was rounded up, one above it otherwise.
template <typename Wide>
[[nodiscard]] inline Wide prediction_of_halves(Wide halves) {
  return (halves + 1) >> 1;
}
template <typename Wide>
[[nodiscard]] inline Wide oriented_difference(Wide sample, Wide halves) {
  const Wide difference = prediction_of_halves(halves) - sample;
  return (halves & 1) != 0 ? -difference : difference;
}

}  // namespace isohf
