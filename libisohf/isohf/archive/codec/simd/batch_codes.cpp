#include "isohf/archive/codec/simd/batch_codes.h"

#include <algorithm>

#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/simd/sample_pairs.h"
#include "isohf/archive/codec/simd/vector_operations.h"

namespace isohf {
namespace {

constexpr std::size_t kLanes = kBatchLanes;
constexpr std::ptrdiff_t kStep = BatchRing::kStep;

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
  for (; place + step <= last + 1; place += step) vectorised<turn_square<kStep>>(samples + place * kStep, codes, place);
  for (; place <= last; ++place) {
    for (std::size_t lane = 0; lane < stretches_.lanes(); ++lane) {
      codes[lane][place] = static_cast<std::uint16_t>(sample(r, place, lane));
    }
  }
}

}  // namespace isohf
