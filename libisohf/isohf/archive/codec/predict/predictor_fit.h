#pragma once

#include "isohf/archive/codec/predict/hex_predictor.h"

/// The weights that predict a tile best. How they are found concerns no reader.

namespace isohf {

/// How much work the fit is worth.
struct FitEffort {
  int passes = 2;          ///< fits of one predictor for the whole tile; 0: the third row's weights for all
  int pass_thinning = 7;   ///< in large tiles one row in so many takes part in these; odd: rows of both kinds do
  int predictors = 2;      ///< of the tile at most
  int rounds = 1;          ///< fits of several predictors, each with new weights for the samples
  int round_thinning = 3;  ///< rows that take part in them
  int moves = 3;           ///< in each round, how often blocks choose their predictor anew
  bool is_wide = false;    ///< eighteen weights instead of twelve
};

/// Least squares over the rows from the fourth on, every sample weighted by how well its surroundings were predicted
/// before, which is what their codes' lengths go by. Several predictors: each block of the tile goes to the one that
/// predicts it best, and each is fitted to its blocks, in turn. All rows must be closed; low and high are the range of
/// the samples. Deterministic: single operations of IEEE arithmetic in a fixed order.
template <typename Wide>
[[nodiscard]] Predictors fit_predictors(const Lattice<Wide>& lattice, Wide low, Wide high, const FitEffort& effort);

}  // namespace isohf
