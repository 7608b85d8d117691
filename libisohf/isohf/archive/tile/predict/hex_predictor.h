#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "isohf/archive/tile/predict/predictors.h"
#include "isohf/archive/tile/predict/sample_lattice.h"

/// Linear prediction on the hexagonal neighbourhood of a tile's vertices, in integers, so that every decoder on every
/// machine predicts what the encoder predicted (docs/archive_format.md, "Prediction").
///
///         NNNWW . NNNW . NNNE . NNNEE            row r-3      weights: one each, in the order of
///  NNWWW . NNWW . NNW . NN . NNE . NNEE . NNEEE  row r-2      Neighbours::of_weight; NE has what is left to make the
///       NWWW . NWW . NW . NE . NEE . NEEE        row r-1      sum 1; the outermost six take part in wide prediction
///                WW . W  . (x)                   row r        alone

namespace isohf {

/// Where the neighbours of a row's samples stand in memory. own[c-1] is W, north[c] NE, far[c] NN and farther[c] the one North-East of NE's NN.
template <typename Wide>
struct Neighbours {
  const Wide* own;
  const Wide* north;
  const Wide* far;
  const Wide* farther;
  int first;
  int last;

  Neighbours(const Lattice<Wide>& lattice, int r)
      : own(lattice.row(r)),
        north(lattice.row(r - 1) + r % 2),
        far(lattice.row(r - 2)),
        farther(lattice.row(r - 3) + r % 2),
        first(Lattice<Wide>::first(r)),
        last(lattice.last(r)) {}

  /// The samples that weight i belongs to, indexed by place.
  [[nodiscard]] const Wide* of_weight(std::size_t i) const { return of_all_weights()[i]; }
  [[nodiscard]] std::array<const Wide*, kWeightCount> of_all_weights() const {
    return {own - 1, north - 1, own - 2,     north + 1,   north - 2,   far,       far + 1,   far - 1, far + 2,
            far - 2, farther,   farther - 1, farther + 1, farther - 2, north + 2, north - 3, far + 3, far - 3};
  }
};

/// Predictions for all lattice places of row r, in halves of a sample: 2 * prediction, less 1 where it was rounded up.
/// Limited to the samples' range [low, high]. `halves` is indexed by place. The row must be open.
template <typename Wide>
void predict_row(const Lattice<Wide>& lattice, int r, const Predictors& predictors, Wide low, Wide high,
                 std::span<Wide> halves);

/// The same of codes in eighths of a code, rounded down, within 8*low ... 8*high.
void predict_row_in_eighths(const Lattice<std::int32_t>& lattice, int r, const Predictors& predictors, std::int32_t low,
                            std::int32_t high, std::span<std::int32_t> eighths);

/// The part of a prediction that the rows above decide, by place: halves = (part + wW*W + wWW*WW) >> (kWeightBits - 1),
/// limited to 2*low ... 2*high-1.
template <typename Wide>
void predict_row_from_above(const Lattice<Wide>& lattice, int r, const Predictors& predictors, std::span<Wide> parts);

/// The sample that halves predict, and the difference from it that is zigzagged: a sample below it comes first where it
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

/// Zigzag residuals of `count` samples, from predictions in halves. own, halves, out [count]; `out` is neither of the
/// others.
void zigzag_row(const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* out);
void zigzag_row(const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* out);

}  // namespace isohf
