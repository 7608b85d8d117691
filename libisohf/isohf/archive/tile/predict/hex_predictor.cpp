#include "isohf/archive/tile/predict/hex_predictor.h"

#include <type_traits>

#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/simd/vector_operations.h"

namespace isohf {
namespace {

constexpr int kHalvesBits = kWeightBits - 1;

template <std::size_t kTerms, typename Wide, typename Unsigned>
struct WeightedRows {
  std::array<Unsigned, kTerms> w{};
  std::array<const Wide*, kTerms> from{};
  Unsigned anchor = 1U << kWeightBits;  ///< the weight of North-East, so that all weights sum up to 1

  ISOHF_KERNEL WeightedRows(const Neighbours<Wide>& at, const PredictorWeights& weights) {
    for (std::size_t i = 0; i < kTerms; ++i) {
      w[i] = static_cast<Unsigned>(Wide{weights[i]});
      from[i] = at.of_weight(i);
      anchor -= w[i];
    }
  }
};

/// What is wanted of a sum: predict_row, predict_row_from_above, predict_row_in_eighths.
enum class Wanted : std::uint8_t { kHalves, kAbove, kEighths };

/// Whether a weight takes part in a sum: in that of the rows above all do but W's and WW's.
constexpr bool takes_part(std::size_t weight, bool is_above) {
  return !is_above || (weight != 0 && weight != 2);
}

/// What is wanted for the first kTerms weights. `out` is none of the lattice's rows. Sums of codes are taken modulo
/// 2^32, which they leave in part but not in whole.
template <std::size_t kTerms, Wanted kWanted>
ISOHF_KERNEL void predict_codes(const Neighbours<std::int32_t>& at, const PredictorWeights& weights, int begin, int end,
                                std::int32_t low, std::int32_t high, std::int32_t* __restrict out) {
  const WeightedRows<kTerms, std::int32_t, std::uint32_t> rows(at, weights);
  constexpr bool kIsAbove = kWanted == Wanted::kAbove;
  constexpr bool kIsFine = kWanted == Wanted::kEighths;
  const std::int32_t least = kIsFine ? 8 * low : 2 * low;
  const std::int32_t most = kIsFine ? 8 * high : 2 * high - 1;
  for (int c = begin; c < end; ++c) {
    std::uint32_t sum = rows.anchor * static_cast<std::uint32_t>(at.north[c]);
#pragma GCC unroll 18  // or the compiler leaves eighteen terms a loop, and samples one by one
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (takes_part(i, kIsAbove)) sum += rows.w[i] * static_cast<std::uint32_t>(rows.from[i][c]);
    }
    const std::int32_t prediction = static_cast<std::int32_t>(sum) >> (kIsFine ? kWeightBits - 3 : kHalvesBits);
    const std::int32_t raised = prediction < least ? least : prediction;
    out[c] = kIsAbove ? static_cast<std::int32_t>(sum) : raised > most ? most : raised;
  }
}

/// The same for floats: samples and weights fit 32 bits, their products 64.
template <bool kIsWide, std::size_t kTerms, bool kIsAbove>
ISOHF_KERNEL void predict_floats(const Neighbours<std::int64_t>& at, const PredictorWeights& weights, int begin,
                                 int end, std::int64_t low, std::int64_t high, std::int64_t* __restrict out) {
  const WeightedRows<kTerms, std::int64_t, std::int64_t> rows(at, weights);
  const std::int64_t least = 2 * low;
  const std::int64_t most = 2 * high - 1;
  // Sums stay below 2^15 * 2 * 2^31: raised by as much they are never negative, and plain shifts will do.
  constexpr std::int64_t kRaise = std::int64_t{1} << 48;
  int c = begin;
  for (; c + 4 <= end; c += 4) {
    Longs sum = multiply_low_halves<kIsWide>(unaligned<Longs>(at.north + c).value, Longs{} + rows.anchor);
#pragma GCC unroll 18
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (!takes_part(i, kIsAbove)) continue;
      sum += multiply_low_halves<kIsWide>(unaligned<Longs>(rows.from[i] + c).value, Longs{} + rows.w[i]);
    }
    const Longs halves = (Longs)((LongWords)(sum + kRaise) >> kHalvesBits) - (kRaise >> kHalvesBits);
    const Longs raised = halves < least ? Longs{} + least : halves;
    unaligned<Longs>(out + c).value = kIsAbove ? sum : raised > most ? Longs{} + most : raised;
  }
  for (; c < end; ++c) {
    std::int64_t sum = rows.anchor * at.north[c];
    for (std::size_t i = 0; i < kTerms; ++i) {
      if (takes_part(i, kIsAbove)) sum += rows.w[i] * rows.from[i][c];
    }
    const std::int64_t raised = std::max(sum >> kHalvesBits, least);
    out[c] = kIsAbove ? sum : std::min(raised, most);
  }
}

