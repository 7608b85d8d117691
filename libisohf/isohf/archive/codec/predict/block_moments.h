#pragma once

#include <cstddef>
#include <vector>

#include "isohf/archive/codec/predict/hex_predictor.h"

/// What the fit of a tile's predictors is computed from, block by block.

namespace isohf {

inline constexpr std::size_t kMaxMomentTerms = kWeightCount + 1;  ///< the neighbours less NE, and the error so far
inline constexpr std::size_t kMomentLanes = 8;

/// Entries of a lower triangle, filled up to whole lanes.
constexpr std::size_t moment_count(std::size_t terms) {
  return (terms * (terms + 1) / 2 + kMomentLanes - 1) / kMomentLanes * kMomentLanes;
}

/// Moments of the blocks of a tile: for each the products of its samples' differences and errors, summed.
template <typename Wide>
class BlockMoments {
 public:
  BlockMoments(const Lattice<Wide>& lattice, bool is_wide, Wide low, Wide high);

  [[nodiscard]] std::size_t terms() const { return terms_; }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(across_ * down_); }
  [[nodiscard]] int across() const { return across_; }
  [[nodiscard]] const float* of_block(std::size_t block) const {
    return moments_.data() + block * moment_count(terms_);
  }

  /// Takes the rows `start`, `start` + step, ... with their errors as `predictors` leave them.
  void measure(const Predictors& predictors, int start, int step);

  /// The sum of all blocks' moments alone.
  [[nodiscard]] std::vector<double> measure_whole(const Predictors& predictors, int start, int step);

 private:
  template <typename Use>
  void take_bands(const Predictors& predictors, int start, int step, const Use& use);
  void take_row(int r, int slot, int slots, const Predictors& predictors);

  const Lattice<Wide>& lattice_;
  Wide low_;
  Wide high_;
  std::size_t terms_;
  int across_;
  int down_;
  std::vector<float> scale_;
  std::vector<float> errors_;
  std::vector<Wide> halves_;
  std::size_t stride_;
  std::vector<float> values_;
  std::vector<float> moments_;
};

/// Adds a block's moments to a sum of such. moments, sum [count]
void add_moments(const float* moments, std::size_t count, double* __restrict sum);

/// A quadratic form of a block, given the products of its variables. moments, products [count], a multiple of 4.
[[nodiscard]] double weigh_moments(const float* moments, const double* products, std::size_t count);

}  // namespace isohf
