#pragma once

#include <cstdint>
#include <span>

#include "isohf/archive/codec/predict/predictors.h"
#include "isohf/archive/codec/predict/sample_lattice.h"

/// Linear prediction on the hexagonal neighbourhood of a tile's vertices, in integers, so that every decoder on every
/// machine predicts what the encoder predicted (docs/archive_format.md, "Prediction").
///
///         NNNWW . NNNW . NNNE . NNNEE            row r-3      weights: one each, in the order of
///  NNWWW . NNWW . NNW . NN . NNE . NNEE . NNEEE  row r-2      Neighbours::of_weight; NE has what is left to make the
///       NWWW . NWW . NW . NE . NEE . NEEE        row r-1      sum 1; the outermost six take part in wide prediction
///                WW . W  . (x)                   row r        alone

namespace isohf {

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