template <Wanted kWanted, typename Wide>
void predict(const Lattice<Wide>& lattice, int r, const Predictors& predictors, Wide low, Wide high, Wide* out) {
  const Neighbours at(lattice, r);
  const PredictorWeights& weights = predictors.of_row(r);
  const int end = at.last + 1;
  const auto predict_with = [&](auto terms) {
    if constexpr (std::is_same_v<Wide, std::int32_t>) {
      vectorised<predict_codes<terms, kWanted>>(at, weights, at.first, end, low, high, out);
    } else {
      constexpr bool kIsAbove = kWanted == Wanted::kAbove;
      vectorised<predict_floats<false, terms, kIsAbove>, predict_floats<true, terms, kIsAbove>>(at, weights, at.first,
                                                                                                end, low, high, out);
    }
  };
  predictors.is_wide ? predict_with(std::integral_constant<std::size_t, kWeightCount>())
                     : predict_with(std::integral_constant<std::size_t, kNearWeightCount>());
}

template <typename Residual, typename Wide, typename Zigzagged>
ISOHF_KERNEL void zigzag_samples(const Wide* own, const Wide* halves, int count, Zigzagged* __restrict out) {
  for (int i = 0; i < count; ++i) {
    out[i] = static_cast<Zigzagged>(zigzag(static_cast<Residual>(oriented_difference(own[i], halves[i]))));
  }
}

}  // namespace

template <typename Wide>
void predict_row(const Lattice<Wide>& lattice, int r, const Predictors& predictors, Wide low, Wide high,
                 std::span<Wide> halves) {
  predict<Wanted::kHalves>(lattice, r, predictors, low, high, halves.data());
}
template <typename Wide>
void predict_row_from_above(const Lattice<Wide>& lattice, int r, const Predictors& predictors, std::span<Wide> parts) {
  predict<Wanted::kAbove>(lattice, r, predictors, Wide{0}, Wide{0}, parts.data());
}
void predict_row_in_eighths(const Lattice<std::int32_t>& lattice, int r, const Predictors& predictors, std::int32_t low,
                            std::int32_t high, std::span<std::int32_t> eighths) {
  predict<Wanted::kEighths>(lattice, r, predictors, low, high, eighths.data());
}
template void predict_row(const Lattice<std::int32_t>&, int, const Predictors&, std::int32_t, std::int32_t,
                          std::span<std::int32_t>);
template void predict_row(const Lattice<std::int64_t>&, int, const Predictors&, std::int64_t, std::int64_t,
                          std::span<std::int64_t>);
template void predict_row_from_above(const Lattice<std::int32_t>&, int, const Predictors&, std::span<std::int32_t>);
template void predict_row_from_above(const Lattice<std::int64_t>&, int, const Predictors&, std::span<std::int64_t>);

void zigzag_row(const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* out) {
  vectorised<zigzag_samples<std::int16_t, std::int32_t, std::uint16_t>>(own, halves, count, out);
}
void zigzag_row(const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* out) {
  vectorised<zigzag_samples<std::int32_t, std::int64_t, std::uint32_t>>(own, halves, count, out);
}

}  // namespace isohf
