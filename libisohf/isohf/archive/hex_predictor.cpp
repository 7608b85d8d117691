#include "isohf/archive/hex_predictor.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>

// Wide vectors where the machine has them; the results are integers and the same everywhere.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define ISOHF_VECTORISED __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define ISOHF_VECTORISED
#endif

namespace isohf {
namespace {

constexpr int kRounding = 1 << (kWeightBits - 1);

/// A row's neighbours, each as an array indexed by place.
template <typename Wide>
struct Neighbours {
  const Wide* own;
  const Wide* north;  // so that north[place] is NE
  const Wide* north_north;

  Neighbours(const Lattice<Wide>& lattice, int r)
      : own(lattice.row(r)), north(lattice.row(r - 1) + r % 2), north_north(lattice.row(r - 2)) {}
};

template <typename Wide>
inline void predict_places(const Wide* own, const Wide* north, const Wide* far, const PredictorWeights& weights,
                           int first, int last, Wide low, Wide high, Wide* out) {
  const Wide w = weights[0], nw = weights[1], ww = weights[2], nee = weights[3];
  const Wide nww = weights[4], nn = weights[5], nne = weights[6], nnw = weights[7];
  for (int c = first; c <= last; ++c) {
    const Wide ne = north[c];
    const Wide sum = w * (own[c - 1] - ne) + nw * (north[c - 1] - ne) + ww * (own[c - 2] - ne) +
                     nee * (north[c + 1] - ne) + nww * (north[c - 2] - ne) + nn * (far[c] - ne) +
                     nne * (far[c + 1] - ne) + nnw * (far[c - 1] - ne);
    const Wide value = ne + ((sum + kRounding) >> kWeightBits);
    out[c] = std::min(std::max(value, low), high);
  }
}

// Only free functions of plain arguments can be cloned for several machines.
ISOHF_VECTORISED void predict_codes(const std::int32_t* own, const std::int32_t* north, const std::int32_t* far,
                                    const PredictorWeights& weights, int first, int last, std::int32_t low,
                                    std::int32_t high, std::int32_t* out) {
  predict_places(own, north, far, weights, first, last, low, high, out);
}

ISOHF_VECTORISED void predict_parts(const std::int32_t* north, const std::int32_t* far, const PredictorWeights& weights,
                                    int first, int last, std::int32_t* out) {
  // Sums wrap modulo 2^32: the parts may leave 32 bits, the completed sum does not.
  const auto weight = [&](int i) {
    return static_cast<std::uint32_t>(std::int32_t{weights[static_cast<std::size_t>(i)]});
  };
  const std::uint32_t nw = weight(1), nee = weight(3), nww = weight(4), nn = weight(5), nne = weight(6),
                      nnw = weight(7);
  const std::uint32_t anchor = (1U << kWeightBits) - (weight(0) + nw + weight(2) + nee + nww + nn + nne + nnw);
  const auto at = [](const std::int32_t* samples, int c) { return static_cast<std::uint32_t>(samples[c]); };
  for (int c = first; c <= last; ++c) {
    out[c] = static_cast<std::int32_t>(anchor * at(north, c) + nw * at(north, c - 1) + nee * at(north, c + 1) +
                                       nww * at(north, c - 2) + nn * at(far, c) + nne * at(far, c + 1) +
                                       nnw * at(far, c - 1) + kRounding);
  }
}

}  // namespace

template <>
void predict_row(const Lattice<std::int32_t>& lattice, int r, const PredictorWeights& weights, std::int32_t low,
                 std::int32_t high, std::span<std::int32_t> predictions) {
  const Neighbours<std::int32_t> at(lattice, r);
  predict_codes(at.own, at.north, at.north_north, weights, Lattice<std::int32_t>::first(r), lattice.last(r), low, high,
                predictions.data());
}

template <>
void predict_row(const Lattice<std::int64_t>& lattice, int r, const PredictorWeights& weights, std::int64_t low,
                 std::int64_t high, std::span<std::int64_t> predictions) {
  const Neighbours<std::int64_t> at(lattice, r);
  predict_places(at.own, at.north, at.north_north, weights, Lattice<std::int64_t>::first(r), lattice.last(r), low, high,
                 predictions.data());
}

template <>
void predict_row_from_above(const Lattice<std::int32_t>& lattice, int r, const PredictorWeights& weights,
                            std::span<std::int32_t> parts) {
  const Neighbours<std::int32_t> at(lattice, r);
  predict_parts(at.north, at.north_north, weights, Lattice<std::int32_t>::first(r), lattice.last(r), parts.data());
}

template <>
void predict_row_from_above(const Lattice<std::int64_t>& lattice, int r, const PredictorWeights& weights,
                            std::span<std::int64_t> parts) {
  const Neighbours<std::int64_t> at(lattice, r);
  std::int64_t sum = 0;
  for (const std::int64_t weight : weights) sum += weight;
  const std::int64_t anchor = (std::int64_t{1} << kWeightBits) - sum;
  for (int c = Lattice<std::int64_t>::first(r); c <= lattice.last(r); ++c) {
    parts[static_cast<std::size_t>(c)] = anchor * at.north[c] + weights[1] * at.north[c - 1] +
                                         weights[3] * at.north[c + 1] + weights[4] * at.north[c - 2] +
                                         weights[5] * at.north_north[c] + weights[6] * at.north_north[c + 1] +
                                         weights[7] * at.north_north[c - 1] + kRounding;
  }
}

namespace {

constexpr int kTerms = kWeightCount + 1;  // eight neighbours and the sample itself, each less NE
constexpr int kDifferenceLimit = 1023;    // squares of which add up to 31 bits over kChunk places
constexpr int kChunk = 2048;

using Moments = std::array<std::array<std::int64_t, kTerms>, kTerms>;
using Differences = std::array<std::array<std::int16_t, kChunk>, kTerms>;

ISOHF_VECTORISED std::int32_t dot(const std::int16_t* a, const std::int16_t* b, int count) {
  std::int32_t sum = 0;
  for (int i = 0; i < count; ++i) sum += std::int32_t{a[i]} * b[i];
  return sum;
}

template <typename Wide>
void take_differences(const Neighbours<Wide>& at, int start, int count, int shift, Differences& differences) {
  const auto take = [&](std::size_t term, const Wide* samples) {
    for (int i = 0; i < count; ++i) {
      const Wide difference = (samples[start + i] - at.north[start + i]) >> shift;
      differences[term][static_cast<std::size_t>(i)] =
          static_cast<std::int16_t>(std::clamp<Wide>(difference, -kDifferenceLimit, kDifferenceLimit));
    }
  };
  take(0, at.own - 1);
  take(1, at.north - 1);
  take(2, at.own - 2);
  take(3, at.north + 1);
  take(4, at.north - 2);
  take(5, at.north_north);
  take(6, at.north_north + 1);
  take(7, at.north_north - 1);
  take(8, at.own);
}

/// The shift that brings the mean |W - NE| near 2^6, far below the limit of the differences.
template <typename Wide>
int difference_shift(const Lattice<Wide>& lattice) {
  std::uint64_t sum = 0;
  std::uint64_t count = 0;
  for (int r = 2; r < lattice.rows(); r += 4) {
    const Neighbours<Wide> at(lattice, r);
    for (int c = Lattice<Wide>::first(r) + 1; c <= lattice.last(r); ++c, ++count) {
      sum += static_cast<std::uint64_t>(std::abs(at.own[c] - at.north[c]));
    }
  }
  const std::uint64_t mean = sum / std::max<std::uint64_t>(count, 1);
  int shift = 0;
  while ((mean >> shift) > 64) ++shift;
  return shift;
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
  const double ridge = trace * 1e-6 + 1.0;  // flat and one-dimensional terrain leaves weights undecided
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

}  // namespace

template <typename Wide>
PredictorWeights fit_weights(Lattice<Wide>& lattice) {
  const int shift = difference_shift(lattice);
  Moments moments{};
  const auto differences = std::make_unique<Differences>();
  for (int r = 2; r < lattice.rows(); ++r) {
    const Neighbours<Wide> at(lattice, r);
    const int start = Lattice<Wide>::first(r) + 2;  // places whose WW is a sample of the row
    for (int from = start; from <= lattice.last(r); from += kChunk) {
      const int count = std::min(kChunk, lattice.last(r) + 1 - from);
      take_differences(at, from, count, shift, *differences);
      for (std::size_t i = 0; i < kTerms; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
          moments[i][j] += dot((*differences)[i].data(), (*differences)[j].data(), count);
        }
      }
    }
  }
  const auto solution = solve(moments);
  if (!solution) return kSecondRowWeights;
  PredictorWeights weights{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kWeightCount; ++i) {
    const double scaled = std::floor((*solution)[i] * (1 << kWeightBits) + 0.5);
    sum += std::abs(scaled);
    if (!(sum < kWeightSumLimit)) return kSecondRowWeights;
    weights[i] = static_cast<std::int16_t>(scaled);
  }
  return weights;
}

template PredictorWeights fit_weights(Lattice<std::int32_t>& lattice);
template PredictorWeights fit_weights(Lattice<std::int64_t>& lattice);

}  // namespace isohf
