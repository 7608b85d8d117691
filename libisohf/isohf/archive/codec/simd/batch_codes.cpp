#include "isohf/archive/codec/simd/batch_codes.h"

#include <algorithm>

#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/simd/vector_operations.h"

namespace isohf {
namespace {

constexpr std::size_t kLanes = kBatchLanes;
constexpr std::ptrdiff_t kStep = BatchRing::kStep;

/// A sample less 2^15, so that it fits 16 bits with a sign. Weights add up to 2^12, hence the sum of weighted samples
/// is that of the shifted ones and 2^27.
constexpr std::int32_t kSampleShift = 1 << 15;

/// Two neighbouring samples, shifted, of each lane: that of the place in the low half, that East of it in the high
/// half. One multiplication by a pair of weights does for both.
constexpr std::int32_t pair_of(std::int32_t west, std::int32_t east) {
  return static_cast<std::int32_t>((static_cast<std::uint32_t>(west) & 0xffffU) | static_cast<std::uint32_t>(east)
                                                                                      << 16U);
}

constexpr int kAnchor = static_cast<int>(kWeightCount);  // NE's weight
/// A pair of terms: the place of its western sample from the predicted one, on which row, and the weights of both; a
/// negative one for none.
struct TermPair {
  BatchRow row;
  int place;
  int west;
  int east;
};
constexpr std::size_t kNearPairs = 8;
constexpr std::array<TermPair, kTermPairCount> kTermPairs = {{
    {BatchRow::kOwn, -2, 2, 0},
    {BatchRow::kNorth, -1, 1, kAnchor},
    {BatchRow::kNorth, 1, 3, 14},
    {BatchRow::kNorth, -3, 15, 4},
    {BatchRow::kFar, -1, 7, 5},
    {BatchRow::kFar, 1, 6, 8},
    {BatchRow::kFar, -3, 17, 9},
    {BatchRow::kFarther, -1, 11, 10},
    {BatchRow::kFar, 3, 16, -1},
    {BatchRow::kFarther, 1, 12, -1},
    {BatchRow::kFarther, -2, 13, -1},
}};

using Rows = BatchRows<std::uint16_t>;
using Shorts = std::uint16_t __attribute__((vector_size(2 * kLanes)));

/// Predictions completed by residuals, from West to East. What each place waits for is kept short: it is all that a row
/// takes. Sums modulo 2^32, as the plain decoder has them. Writes the pair West of each sample, and not the last
/// sample's own.
template <bool kIsWide, std::size_t kPairs, bool kWithVoids>
ISOHF_KERNEL void restore_places(const Rows& rows, const StretchWeights& weights, int begin, int end,
                                 BatchRange& range) {
  using Bytes = std::int8_t __attribute__((vector_size(kLanes)));
  const Ints low = unaligned<Ints>(range.low.data()).value;
  const Ints high = unaligned<Ints>(range.high.data()).value;
  const Ints least = 2 * low;
  const Ints most = 2 * high - 1;
  Ints least_seen = unaligned<Ints>(range.least_seen.data()).value;
  Ints most_seen = unaligned<Ints>(range.most_seen.data()).value;
  const Words west_weights = unaligned<Words>(weights[0].data()).value;
  Words west_pair = unaligned<Words>(rows.own + (begin - 2) * kStep).value;
  for (int place = begin; place < end; ++place) {
    const std::ptrdiff_t at = place * kStep;
    Words above = {};
    for (std::size_t pair = 1; pair < kPairs; ++pair) {
      const TermPair term = kTermPairs[pair];
      above += multiply_pairs<kIsWide>(unaligned<Words>(rows.above(term.row) + at + term.place * kStep).value,
                                       unaligned<Words>(weights[pair].data()).value);
    }
    const Words zigzagged = __builtin_convertvector(unaligned<Shorts>(rows.zigzagged + at).value, Words);
    const Ints residual = (Ints)((zigzagged >> 1U) ^ -(zigzagged & 1U));
    const Words sum = above + multiply_pairs<kIsWide>(west_pair, west_weights);
    // Shifted samples are predicted as samples are: 2^27 more in the sum are 2^16 more in the halves, an even number.
    Ints halves = (Ints)sum >> (kWeightBits - 1);
    halves = halves < least ? least : halves;
    halves = halves > most ? most : halves;
    Words high_half =
        (Words)(((halves + 1) >> 1) + choose_by_sign<kIsWide>((Ints)((Words)halves << 31U), residual, -residual))
        << 16U;
    Ints own = (Ints)high_half >> 16;
    if constexpr (kWithVoids) {
      const Ints north = (Ints)(unaligned<Words>(rows.north + at).value << 16U) >> 16;
      const Ints is_void = __builtin_convertvector(unaligned<Bytes>(rows.is_void + at).value, Ints);
      own = is_void != 0 ? (((Ints)west_pair >> 16) + north) >> 1 : own;
      high_half = (Words)own << 16U;
    }
    least_seen = own < least_seen ? own : least_seen;
    most_seen = own > most_seen ? own : most_seen;
    west_pair = west_pair >> 16U | high_half;
    unaligned<Words>(rows.own + at - kStep).value = west_pair;
  }
  unaligned<Ints>(range.least_seen.data()).value = least_seen;
  unaligned<Ints>(range.most_seen.data()).value = most_seen;
}

/// The samples of eight places from first on, lane by lane: the pairs of every other place, a transposed square.
ISOHF_KERNEL void turn_square(const std::int32_t* samples, const PerLane<std::uint16_t*>& codes, int first) {
  using Long = std::uint64_t __attribute__((vector_size(8 * kLanes / 2)));
  using Quad = std::uint32_t __attribute__((vector_size(16)));
  Words pairs[4];
  for (std::size_t i = 0; i < 4; ++i) {
    pairs[i] = unaligned<Words>(samples + 2 * i * kLanes).value ^ 0x80008000U;
  }
  // Within each half of the lanes: rows of four lanes become columns.
  const Long a = (Long)__builtin_shufflevector(pairs[0], pairs[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Long b = (Long)__builtin_shufflevector(pairs[0], pairs[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Long c = (Long)__builtin_shufflevector(pairs[2], pairs[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Long d = (Long)__builtin_shufflevector(pairs[2], pairs[3], 2, 10, 3, 11, 6, 14, 7, 15);
  const Words turned[4] = {
      (Words)__builtin_shufflevector(a, c, 0, 4, 2, 6), (Words)__builtin_shufflevector(a, c, 1, 5, 3, 7),
      (Words)__builtin_shufflevector(b, d, 0, 4, 2, 6), (Words)__builtin_shufflevector(b, d, 1, 5, 3, 7)};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    unaligned<Quad>(codes[lane] + first).value = __builtin_shufflevector(turned[lane], turned[lane], 0, 1, 2, 3);
    unaligned<Quad>(codes[lane + 4] + first).value = __builtin_shufflevector(turned[lane], turned[lane], 4, 5, 6, 7);
  }
}

/// A sample that a pair of all lanes holds, its eastern one or the other, twice in each of `count` pairs.
void repeat_sample(const std::int32_t* pairs, bool is_eastern, std::int32_t* out, int count) {
  PerLane<std::int32_t> twice{};
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::int32_t sample = is_eastern ? pairs[lane] >> 16 : pairs[lane];
    twice[lane] = pair_of(sample, sample);
  }
  for (int i = 0; i < count; ++i) std::copy(twice.begin(), twice.end(), out + i * kStep);
}

/// The code of one lane's sample.
std::int32_t code_of(std::int32_t pair) {
  return (pair & 0xffff) ^ kSampleShift;
}

}  // namespace

BatchCodes::BatchCodes(const TileShape& shape) : columns_(shape.columns()), ring_(columns_), stretches_(columns_) {}

void BatchCodes::open(const PayloadHeader& header) {
  const std::size_t lane = stretches_.lanes();
  stretches_.open(header);
  const std::int32_t base = header.base - kSampleShift;
  ring_.fill(lane, pair_of(base, base));
  range_.low[lane] = header.low - kSampleShift;
  range_.high[lane] = header.high - kSampleShift;
}

void BatchCodes::restore_row(int r, const BatchResiduals<std::uint16_t>& residuals) {
  const int first = Lattice<std::int32_t>::first(r);
  const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
  const Rows rows = ring_.around(r, residuals.zigzagged(), residuals.is_void());
  repeat_sample(rows.north + first * kStep, false, rows.own + (first - 2) * kStep, 1);
  stretches_.take_row(r, [](StretchWeights& weights, std::size_t lane, const PredictorWeights& of_lane, int anchor) {
    const auto weight_of = [&](int i) -> std::int32_t {
      return i < 0 ? 0 : i == kAnchor ? anchor : of_lane[static_cast<std::size_t>(i)];
    };
    for (std::size_t pair = 0; pair < kTermPairs.size(); ++pair) {
      weights[pair][lane] = pair_of(weight_of(kTermPairs[pair].west), weight_of(kTermPairs[pair].east));
    }
  });
  range_.least_seen = range_.low;
  range_.most_seen = range_.high;
  stretches_.for_each(first, last, [&](const StretchWeights& weights, int begin, int end) {
    const auto restore = [&]<std::size_t kPairs, bool kWithVoids>() {
      vectorised<restore_places<false, kPairs, kWithVoids>, restore_places<true, kPairs, kWithVoids>>(
          rows, weights, begin, end, range_);
    };
    if (residuals.has_voids()) return restore.template operator()<kTermPairCount, true>();
    if (stretches_.is_wide()) return restore.template operator()<kTermPairCount, false>();
    restore.template operator()<kNearPairs, false>();
  });
  repeat_sample(rows.own + first * kStep, false, rows.own - kBatchMargin * kStep, first + kBatchMargin);
  repeat_sample(rows.own + (last - 1) * kStep, true, rows.own + last * kStep, columns_ + kBatchMargin - last);
}

std::int32_t BatchCodes::sample(int r, int place, std::size_t lane) const {
  return code_of(ring_.row(r)[place * kStep + static_cast<std::ptrdiff_t>(lane)]);
}

void BatchCodes::write_row(int r, const PerLane<std::uint16_t*>& codes) const {
  const std::int32_t* const samples = ring_.row(r);
  const auto step = static_cast<int>(kLanes);
  const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
  int place = Lattice<std::int32_t>::first(r);
  for (; place + step <= last + 1; place += step) vectorised<turn_square>(samples + place * kStep, codes, place);
  for (; place <= last; ++place) {
    for (std::size_t lane = 0; lane < stretches_.lanes(); ++lane) {
      codes[lane][place] = static_cast<std::uint16_t>(sample(r, place, lane));
    }
  }
}

}  // namespace isohf
