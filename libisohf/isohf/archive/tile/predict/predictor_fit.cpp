#include "isohf/archive/tile/predict/predictor_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr std::size_t kMomentLanes = 8;

/// Entries of a lower triangle of the neighbours less NE, and the error so far, filled up to whole lanes.
constexpr std::size_t moment_count(std::size_t terms) {
  return (terms * (terms + 1) / 2 + kMomentLanes - 1) / kMomentLanes * kMomentLanes;
}

constexpr std::size_t kPairs = 4;

/// Differences of samples as floats: exact as doubles, then rounded once. Floats' differences have 34 bits at most, and
/// machines that turn no 64-bit integers into doubles add them to the lowest bits of 1.5 * 2^52.
ISOHF_KERNEL float as_float(std::int32_t difference) {
  return static_cast<float>(difference);
}
ISOHF_KERNEL float as_float(std::int64_t difference) {
  constexpr double kBase = 6755399441055744.0;
  return static_cast<float>(std::bit_cast<double>(std::bit_cast<std::int64_t>(kBase) + difference) - kBase);
}

/// Neighbours of one row less NE, scaled.
template <typename Wide>
ISOHF_KERNEL void scale_row(const Wide* samples, const Wide* anchor, const float* scale, int first, int last,
                            float* __restrict out) {
  for (int p = first; p <= last; ++p) out[p] = as_float(samples[p] - anchor[p]) * scale[p];
}
ISOHF_KERNEL void scale_errors(const float* errors, const float* scale, int first, int last, float* __restrict out) {
  for (int p = first; p <= last; ++p) out[p] = errors[p] * scale[p];
}

/// Sums of products of all pairs of terms, `terms` arrays of `count` floats that lie `stride` apart; count is a
/// multiple of 8. Eight sums a pair and then their tree: the same order on every machine. Pairs are worked on by fours:
/// three more terms than there are must be readable, and three more sums are written than there are pairs.
ISOHF_KERNEL void multiply_pairs(const float* values, std::size_t terms, std::size_t stride, std::size_t count,
                                 float* __restrict out) {
  using Eight = float __attribute__((vector_size(4 * kMomentLanes)));
  using Four = float __attribute__((vector_size(16)));
  for (std::size_t i = 0; i < terms; ++i) {
    const float* const a = values + i * stride;
    for (std::size_t j = 0; j <= i; j += kPairs) {
      const float* const b = values + j * stride;
      Eight sums[kPairs] = {};
      for (std::size_t k = 0; k < count; k += kMomentLanes) {
        const Eight factor = unaligned<Eight>(a + k).value;
        for (std::size_t pair = 0; pair < kPairs; ++pair) {
          sums[pair] += factor * unaligned<Eight>(b + pair * stride + k).value;
        }
      }
      Four halves[kPairs];
      for (std::size_t pair = 0; pair < kPairs; ++pair) {
        halves[pair] = __builtin_shufflevector(sums[pair], sums[pair], 0, 1, 2, 3) +
                       __builtin_shufflevector(sums[pair], sums[pair], 4, 5, 6, 7);
      }
      const Four first = __builtin_shufflevector(halves[0], halves[1], 0, 4, 1, 5) +
                         __builtin_shufflevector(halves[0], halves[1], 2, 6, 3, 7);
      const Four second = __builtin_shufflevector(halves[2], halves[3], 0, 4, 1, 5) +
                          __builtin_shufflevector(halves[2], halves[3], 2, 6, 3, 7);
      unaligned<Four>(out + j).value =
          __builtin_shufflevector(first, second, 0, 1, 4, 5) + __builtin_shufflevector(first, second, 2, 3, 6, 7);
    }
    out += i + 1;
  }
}

ISOHF_KERNEL void add_all(const float* moments, std::size_t count, double* __restrict sum) {
  for (std::size_t i = 0; i < count; ++i) sum[i] += double{moments[i]};
}

/// |error| in samples, from predictions in halves.
template <typename Wide>
ISOHF_KERNEL void find_errors(const Wide* own, const Wide* halves, int first, int last, float* __restrict errors) {
  for (int c = first; c <= last; ++c) errors[c] = 0.5F * as_float(2 * own[c] - halves[c]);
}

/// A sample's weight: the inverse of the error that it had, for a quarter, and its neighbours on the row.
ISOHF_KERNEL void weigh_by_errors(const float* __restrict errors, int first, int last, float* __restrict scale) {
  constexpr float kFloor = 0.25F;  // samples; smaller errors are rounding
  for (int c = first + 2; c < last; ++c) {
    const float around = std::abs(errors[c - 2]) + 2.0F * std::abs(errors[c - 1]) + std::abs(errors[c + 1]);
    scale[c] = 1.0F / (0.25F * std::abs(errors[c]) + 0.1875F * around + kFloor);
  }
}

/// Moments of a tile: the products of its samples' differences and errors, summed.
template <typename Wide>
class Moments {
 public:
  Moments(const Lattice<Wide>& lattice, bool is_wide, Wide low, Wide high)
      : lattice_(lattice),
        low_(low),
        high_(high),
        terms_((is_wide ? kWeightCount : kNearWeightCount) + 1),
        stride_((static_cast<std::size_t>(lattice.columns()) + kMomentLanes - 1) / kMomentLanes * kMomentLanes),
        scale_(stride_),
        errors_(stride_),
        halves_(stride_),
        values_((terms_ + kPairs - 1) * stride_) {}

