#include "isohf/archive/hex_predictor.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>

#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

constexpr int kRounding = 1 << (kWeightBits - 1);

/// Where a row's neighbours stand: own[c-1] is W, north[c] NE, far[c] NN and farther[c] the one North-East of NE's NN.
template <typename Wide>
struct Neighbours {
  const Wide* own;
  const Wide* north;
  const Wide* far;
  const Wide* farther;
  int first;
  int last;

  Neighbours(const RowsAbove& rows, int first_place, int last_place) requires(sizeof(Wide) == 4)
      : own(nullptr), north(rows.north), far(rows.far), farther(rows.farther), first(first_place), last(last_place) {}
  Neighbours(const Lattice<Wide>& lattice, int r)
      : own(lattice.row(r)),
        north(lattice.row(r - 1) + r % 2),
        far(lattice.row(r - 2)),
        farther(lattice.row(r - 3) + r % 2),
        first(Lattice<Wide>::first(r)),
        last(lattice.last(r)) {}

  /// The samples that weight i belongs to, indexed by place.
  [[nodiscard]] const Wide* of_weight(std::size_t i) const {
    const std::array<const Wide*, kWeightCount> all = {own - 1, north - 1, own - 2, north + 1, north - 2, far,
                                                       far + 1, far - 1,   far + 2, far - 2,   farther,   farther - 1};
    return all[i];
  }
};

/// `out` is none of the lattice's rows; the compiler has to be told so, or it does not vectorise.
template <typename Wide>
inline void predict_places(const Neighbours<Wide>& at, const PredictorWeights& weights, Wide low, Wide high,
                           Wide* __restrict out) {
  const Wide* const own = at.own;
  const Wide* const north = at.north;
  const Wide* const far = at.far;
  const Wide* const farther = at.farther;
  std::array<Wide, kWeightCount> w{};
  std::copy(weights.begin(), weights.end(), w.begin());
  for (int c = at.first; c <= at.last; ++c) {
    const Wide ne = north[c];
    const Wide sum = w[0] * (own[c - 1] - ne) + w[1] * (north[c - 1] - ne) + w[2] * (own[c - 2] - ne) +
                     w[3] * (north[c + 1] - ne) + w[4] * (north[c - 2] - ne) + w[5] * (far[c] - ne) +
                     w[6] * (far[c + 1] - ne) + w[7] * (far[c - 1] - ne) + w[8] * (far[c + 2] - ne) +
                     w[9] * (far[c - 2] - ne) + w[10] * (farther[c] - ne) + w[11] * (farther[c - 1] - ne);
    const Wide value = ne + ((sum + kRounding) >> kWeightBits);
    const Wide raised = value < low ? low : value;
    out[c] = raised > high ? high : raised;
  }
}

// Only free functions can be cloned for several machines, not templates.
ISOHF_VECTORISED(void, predict_codes,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, std::int32_t low,
                  std::int32_t high, std::int32_t* __restrict out),
                 (at, weights, low, high, out)) {
  predict_places(at, weights, low, high, out);
}

/// Sums of weighted samples above. Unsigned: modulo 2^32 for codes, whose parts may leave 32 bits where the completed
/// sum does not.
template <typename Wide, typename Unsigned>
inline void sum_above(const Neighbours<Wide>& at, const PredictorWeights& weights, Wide* __restrict out) {
  const Wide* const north = at.north;
  const Wide* const far = at.far;
  const Wide* const farther = at.farther;
  std::array<Unsigned, kWeightCount> w{};
  Unsigned anchor = 1U << kWeightBits;
  for (std::size_t i = 0; i < w.size(); ++i) {
    w[i] = static_cast<Unsigned>(Wide{weights[i]});
    anchor -= w[i];
  }
  const auto u = [](Wide value) { return static_cast<Unsigned>(value); };
  for (int c = at.first; c <= at.last; ++c) {
    out[c] = static_cast<Wide>(anchor * u(north[c]) + w[1] * u(north[c - 1]) + w[3] * u(north[c + 1]) +
                               w[4] * u(north[c - 2]) + w[5] * u(far[c]) + w[6] * u(far[c + 1]) + w[7] * u(far[c - 1]) +
                               w[8] * u(far[c + 2]) + w[9] * u(far[c - 2]) + w[10] * u(farther[c]) +
                               w[11] * u(farther[c - 1]) + kRounding);
  }
}

ISOHF_VECTORISED(void, sum_codes_above,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, std::int32_t* __restrict out),
                 (at, weights, out)) {
  sum_above<std::int32_t, std::uint32_t>(at, weights, out);
}

}  // namespace

