#pragma once

#include <array>
#include <cstddef>

#include "isohf/archive/codec/predict/predictors.h"
#include "isohf/archive/codec/predict/sample_lattice.h"

/// Where the neighbours of a row's samples stand in memory: shared by prediction and by the fit of its weights.

namespace isohf {

/// own[c-1] is W, north[c] NE, far[c] NN and farther[c] the one North-East of NE's NN.
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
  [[nodiscard]] const Wide* of_weight(std::size_t i) const {
    const std::array<const Wide*, kWeightCount> all = {
        own - 1, north - 1, own - 2,     north + 1,   north - 2,   far,       far + 1,   far - 1, far + 2,
        far - 2, farther,   farther - 1, farther + 1, farther - 2, north + 2, north - 3, far + 3, far - 3};
    return all[i];
  }
};

}  // namespace isohf