  [[nodiscard]] std::size_t terms() const { return terms_; }

  /// Those of the rows `start`, `start` + step, ... with their errors as `predictors` leave them.
  [[nodiscard]] std::vector<double> measure(const Predictors& predictors, int start, int step) {
    std::vector<double> sum(moment_count(terms_));
    std::vector<float> of_row(sum.size() + kPairs);
    for (int row = start; row < lattice_.rows(); row += step) {
      take_row(row, predictors);
      vectorised<multiply_pairs>(values_.data(), terms_, stride_, stride_, of_row.data());
      vectorised<add_all>(of_row.data(), terms_ * (terms_ + 1) / 2, sum.data());
    }
    return sum;
  }

 private:
  void take_row(int r, const Predictors& predictors) {
    const Neighbours<Wide> at(lattice_, r);
    predict_row<Wide>(lattice_, r, predictors, low_, high_, halves_);
    vectorised<find_errors<Wide>>(at.own, halves_.data(), at.first, at.last, errors_.data());
    std::fill(scale_.begin(), scale_.end(), 0.0F);  // WW of the first two and the East of the last are not of the row
    vectorised<weigh_by_errors>(errors_.data(), at.first, at.last, scale_.data());
    for (std::size_t term = 0; term + 1 < terms_; ++term) {
      vectorised<scale_row<Wide>>(at.of_weight(term), at.north, scale_.data(), at.first, at.last,
                                  values_.data() + term * stride_);
    }
    vectorised<scale_errors>(errors_.data(), scale_.data(), at.first, at.last, values_.data() + (terms_ - 1) * stride_);
  }

  const Lattice<Wide>& lattice_;
  Wide low_;
  Wide high_;
  std::size_t terms_;
  std::size_t stride_;
  std::vector<float> scale_;
  std::vector<float> errors_;
  std::vector<Wide> halves_;
  std::vector<float> values_;
};

constexpr int kRowsToThin = 96;  // below, all rows take part

using Solution = std::array<double, kWeightCount>;

/// Solves the normal equations by LDL^T. Only the four operations of IEEE arithmetic, so the same everywhere; nullopt
/// where they are singular.
std::optional<Solution> solve(const std::vector<double>& moments, std::size_t terms) {
  const std::size_t n = terms - 1;
  const auto moment = [&](std::size_t i, std::size_t j) { return moments[i * (i + 1) / 2 + j]; };
  std::array<Solution, kWeightCount> lower{};
  Solution diagonal{};
  Solution solution{};
  double trace = 0.0;
  for (std::size_t i = 0; i < n; ++i) trace += moment(i, i);
  const double ridge = trace * 1e-7 + 1e-3;  // flat and one-dimensional terrain leaves weights undecided
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = moment(i, j) + (i == j ? ridge : 0.0);
      for (std::size_t k = 0; k < j; ++k) sum -= lower[i][k] * lower[j][k] * diagonal[k];
      if (i == j) {
        if (!(sum > 0.0)) return std::nullopt;
        diagonal[i] = sum;
      } else {
        lower[i][j] = sum / diagonal[j];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    double sum = moment(n, i);
    for (std::size_t k = 0; k < i; ++k) sum -= lower[i][k] * solution[k];
    solution[i] = sum;
  }
  for (std::size_t i = n; i-- > 0;) {
    double sum = solution[i] / diagonal[i];
    for (std::size_t k = i + 1; k < n; ++k) sum -= lower[k][i] * solution[k];
    solution[i] = sum;
  }
  return solution;
}

/// Weights that a solution, a change of `weights`, leads to; nullopt where they exceed what the header may hold.
std::optional<PredictorWeights> changed(const PredictorWeights& weights, const Solution& solution) {
  PredictorWeights out{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kWeightCount; ++i) {
    const double scaled = std::floor(weights[i] + solution[i] * (1 << kWeightBits) + 0.5);
    sum += std::abs(scaled);
    if (!(sum < kWeightSumLimit)) return std::nullopt;
    out[i] = static_cast<std::int16_t>(scaled);
  }
  return out;
}

}  // namespace

template <typename Wide>
Predictors fit_predictors(const Lattice<Wide>& lattice, Wide low, Wide high, const FitEffort& effort) {
  Moments<Wide> moments(lattice, effort.is_wide, low, high);
  Predictors predictors;
  predictors.is_wide = effort.is_wide;
  const int step = lattice.rows() >= kRowsToThin ? effort.thinning : 1;
  for (int pass = 0; pass < effort.passes; ++pass) {
    const auto solution = solve(moments.measure(predictors, 3 + pass % step, step), moments.terms());
    const auto weights = solution ? changed(predictors.weights, *solution) : std::nullopt;
    if (!weights) break;
    predictors.weights = *weights;
  }
  return predictors;
}

template Predictors fit_predictors(const Lattice<std::int32_t>& lattice, std::int32_t low, std::int32_t high,
                                   const FitEffort& effort);
template Predictors fit_predictors(const Lattice<std::int64_t>& lattice, std::int64_t low, std::int64_t high,
                                   const FitEffort& effort);

}  // namespace isohf
