#include "isohf/archive/codec/predict/hex_predictor.h"

#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/base/unaligned.h"
#include "isohf/base/vectorised.h"
#if defined(ISOHF_HAS_WIDE)
#include <immintrin.h>
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"  // kernels are inlined: their vectors cross no boundary
#endif

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
template <std::size_t kTerms>
[[gnu::always_inline]] inline void predict_codes(const Neighbours<std::int32_t>& at, const PredictorWeights& weights,
                                                 int begin, int end, std::int32_t low, std::int32_t high,
                                                 std::int32_t* __restrict out) {
  const auto [w, from, anchor] = weighted_rows<kTerms, std::int32_t, std::uint32_t>(at, weights);
  const std::int32_t least = 2 * low;
  const std::int32_t most = 2 * high - 1;
  for (int c = begin; c < end; ++c) {
    std::uint32_t sum = anchor * static_cast<std::uint32_t>(at.north[c]);
    for (std::size_t i = 0; i < kTerms; ++i) sum += w[i] * static_cast<std::uint32_t>(from[i][c]);
    const std::int32_t halves = static_cast<std::int32_t>(sum) >> kHalvesBits;
    const std::int32_t raised = halves < least ? least : halves;
    out[c] = raised > most ? most : raised;
  }
}

// Only free functions can be compiled for several machines, not templates.
ISOHF_VECTORISED(void, predict_codes_near,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t low, std::int32_t high, std::int32_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_codes<kNearWeightCount>(at, weights, begin, end, low, high, out);
}
ISOHF_VECTORISED(void, predict_codes_widely,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t low, std::int32_t high, std::int32_t* __restrict out),
                 (at, weights, begin, end, low, high, out)) {
  predict_codes<kWeightCount>(at, weights, begin, end, low, high, out);
}
/// All weights but those of W and WW: what remains of the sum is decided by the rows above.
constexpr bool is_above(std::size_t weight) {
  return weight != 0 && weight != 2;
}

ISOHF_VECTORISED(void, sum_codes_above,
                 (const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                  std::int32_t* __restrict out),
                 (at, weights, begin, end, out)) {
  const auto [w, from, anchor] = weighted_rows<kWeightCount, std::int32_t, std::uint32_t>(at, weights);
  for (int c = begin; c < end; ++c) {
    std::uint32_t sum = anchor * static_cast<std::uint32_t>(at.north[c]);
    for (std::size_t i = 0; i < kWeightCount; ++i) {
      if (is_above(i)) sum += w[i] * static_cast<std::uint32_t>(from[i][c]);
    }
    out[c] = static_cast<std::int32_t>(sum);
  }
}

// --- floats: samples of 32 bits with a sign, sums that need 64 ---

using Four = std::int64_t __attribute__((vector_size(32)));

/// Products of samples and weights: both fit 32 bits, which most machines multiply by fours and 64 bits not.
template <bool kIsWide>
[[gnu::always_inline]] inline Four multiply(const std::int64_t* samples, Four weights) {
#if defined(ISOHF_HAS_WIDE)
  if constexpr (kIsWide) {
    using Eight = std::int32_t __attribute__((vector_size(32)));
    return (Four)__builtin_ia32_pmuldq256(unaligned<Eight>(samples).value, (Eight)weights);
  }
#endif
  return unaligned<Four>(samples).value * weights;
}

/// Sums of the terms that `is_summed` names, and of the anchor, handed to `put(place, sums)` by fours and to
/// `put_one(place, sum)` where fewer are left.
template <bool kIsWide, std::size_t kTerms, typename IsSummed, typename Put, typename PutOne>
[[gnu::always_inline]] inline void sum_floats(const Neighbours<std::int64_t>& at, const PredictorWeights& weights,
                                              int begin, int end, const IsSummed& is_summed, const Put& put,
                                              const PutOne& put_one) {
  const auto [w, from, anchor] = weighted_rows<kTerms, std::int64_t, std::int64_t>(at, weights);
  int c = begin;
  for (; c + 4 <= end; c += 4) {
    Four sum = multiply<kIsWide>(at.north + c, Four{} + anchor);
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (is_summed(i)) sum += multiply<kIsWide>(from[i] + c, Four{} + w[i]);
    }
    put(c, sum);
  }
  for (; c < end; ++c) {
    std::int64_t sum = anchor * at.north[c];
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (is_summed(i)) sum += w[i] * from[i][c];
    }
    put_one(c, sum);
  }
}

