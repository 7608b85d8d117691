#include "isohf/archive/hex_predictor.h"

#include "isohf/archive/neighbours.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

constexpr int kHalvesBits = kWeightBits - 1;

template <std::size_t kTerms, typename Wide, typename Unsigned>
struct WeightedRows {
  std::array<Unsigned, kTerms> w{};
  std::array<const Wide*, kTerms> from{};
  Unsigned anchor = 1U << kWeightBits;  ///< the weight of North, so that all weights sum up to 1
};

template <std::size_t kTerms, typename Wide, typename Unsigned>
[[gnu::always_inline]] inline WeightedRows<kTerms, Wide, Unsigned> weighted_rows(const Neighbours<Wide>& at,
                                                                                 const PredictorWeights& weights) {
  WeightedRows<kTerms, Wide, Unsigned> rows;
  for (std::size_t i = 0; i < kTerms; ++i) {
    rows.w[i] = static_cast<Unsigned>(Wide{weights[i]});
    rows.from[i] = at.of_weight(i);
    rows.anchor -= rows.w[i];
  }
  return rows;
}

/// `out` is none of the lattice's rows; the compiler has to be told so, or it does not vectorise. Sums of codes are
/// taken modulo 2^32, which they leave in part but not in whole.
template <std::size_t kTerms, typename Wide, typename Unsigned>
[[gnu::always_inline]] inline void predict_places(const Neighbours<Wide>& at, const PredictorWeights& weights,
                                                  int begin, int end, Wide low, Wide high, Wide* __restrict out) {
  const auto [w, from, anchor] = weighted_rows<kTerms, Wide, Unsigned>(at, weights);
  const Wide least = 2 * low;
  const Wide most = 2 * high - 1;
  for (int c = begin; c < end; ++c) {
    Unsigned sum = anchor * static_cast<Unsigned>(at.north[c]);
    for (std::size_t i = 0; i < kTerms; ++i) sum += w[i] * static_cast<Unsigned>(from[i][c]);
    const Wide halves = static_cast<Wide>(sum) >> kHalvesBits;
    const Wide raised = halves < least ? least : halves;
    out[c] = raised > most ? most : raised;
  }
}

// Only free functions can be compiled for several machines, not templates.
ISOHF_VECTORISED(void, predict_codes_near,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t low, std::int32_t high, std::int32_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_places<kNearWeightCount, std::int32_t, std::uint32_t>(at, weights, begin, end, low, high, out);
}
ISOHF_VECTORISED(void, predict_codes_widely,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t low, std::int32_t high, std::int32_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_places<kWeightCount, std::int32_t, std::uint32_t>(at, weights, begin, end, low, high, out);
}
ISOHF_VECTORISED(void, predict_floats_near,
                 (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int64_t low, std::int64_t high, std::int64_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_places<kNearWeightCount, std::int64_t, std::uint64_t>(at, weights, begin, end, low, high, out);
}
ISOHF_VECTORISED(void, predict_floats_widely,
                 (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int64_t low, std::int64_t high, std::int64_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_places<kWeightCount, std::int64_t, std::uint64_t>(at, weights, begin, end, low, high, out);
}

/// What remains of the sum without W and WW.
template <std::size_t kTerms, typename Wide, typename Unsigned>
[[gnu::always_inline]] inline void sum_above(const Neighbours<Wide>& at, const PredictorWeights& weights, int begin,
                                             int end, Wide* __restrict out) {
  const auto [w, from, anchor] = weighted_rows<kTerms, Wide, Unsigned>(at, weights);
  for (int c = begin; c < end; ++c) {
    Unsigned sum = anchor * static_cast<Unsigned>(at.north[c]);
    for (std::size_t i = 1; i < kTerms; ++i) {
      if (i != 2) sum += w[i] * static_cast<Unsigned>(from[i][c]);
    }
    out[c] = static_cast<Wide>(sum);
  }
}

ISOHF_VECTORISED(void, sum_codes_above,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t* __restrict out),
                 (at, weights, begin, end, out)) {
  sum_above<kWeightCount, std::int32_t, std::uint32_t>(at, weights, begin, end, out);
}
ISOHF_VECTORISED(void, sum_floats_above,
                 (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int64_t* __restrict out),
                 (at, weights, begin, end, out)) {
  sum_above<kNearWeightCount, std::int64_t, std::uint64_t>(at, weights, begin, end, out);
}
ISOHF_VECTORISED(void, sum_floats_widely_above,
                 (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int64_t* __restrict out),
                 (at, weights, begin, end, out)) {
  sum_above<kWeightCount, std::int64_t, std::uint64_t>(at, weights, begin, end, out);
}

}  // namespace

template <>
void predict_row(const Lattice<std::int32_t>& lattice, int r, const Predictors& predictors, std::int32_t low,
                 std::int32_t high, std::span<std::int32_t> halves) {
  const Neighbours at(lattice, r);
  predictors.for_stretches(r, at.first, at.last, [&](const PredictorWeights& weights, int begin, int end) {
    if (predictors.is_wide) {
      predict_codes_widely(at, weights, begin, end, low, high, halves.data());
    } else {
      predict_codes_near(at, weights, begin, end, low, high, halves.data());
    }
  });
}

template <>
void predict_row(const Lattice<std::int64_t>& lattice, int r, const Predictors& predictors, std::int64_t low,
                 std::int64_t high, std::span<std::int64_t> halves) {
  const Neighbours at(lattice, r);
  predictors.for_stretches(r, at.first, at.last, [&](const PredictorWeights& weights, int begin, int end) {
    if (predictors.is_wide) {
      predict_floats_widely(at, weights, begin, end, low, high, halves.data());
    } else {
      predict_floats_near(at, weights, begin, end, low, high, halves.data());
    }
  });
}

void predict_row_from_above(const Lattice<std::int32_t>& lattice, int r, const Predictors& predictors,
                            std::span<std::int32_t> parts) {
  const Neighbours at(lattice, r);
  predictors.for_stretches(r, at.first, at.last, [&](const PredictorWeights& weights, int begin, int end) {
    sum_codes_above(at, weights, begin, end, parts.data());
  });
}

void predict_row_from_above(const Lattice<std::int64_t>& lattice, int r, const Predictors& predictors,
                            std::span<std::int64_t> parts) {
  const Neighbours at(lattice, r);
  predictors.for_stretches(r, at.first, at.last, [&](const PredictorWeights& weights, int begin, int end) {
    if (predictors.is_wide) {
      sum_floats_widely_above(at, weights, begin, end, parts.data());
    } else {
      sum_floats_above(at, weights, begin, end, parts.data());
    }
  });
}

}  // namespace isohf