void predict_from_above(const RowsAbove& rows, int first, int last, const PredictorWeights& weights,
                        std::int32_t* parts) {
  sum_codes_above(Neighbours<std::int32_t>(rows, first, last), weights, parts);
}

template <>
void predict_row(const Lattice<std::int32_t>& lattice, int r, const PredictorWeights& weights, std::int32_t low,
                 std::int32_t high, std::span<std::int32_t> predictions) {
  predict_codes(Neighbours(lattice, r), weights, low, high, predictions.data());
}

template <>
void predict_row(const Lattice<std::int64_t>& lattice, int r, const PredictorWeights& weights, std::int64_t low,
                 std::int64_t high, std::span<std::int64_t> predictions) {
  predict_places(Neighbours(lattice, r), weights, low, high, predictions.data());
}

template <>
void predict_row_from_above(const Lattice<std::int32_t>& lattice, int r, const PredictorWeights& weights,
                            std::span<std::int32_t> parts) {
  sum_codes_above(Neighbours(lattice, r), weights, parts.data());
}

template <>
void predict_row_from_above(const Lattice<std::int64_t>& lattice, int r, const PredictorWeights& weights,
                            std::span<std::int64_t> parts) {
  sum_above<std::int64_t, std::uint64_t>(Neighbours(lattice, r), weights, parts.data());
}

namespace {

constexpr std::size_t kTerms = kWeightCount + 1;  // the neighbours and the sample itself, each less NE
constexpr float kDifferenceLimit = 1023.0F;       // squares of which add up to less than 2^31 over kChunk places
constexpr int kChunk = 2048;
constexpr int kPasses = 3;
constexpr int kRowsToThin = 96;  // from this many rows on, one in kThinning says enough in each pass
constexpr int kThinning = 7;     // odd: rows of both kinds take part

using Moments = std::array<std::array<std::int64_t, kTerms>, kTerms>;

ISOHF_VECTORISED(std::int32_t, dot, (const std::int16_t* a, const std::int16_t* b, int count), (a, b, count)) {
  std::int32_t sum = 0;
  for (int i = 0; i < count; ++i) sum += std::int32_t{a[i]} * b[i];
  return sum;
}

template <typename Wide>
inline void scale_differences(const Wide* samples, const Wide* anchor, const float* scale, int count,
                              std::int16_t* out) {
  for (int i = 0; i < count; ++i) {
    const float difference = static_cast<float>(samples[i] - anchor[i]) * scale[i];
    out[i] = static_cast<std::int16_t>(
        static_cast<std::int32_t>(std::min(std::max(difference, -kDifferenceLimit), kDifferenceLimit)));
  }
}

ISOHF_VECTORISED(void, scale_code_differences,
                 (const std::int32_t* samples, const std::int32_t* anchor, const float* scale, int count,
                  std::int16_t* out),
                 (samples, anchor, scale, count, out)) {
  scale_differences(samples, anchor, scale, count, out);
}

/// One row's part of the normal equations.
class MomentSum {
 public:
  template <typename Wide>
  void add(const Neighbours<Wide>& at, std::span<const float> scale) {
    const int start = at.first + 2;  // places whose WW is a sample of the row
    for (int from = start; from <= at.last; from += kChunk) {
      const int count = std::min(kChunk, at.last + 1 - from);
      const auto take = [&](std::size_t term, const Wide* samples) {
        if constexpr (sizeof(Wide) == 4) {
          scale_code_differences(samples + from, at.north + from, &scale[static_cast<std::size_t>(from)], count,
                                 differences_[term].data());
        } else {
          scale_differences(samples + from, at.north + from, &scale[static_cast<std::size_t>(from)], count,
                            differences_[term].data());
        }
      };
      for (std::size_t term = 0; term < kWeightCount; ++term) take(term, at.of_weight(term));
      take(kWeightCount, at.own);
      for (std::size_t i = 0; i < kTerms; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
          moments_[i][j] += dot(differences_[i].data(), differences_[j].data(), count);
        }
      }
    }
  }
  [[nodiscard]] const Moments& moments() const { return moments_; }

 private:
  Moments moments_{};
  std::array<std::array<std::int16_t, kChunk>, kTerms> differences_{};
};

/// What brings the mean |W - NE| to 2^6 at most, far below the limit of the differences.
template <typename Wide>
float overall_scale(const Lattice<Wide>& lattice) {
  std::uint64_t sum = 0;
  std::uint64_t count = 0;
  for (int r = 2; r < lattice.rows(); r += 5) {
    const Neighbours<Wide> at(lattice, r);
    for (int c = at.first + 1; c <= at.last; ++c, ++count) {
      sum += static_cast<std::uint64_t>(std::abs(at.own[c - 1] - at.north[c]));
    }
  }
  const std::uint64_t mean = sum / std::max<std::uint64_t>(count, 1);
  float scale = 1.0F;
  for (std::uint64_t rest = mean; rest > 64; rest /= 2) scale *= 0.5F;
  return scale;
}

