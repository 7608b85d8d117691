#pragma once

#include "isohf/archive/tile/predict/hex_predictor.h"

/// The weights that predict a tile best. How they are found concerns no reader.

namespace isohf {

/// How much work the fit is worth.
struct FitEffort {
  int passes = 2;       ///< each with errors that the one before left; 0: the third row's weights for all
  int thinning = 9;     ///< in large tiles one row in so many takes part; odd: rows of both kinds do
  bool is_wide = true;  ///< eighteen weights instead of twelve
};

/// Least squares over the rows from the fourth on, every sample weighted by how well its surroundings were predicted
/// before, which is what their codes' lengths go by. All rows must be closed; low and high are the range of the samples.
/// Deterministic: single operations of IEEE arithmetic in a fixed order.
template <typename Wide>
[[nodiscard]] Predictors fit_predictors(const Lattice<Wide>& lattice, Wide low, Wide high, const FitEffort& effort);

}  // namespace isohf
