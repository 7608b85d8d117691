#include "isohf/archive/codec/simd/batch_floats.h"

#include <algorithm>

#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/archive/codec/simd/vector_operations.h"

namespace isohf {
namespace {

constexpr std::size_t kLanes = kBatchLanes;
constexpr std::ptrdiff_t kStep = BatchRing::kStep;

/// Where the sample of each weight stands from the predicted one (Neighbours::of_weight), NE's last.
struct Term {
  BatchRow row;
  int place;
};
constexpr std::size_t kWest = 0;
constexpr std::size_t kFarWest = 2;
constexpr std::array<Term, kWeightCount + 1> kTerms = {{
    {BatchRow::kOwn, -1},    {BatchRow::kNorth, -1},   {BatchRow::kOwn, -2},    {BatchRow::kNorth, 1},
    {BatchRow::kNorth, -2},  {BatchRow::kFar, 0},      {BatchRow::kFar, 1},     {BatchRow::kFar, -1},
    {BatchRow::kFar, 2},     {BatchRow::kFar, -2},     {BatchRow::kFarther, 0}, {BatchRow::kFarther, -1},
    {BatchRow::kFarther, 1}, {BatchRow::kFarther, -2}, {BatchRow::kNorth, 2},   {BatchRow::kNorth, -3},
    {BatchRow::kFar, 3},     {BatchRow::kFar, -3},     {BatchRow::kNorth, 0},
}};

using Rows = BatchRows<std::uint32_t>;

/// Sums are those of samples and weights and half a sample, 2^11: bits from the twelfth on are the prediction, and the
/// eleventh is set where it was not rounded up. At (low << 12) + 2^11 they reach the range, at (high << 12) + 2^11 they
/// leave it.
constexpr std::int64_t kHalf = std::int64_t{1} << (kWeightBits - 1);

constexpr bool is_summed_above(std::size_t term, bool is_near) {
  return term != kWest && term != kFarWest && !(is_near && term >= kNearWeightCount && term < kWeightCount);
}

/// Even lanes are worked on as they stand, in the low halves of 64 bits; odd ones are brought there.
ISOHF_KERNEL Ints odd_lanes(Ints values) {
  return __builtin_shufflevector(values, values, 1, 1, 3, 3, 5, 5, 7, 7);
}
template <bool kIsWide>
ISOHF_KERNEL Longs multiply(Ints samples, const PerLane<std::int32_t>& weights) {
  return multiply_low_halves<kIsWide>((Longs)samples, unaligned<Longs>(weights.data()).value);
}

/// What becomes of half of the lanes' sums: samples, in the low halves. All that can be is made ready before the sum is
/// known, which each place waits for.
struct Outcomes {
  Longs residual;
  Longs minus_residual;
  Longs below;  ///< the sample where the sum lies below the range, and above
  Longs above;
};
template <bool kIsWide>
ISOHF_KERNEL Longs restore_half(Longs sum, Longs least, Longs most, const Outcomes& outcomes) {
  const Longs step = choose_by_sign<kIsWide>((Longs)((LongWords)sum << (64 - kWeightBits)), outcomes.minus_residual,
                                             outcomes.residual);
  const Longs inside = (Longs)(((LongWords)sum >> kWeightBits) + (LongWords)step);
  const Longs lowered = choose_by_sign<kIsWide>(sum - most, inside, outcomes.above);
  return choose_by_sign<kIsWide>(sum - least, outcomes.below, lowered);
}

template <bool kIsWide, bool kIsNear, bool kWithVoids>
ISOHF_KERNEL void restore_places(const Rows& rows, const FloatStretch& weights, int begin, int end, BatchRange& range) {
  using Bytes = std::int8_t __attribute__((vector_size(kLanes)));
  const auto bound_of = [](Ints value) { return (Longs)((LongWords)value << 32U) >> (32 - kWeightBits); };
  const Ints low = unaligned<Ints>(range.low.data()).value;
  const Ints high = unaligned<Ints>(range.high.data()).value;
  const Longs even_least = bound_of(low) + kHalf;
  const Longs odd_least = bound_of(odd_lanes(low)) + kHalf;
  const Longs even_most = bound_of(high) + kHalf;
  const Longs odd_most = bound_of(odd_lanes(high)) + kHalf;
  Ints least_seen = unaligned<Ints>(range.least_seen.data()).value;
  Ints most_seen = unaligned<Ints>(range.most_seen.data()).value;
  Ints even_west = unaligned<Ints>(rows.own + (begin - 1) * kStep).value;
  Ints odd_west = odd_lanes(even_west);
  Ints even_far_west = unaligned<Ints>(rows.own + (begin - 2) * kStep).value;
  Ints odd_far_west = odd_lanes(even_far_west);
  for (int place = begin; place < end; ++place) {
    const std::ptrdiff_t at = place * kStep;
    Longs even = multiply<kIsWide>(even_far_west, weights[kFarWest].all) + kHalf;
    Longs odd = multiply<kIsWide>(odd_far_west, weights[kFarWest].of_odd) + kHalf;
#pragma GCC unroll 19
    for (std::size_t term = 0; term < kTerms.size(); ++term) {
      if (!is_summed_above(term, kIsNear)) continue;
      const Ints samples = unaligned<Ints>(rows.above(kTerms[term].row) + at + kTerms[term].place * kStep).value;
      even += multiply<kIsWide>(samples, weights[term].all);
      odd += multiply<kIsWide>(odd_lanes(samples), weights[term].of_odd);
    }
    const Words zigzagged = unaligned<Words>(rows.zigzagged + at).value;
    const Words residual = (zigzagged >> 1U) ^ -(zigzagged & 1U);  // sums modulo 2^32
    const auto of_even = [&](Words values) { return (Longs)values; };
    const auto of_odd = [&](Words values) { return (Longs)odd_lanes((Ints)values); };
    const auto outcomes_of = [&](const auto& half) {
      return Outcomes{half(residual), half(-residual), half((Words)low - residual), half((Words)high + residual)};
    };
    const Outcomes even_outcomes = outcomes_of(of_even);
    const Outcomes odd_outcomes = outcomes_of(of_odd);
    even += multiply<kIsWide>(even_west, weights[kWest].all);
    odd += multiply<kIsWide>(odd_west, weights[kWest].of_odd);
    const Longs even_own = restore_half<kIsWide>(even, even_least, even_most, even_outcomes);
    const Longs odd_own = restore_half<kIsWide>(odd, odd_least, odd_most, odd_outcomes);
    Ints own = __builtin_shufflevector((Ints)even_own, (Ints)((LongWords)odd_own << 32U), 0, 9, 2, 11, 4, 13, 6, 15);
    even_far_west = even_west;
    odd_far_west = odd_west;
    even_west = (Ints)even_own;
    odd_west = (Ints)odd_own;
    if constexpr (kWithVoids) {
      const Ints west = unaligned<Ints>(rows.own + at - kStep).value;
      const Ints north = unaligned<Ints>(rows.north + at).value;
      const Ints is_void = __builtin_convertvector(unaligned<Bytes>(rows.is_void + at).value, Ints);
      own = is_void != 0 ? (west & north) + ((west ^ north) >> 1) : own;  // the mean, without a carry
      even_west = own;
      odd_west = odd_lanes(own);
    }
    least_seen = own < least_seen ? own : least_seen;
    most_seen = own > most_seen ? own : most_seen;
    unaligned<Ints>(rows.own + at).value = own;
  }
  unaligned<Ints>(range.least_seen.data()).value = least_seen;
  unaligned<Ints>(range.most_seen.data()).value = most_seen;
}
/// The floats of eight places from `first` on, lane by lane: a transposed square.
ISOHF_KERNEL void turn_square(const std::int32_t* samples, const PerLane<std::int32_t>& dropped,
                              const PerLane<float*>& heights, int first) {
  using Pairs = std::uint64_t __attribute__((vector_size(4 * kLanes)));
  const Words shift = unaligned<Words>(dropped.data()).value;
  Words floats[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) {  // float_from_ordered
    const Ints ordered = unaligned<Ints>(samples + i * kLanes).value;
    floats[i] = ((Words)(ordered ^ (ordered >> 31)) << shift) | ((Words)ordered & 0x80000000U);
  }
  Pairs pairs[kLanes];  // of places, the first two lanes of each half and then the last two
  for (std::size_t i = 0; i < kLanes; i += 2) {
    pairs[i] = (Pairs)__builtin_shufflevector(floats[i], floats[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = (Pairs)__builtin_shufflevector(floats[i], floats[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const Pairs west[2] = {__builtin_shufflevector(pairs[i], pairs[i + 2], 0, 4, 2, 6),
                           __builtin_shufflevector(pairs[i], pairs[i + 2], 1, 5, 3, 7)};
    const Pairs east[2] = {__builtin_shufflevector(pairs[i + 4], pairs[i + 6], 0, 4, 2, 6),
                           __builtin_shufflevector(pairs[i + 4], pairs[i + 6], 1, 5, 3, 7)};
    for (std::size_t k = 0; k < 2; ++k) {
      const std::size_t lane = 2 * i + k;
      unaligned<Pairs>(heights[lane] + first).value = __builtin_shufflevector(west[k], east[k], 0, 1, 4, 5);
      unaligned<Pairs>(heights[lane + 4] + first).value = __builtin_shufflevector(west[k], east[k], 2, 3, 6, 7);
    }
  }
}

/// A sample of all lanes, in each of `count` places.
void repeat_sample(const std::int32_t* from, std::int32_t* out, int count) {
  PerLane<std::int32_t> sample{};
  std::copy_n(from, kLanes, sample.begin());
  for (int i = 0; i < count; ++i) std::copy(sample.begin(), sample.end(), out + i * kStep);
}

}  // namespace

BatchFloats::BatchFloats(const TileShape& shape) : columns_(shape.columns()), ring_(columns_), stretches_(columns_) {}

void BatchFloats::open(const PayloadHeader& header) {
  const std::size_t lane = stretches_.lanes();
  stretches_.open(header);
  ring_.fill(lane, header.base);
  range_.low[lane] = header.low;
  range_.high[lane] = header.high;
  dropped_[lane] = header.dropped_bits;
}

void BatchFloats::restore_row(int r, const BatchResiduals<std::uint32_t>& residuals) {
  const int first = Lattice<std::int64_t>::first(r);
  const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
  const Rows rows = ring_.around(r, residuals.zigzagged(), residuals.is_void());
  repeat_sample(rows.north + first * kStep, rows.own + (first - 2) * kStep, 2);
  stretches_.take_row(r, [](FloatStretch& weights, std::size_t lane, const PredictorWeights& of_lane, int anchor) {
    for (std::size_t term = 0; term < kTerms.size(); ++term) {
      weights[term].all[lane] = term < kWeightCount ? of_lane[term] : anchor;
      if (lane % 2 != 0) weights[term].of_odd[lane - 1] = weights[term].all[lane];
    }
  });
  range_.least_seen = range_.low;
  range_.most_seen = range_.high;
  stretches_.for_each(first, last, [&](const FloatStretch& weights, int begin, int end) {
    const auto restore = [&]<bool kIsNear, bool kWithVoids>() {
      vectorised<restore_places<false, kIsNear, kWithVoids>, restore_places<true, kIsNear, kWithVoids>>(
          rows, weights, begin, end, range_);
    };
    if (residuals.has_voids()) return restore.template operator()<false, true>();
    if (stretches_.is_wide()) return restore.template operator()<false, false>();
    restore.template operator()<true, false>();
  });
  repeat_sample(rows.own + first * kStep, rows.own - kBatchMargin * kStep, first + kBatchMargin);
  repeat_sample(rows.own + last * kStep, rows.own + (last + 1) * kStep, columns_ + kBatchMargin - last - 1);
}

void BatchFloats::write_row(int r, const PerLane<float*>& heights) const {
  const auto step = static_cast<int>(kLanes);
  const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
  int place = Lattice<std::int64_t>::first(r);
  for (; place + step <= last + 1; place += step)
    vectorised<turn_square>(ring_.row(r) + place * kStep, dropped_, heights, place);
  for (; place <= last; ++place) {
    for (std::size_t lane = 0; lane < stretches_.lanes(); ++lane)
      heights[lane][place] = stored(sample(r, place, lane), lane);
  }
}

}  // namespace isohf