template <bool kIsWide, std::size_t kTerms>
[[gnu::always_inline]] inline void predict_floats(const Neighbours<std::int64_t>& at, const PredictorWeights& weights,
                                                  int begin, int end, std::int64_t low, std::int64_t high,
                                                  std::int64_t* __restrict out) {
  const std::int64_t least = 2 * low;
  const std::int64_t most = 2 * high - 1;
  // Sums stay below 2^15 * 2 * 2^31: raised by as much they are never negative, and plain shifts will do.
  constexpr std::int64_t kRaise = std::int64_t{1} << 48;
  using FourWords = std::uint64_t __attribute__((vector_size(32)));
  const auto put = [&](int c, Four sum) {
    const Four halves = (Four)((FourWords)(sum + kRaise) >> kHalvesBits) - (kRaise >> kHalvesBits);
    const Four raised = halves < least ? Four{} + least : halves;
    unaligned<Four>(out + c).value = raised > most ? Four{} + most : raised;
  };
  const auto put_one = [&](int c, std::int64_t sum) {
    const std::int64_t halves = sum >> kHalvesBits;
    const std::int64_t raised = halves < least ? least : halves;
    out[c] = raised > most ? most : raised;
  };
  sum_floats<kIsWide, kTerms>(
      at, weights, begin, end, [](std::size_t) { return true; }, put, put_one);
}

ISOHF_TWO_WAYS(void, predict_floats_near,
               (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                std::int64_t low, std::int64_t high, std::int64_t* __restrict out),
               (at, weights, begin, end, low, high, out)) {
  predict_floats<kIsWide, kNearWeightCount>(at, weights, begin, end, low, high, out);
}
ISOHF_TWO_WAYS(void, predict_floats_widely,
               (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                std::int64_t low, std::int64_t high, std::int64_t* __restrict out),
               (at, weights, begin, end, low, high, out)) {
  predict_floats<kIsWide, kWeightCount>(at, weights, begin, end, low, high, out);
}

template <bool kIsWide, std::size_t kTerms>
[[gnu::always_inline]] inline void sum_above(const Neighbours<std::int64_t>& at, const PredictorWeights& weights,
                                             int begin, int end, std::int64_t* __restrict out) {
  sum_floats<kIsWide, kTerms>(
      at, weights, begin, end, is_above, [&](int c, Four sum) { unaligned<Four>(out + c).value = sum; },
      [&](int c, std::int64_t sum) { out[c] = sum; });
}

ISOHF_TWO_WAYS(void, sum_floats_above,
               (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                std::int64_t* __restrict out),
               (at, weights, begin, end, out)) {
  sum_above<kIsWide, kNearWeightCount>(at, weights, begin, end, out);
}
ISOHF_TWO_WAYS(void, sum_floats_widely_above,
               (const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin, int end,
                std::int64_t* __restrict out),
               (at, weights, begin, end, out)) {
  sum_above<kIsWide, kWeightCount>(at, weights, begin, end, out);
}

ISOHF_VECTORISED(void, zigzag_codes,
                 (const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* __restrict out),
                 (own, halves, count, out)) {
  for (int i = 0; i < count; ++i) {
    const auto difference = static_cast<std::int16_t>(oriented_difference(own[i], halves[i]));
    out[i] = static_cast<std::uint16_t>(zigzag(difference));
  }
}

ISOHF_VECTORISED(void, zigzag_floats,
                 (const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* __restrict out),
                 (own, halves, count, out)) {
  for (int i = 0; i < count; ++i) out[i] = zigzag(static_cast<std::int32_t>(oriented_difference(own[i], halves[i])));
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

void zigzag_row(const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* out) {
  zigzag_codes(own, halves, count, out);
}
void zigzag_row(const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* out) {
  zigzag_floats(own, halves, count, out);
}

}  // namespace isohf