template <typename Wide>
inline void find_errors(const Wide* own, const Wide* predictions, int first, int last, float* __restrict errors) {
  for (int c = first; c <= last; ++c) errors[c] = std::abs(static_cast<float>(own[c] - predictions[c]));
}
ISOHF_VECTORISED(void, find_code_errors,
                 (const std::int32_t* own, const std::int32_t* predictions, int first, int last,
                  float* __restrict errors),
                 (own, predictions, first, last, errors)) {
  find_errors(own, predictions, first, last, errors);
}

/// A sample's weight: the inverse of the error that it and its neighbours on the row had, half and half.
ISOHF_VECTORISED(void, weigh_by_errors,
                 (const float* __restrict errors, int first, int last, float overall, float* __restrict scale),
                 (errors, first, last, overall, scale)) {
  constexpr float kFloor = 2.0F;  // errors below this, in units of 1/overall, tell nothing
  constexpr float kGain = 4.0F;
  const auto weight = [&](int c, float east) {
    const float around = errors[c - 2] + 2.0F * errors[c - 1] + east;
    const float typical = 0.5F * errors[c] + 0.125F * around;
    return kGain * overall / (typical * overall + kFloor);
  };
  for (int c = first + 2; c < last; ++c) scale[c] = weight(c, errors[c + 1]);
  if (last >= first + 2) scale[last] = weight(last, errors[last]);
}

/// Solves the normal equations by LDL^T. Only the four operations of IEEE arithmetic, so the same everywhere; nullopt
/// where they are singular.
std::optional<std::array<double, kWeightCount>> solve(const Moments& moments) {
  constexpr std::size_t n = kWeightCount;
  std::array<std::array<double, n>, n> lower{};
  std::array<double, n> diagonal{};
  std::array<double, n> solution{};
  double trace = 0.0;
  for (std::size_t i = 0; i < n; ++i) trace += static_cast<double>(moments[i][i]);
  const double ridge = trace * 1e-9 + 1.0;  // flat and one-dimensional terrain leaves weights undecided
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = static_cast<double>(moments[i][j]) + (i == j ? ridge : 0.0);
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
    double sum = static_cast<double>(moments[n][i]);
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

/// Weights as the header stores them; nullopt where they exceed what it may hold.
std::optional<PredictorWeights> quantise(const std::array<double, kWeightCount>& solution) {
  PredictorWeights weights{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kWeightCount; ++i) {
    const double scaled = std::floor(solution[i] * (1 << kWeightBits) + 0.5);
    sum += std::abs(scaled);
    if (!(sum < kWeightSumLimit)) return std::nullopt;
    weights[i] = static_cast<std::int16_t>(scaled);
  }
  return weights;
}

}  // namespace

template <typename Wide>
PredictorWeights fit_weights(const Lattice<Wide>& lattice, Wide low, Wide high) {
  const auto columns = static_cast<std::size_t>(lattice.columns());
  const float overall = overall_scale(lattice);
  const int step = lattice.rows() >= kRowsToThin ? kThinning : 1;
  std::vector<float> scale(columns, overall);
  std::vector<float> errors(columns);
  std::vector<Wide> predictions(columns);
  PredictorWeights weights = kThirdRowWeights;
  for (int pass = 0; pass < kPasses; ++pass) {
    const auto sum = std::make_unique<MomentSum>();
    for (int r = 3 + pass % step; r < lattice.rows(); r += step) {
      const Neighbours<Wide> at(lattice, r);
      if (pass > 0) {
        predict_row<Wide>(lattice, r, weights, low, high, predictions);
        if constexpr (sizeof(Wide) == 4) {
          find_code_errors(at.own, predictions.data(), at.first, at.last, errors.data());
        } else {
          find_errors(at.own, predictions.data(), at.first, at.last, errors.data());
        }
        weigh_by_errors(errors.data(), at.first, at.last, overall, scale.data());
      }
      sum->add(at, scale);
    }
    const auto solution = solve(sum->moments());
    if (!solution) return weights;
    const auto fitted = quantise(*solution);
    if (!fitted) return weights;
    weights = *fitted;
  }
  return weights;
}

template PredictorWeights fit_weights(const Lattice<std::int32_t>& lattice, std::int32_t low, std::int32_t high);
template PredictorWeights fit_weights(const Lattice<std::int64_t>& lattice, std::int64_t low, std::int64_t high);

}  // namespace isohf
