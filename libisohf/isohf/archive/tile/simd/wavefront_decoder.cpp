#include "isohf/archive/tile/simd/wavefront_decoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

#include "isohf/archive/tile/adaptive/symbol_model.h"
#include "isohf/archive/tile/simd/slanted_rows.h"
#include "isohf/base/bytes.h"
#include "isohf/base/simd.h"
#if defined(ISOHF_HAS_WIDE_BUILTINS)
#include <immintrin.h>
#endif

namespace isohf {
namespace {

constexpr int kLanes = SlantedRows::kLanes;
constexpr std::size_t kSlack = 64;  ///< bytes that a step may read past words and extra bits

/// A symbol's start, 16 bits, and that of the one after it, or of the escape anything. Puts 2 + 2 times the symbol below
/// `symbols`, which are those of the lanes after this one.
template <bool kIsWide>
ISOHF_KERNEL std::uint32_t take_symbol(SymbolModel& model, SymbolModel::View& view, std::uint32_t context,
                                       const std::uint32_t& end, std::uint64_t& symbols) {
  SymbolTable& table = model.opened(context, view);
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  if constexpr (kIsWide) {
    using Shorts = short __attribute__((vector_size(32)));
    using Bytes = char __attribute__((vector_size(32)));
    const Shorts starts = unaligned<Shorts>(table.starts.data()).value;
    const Bytes begun = (Bytes)(Shorts{} + unaligned<short>(&end).value > starts);
    // Two bits, and two bytes, for each symbol that has begun.
    const auto bytes =
        static_cast<std::uint64_t>(__builtin_popcountll(static_cast<std::uint32_t>(__builtin_ia32_pmovmskb256(begun))));
    symbols = symbols << 8U | bytes;
    std::byte* const after = reinterpret_cast<std::byte*>(&table) + bytes;
    auto& pending = unaligned<std::uint16_t>(after + sizeof(table.starts) - sizeof(std::uint16_t));
    pending.value = static_cast<std::uint16_t>(pending.value + 1);
    if (pending.value == 0) [[unlikely]] {
      model.carry(table, static_cast<std::uint32_t>(bytes / 2 - 1));
    }
    return unaligned<std::uint32_t>(after - sizeof(std::uint16_t)).value;
  }
#endif
  std::uint32_t symbol = 0;
  for (std::size_t s = 1; s < kModelSymbols; ++s) symbol += table.starts[s] < end ? 1 : 0;
  symbols = symbols << 8U | (2 * symbol + 2);
  model.count(table, symbol);
  const std::uint32_t next = symbol == kEscape ? 0U : table.starts[symbol + 1];
  return table.starts[symbol] | next << 16U;
}

/// Eight numbers of 8 bits, as words.
template <bool kIsWide>
ISOHF_KERNEL Words from_bytes(const void* numbers) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  using Bytes = char __attribute__((vector_size(16)));
  using Two = long long __attribute__((vector_size(16)));
  if constexpr (kIsWide) return (Words)__builtin_ia32_pmovzxbd256((Bytes)Two{unaligned<long long>(numbers).value, 0});
#endif
  using Indices = std::uint8_t __attribute__((vector_size(8)));
  return __builtin_convertvector(unaligned<Indices>(numbers).value, Words);
}

/// For each set of lanes, which of the next words each of them takes.
constexpr auto kWordOfLane = [] {
  std::array<std::array<std::uint8_t, kLanes>, 1U << kLanes> words{};
  for (unsigned lanes = 0; lanes < words.size(); ++lanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      words[lanes][static_cast<std::size_t>(lane)] =
          static_cast<std::uint8_t>(std::popcount(lanes & ((1U << lane) - 1)));
    }
  }
  return words;
}();

/// Words and extra bits on their way.
struct Source {
  std::array<std::uint32_t, kLanes> states{};
  std::array<std::uint32_t, kLanes> ends{};  ///< of many states: the slot after each one's
  bool has_one_state = false;
  const std::byte* word;
  const std::byte* words_end;
  const std::byte* extra;
  std::uint64_t position = 0;
  std::uint64_t extra_end;

  /// The next symbol of a lane alone.
  std::uint32_t take(SymbolModel& model, SymbolModel::View& view, std::uint32_t context, std::size_t lane) {
    std::uint32_t& state = states[has_one_state ? 0 : lane];
    const std::uint32_t slot = state % kFrequencySum;
    SymbolTable& table = model.opened(context, view);
    std::uint32_t symbol = 0;
    if (slot >= table.starts[1]) {  // seldom where one state suffices
      while (symbol < kEscape && table.starts[symbol + 1] <= slot) ++symbol;
    }
    model.count(table, symbol);
    state = table.frequency(symbol) * (state / kFrequencySum) + slot - table.starts[symbol];
    if (state < kFirstState) {
      const auto more = load_little<std::uint16_t>(word);
      word += sizeof(more);
      state = state << 16U | more;
    }
    if (!has_one_state) ends[lane] = state % kFrequencySum + 1;
    return symbol;
  }
  /// The states after symbols with these starts and frequencies in each lane of `coded`.
  template <bool kIsWide>
  ISOHF_KERNEL void advance(Words starts, Words frequencies, Ints coded, Words slots) {
    const Words before = unaligned<Words>(states.data()).value;
    const Words next = frequencies * (before >> kFrequencyBits) + (before & slots) - starts;
    const Ints is_short = (Ints)(next >> 16U == 0) & coded;
    const unsigned lanes = lanes_of<kIsWide>(is_short);
    const Words ready = from_shorts<kIsWide>(word);
    const Words which = from_bytes<kIsWide>(kWordOfLane[lanes].data());
    Words more;
#if defined(ISOHF_HAS_WIDE_BUILTINS)
    if constexpr (kIsWide) {
      more = (Words)__builtin_ia32_permvarsi256((Ints)ready, (Ints)which);
    } else
#endif
    {
      for (int lane = 0; lane < kLanes; ++lane) more[lane] = ready[which[lane]];
    }
    const Words after = is_short != 0 ? next << 16U | more : next;
    const Words now = coded != 0 ? after : before;
    unaligned<Words>(states.data()).value = now;
    unaligned<Words>(ends.data()).value = (now & slots) + 1;
    word += sizeof(std::uint16_t) * static_cast<unsigned>(std::popcount(lanes));
  }
  ISOHF_KERNEL std::uint32_t bits(unsigned count) {
    const std::uint64_t value = load_little<std::uint64_t>(extra + position / 8) >> position % 8;
    position += count;
    return static_cast<std::uint32_t>(value & ((std::uint64_t{1} << count) - 1));
  }
  ISOHF_KERNEL std::uint32_t residual(std::uint32_t symbol, unsigned plain_bits) {
    if (symbol != kEscape) return symbol << plain_bits | bits(plain_bits);
    const std::uint32_t count = bits(kEscapeBits);
    const std::uint32_t value = (1U << (count & 31U) | bits(count & 31U)) - 1;
    if (value > 0xffff) position = extra_end + 1;  // broken
    return value;
  }
  [[nodiscard]] bool is_good() const {
    return word <= words_end && position <= extra_end;
  }
};

/// Numbers of a step that stand in memory, where nothing takes a register or is made anew for them.
struct LaneConstants {
  std::array<Words, kSlantedTerms.size()> weights{};
  Words shifts = Words{} + (std::uint32_t{kSampleShift} << kWeightBits);  ///< of samples, in a sum
  Ints least;                                                             ///< of predictions, in eighths
  Ints most;
  Ints low;  ///< of samples
  Ints high;
  Ints half = Ints{} + 4;
  Ints whole = Ints{} - 8;
  Words west_weights = Words{} + static_cast<std::uint32_t>(pair_of(9, 27));  ///< of NW and W in a pattern
  Words east_weights = Words{} + static_cast<std::uint32_t>(pair_of(3, 1));   ///< of NEE and NWW
  Ints least_class = Ints{} + 253;
  Words class_weights = Words{} + static_cast<std::uint32_t>(pair_of(4 * kPatterns, kPatterns));
  Ints smooth = Ints{} + static_cast<std::int32_t>(kPlainContexts + kLevelPattern);
  Ints rough = Ints{} + static_cast<std::int32_t>(kSmoothContexts) - static_cast<std::int32_t>(kLastSmoothClass) - 1;
  Ints last_smooth = Ints{} + static_cast<std::int32_t>(kLastSmoothClass);
  Ints first_plain = Ints{} + static_cast<std::int32_t>(kLastSmoothClass) + 1;
  Words one = Words{} + 1;
  Words escape = Words{} + kEscape;
  Ints sixteen_bits = Ints{} + 0xffff;
  Words slots = Words{} + (kFrequencySum - 1);
  Words all_slots = Words{} + kFrequencySum;
  Ints east_shift = Ints{} + std::numeric_limits<std::int32_t>::min();  ///< of the eastern sample of a pair
};

struct Band : SlantedBand {
  Source& source;
  SymbolModel& model;
  const LaneConstants& constants;
};

/// Places of the active lanes at a time. False where words or extra bits have run out.
template <bool kIsWide, bool kHasOneState>
ISOHF_KERNEL bool decode_time(const Band& band, SymbolModel& model, SymbolModel::View& view, Source& source,
                              SlantedRows::Time* now, int t, Ints active, bool is_full, Recent& recent) {
  if (!source.is_good()) return false;  // a time takes no more than there is room for behind words and extra bits
  using Shorts = short __attribute__((vector_size(32)));
  const LaneConstants& by = band.constants;
  const auto pairs = [&](int lane, int back) { return unaligned<Words>(&now[-back].pair(lane)).value; };
  const auto off = [&](int lane, int back) { return (Ints)from_shorts<kIsWide>(&now[-back].deviation(lane)); };

  Words sum = by.shifts;
#pragma GCC unroll 10
  for (std::size_t i = 0; i < kSlantedTerms.size() - kNearestPairs; ++i) {
    sum += multiply_pairs<kIsWide>(by.weights[i], pairs(kSlantedTerms[i].lane, kSlantedTerms[i].back));
  }
  sum += multiply_pairs<kIsWide>(by.weights[kSlantedTerms.size() - 2], (Words)recent.north);
  // As fine_energy has it.
  const Ints fours = off(-1, 3) + off(-1, 4) + off(-2, 7);
  const Ints twos = recent.off_north + off(-1, 5) + off(-2, 6) + off(-2, 8);
  const Ints ones = off(-1, 6) + off(-2, 5) + off(-2, 9);
  const Ints threes = off(-1, 2) + off(0, 2);
  const Ints energy = 4 * fours + 2 * twos + ones + 3 * (threes + 2 * recent.off);
  // As class_of has it.
  using Floats = float __attribute__((vector_size(32)));
  Ints of_class = ((Ints) __builtin_convertvector(energy, Floats) >> 22) - by.least_class;
  of_class = of_class < 0 ? Ints{} : of_class;
  // As pattern_of has it: of each neighbour whether it is above NE less whether it is below.
  const auto ne_nw = (Shorts)pairs(-1, 3);
  const auto own_west = (Shorts)recent.own;
  const auto north_east = (Shorts)recent.north;
  const auto north_west = (Shorts)pairs(-1, 5);
  const Shorts ne = __builtin_shufflevector(ne_nw, ne_nw, 1, 1, 3, 3, 5, 5, 7, 7, 9, 9, 11, 11, 13, 13, 15, 15);
  const auto beside = [](Shorts low_halves, Shorts high_halves) {
    return __builtin_shufflevector(low_halves, high_halves, 0, 17, 2, 19, 4, 21, 6, 23, 8, 25, 10, 27, 12, 29, 14, 31);
  };
  const auto compare = [&](Shorts with) { return (Words)((Shorts)(ne > with) - (Shorts)(with > ne)); };
  const Ints pattern = (Ints)(multiply_pairs<kIsWide>(compare(beside(north_east, north_west)), by.east_weights) +
                              multiply_pairs<kIsWide>(compare(beside(ne_nw, own_west)), by.west_weights));
  // As FinePrediction and context_of have it.
  Ints eighths = (Ints)(sum + multiply_pairs<kIsWide>(by.weights[kSlantedTerms.size() - 1], (Words)recent.own)) >>
                 (kWeightBits - kEighthsBits);
  eighths = eighths < by.least ? by.least : eighths;
  eighths = eighths > by.most ? by.most : eighths;
  const Ints code = (eighths + by.half) & by.whole;  // in eighths
  const Ints off_code = eighths - code;
  const Ints below = off_code >> 31;  // all ones where the code below is likelier
  const Ints quarter = off_code ^ below;
  const Ints turned = (pattern ^ below) - below;
  const Ints smooth =
      (Ints)multiply_pairs<kIsWide>((Words)(of_class | quarter << 16), by.class_weights) + turned + by.smooth;
  Ints contexts = of_class > by.last_smooth ? of_class + by.rough : smooth;

  Ints coded = active;
  if (!is_full) {
    if (band.is_void != nullptr) coded &= ~voids_at<kIsWide>(band, t);
    contexts = coded != 0 ? contexts : Ints{} + static_cast<std::int32_t>(SymbolModel::kNoContext);
  }
  alignas(32) std::array<std::uint32_t, kLanes> context_of_lane;
  unaligned<Ints>(context_of_lane.data()).value = contexts;
  Words zigzagged;
  if constexpr (kHasOneState) {
    alignas(32) std::array<std::uint32_t, kLanes> symbols{};
    for (unsigned lanes = lanes_of<kIsWide>(coded); lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
      symbols[lane] = source.take(model, view, context_of_lane[lane], lane);
    }
    zigzagged = unaligned<Words>(symbols.data()).value;
  } else {
    std::uint64_t symbols = 0;
    const auto take = [&](std::size_t lane) {
      return take_symbol<kIsWide>(model, view, context_of_lane[lane], source.ends[lane], symbols);
    };
    const std::uint32_t h = take(7), g = take(6), f = take(5), e = take(4);
    const std::uint32_t d = take(3), c = take(2), b = take(1), a = take(0);
    const Words slots = {a, b, c, d, e, f, g, h};
    zigzagged = (from_bytes<kIsWide>(&symbols) >> 1U) - by.one;
    const Words starts = slots & by.slots;
    const Words ends = zigzagged == by.escape ? by.all_slots : slots >> 16U;
    source.advance<kIsWide>(starts, ends - starts, coded, by.slots);
  }
  const unsigned longer = lanes_of<kIsWide>(((Ints)(zigzagged == by.escape) | (of_class > by.first_plain)) & coded);
  if (longer != 0) {
    alignas(32) std::array<std::uint32_t, kLanes> residuals;
    alignas(32) std::array<std::int32_t, kLanes> class_of_lane;
    unaligned<Words>(residuals.data()).value = zigzagged;
    unaligned<Ints>(class_of_lane.data()).value = of_class;
    for (unsigned lanes = longer; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
      residuals[lane] =
          source.residual(residuals[lane], plain_bits_of(static_cast<std::uint32_t>(class_of_lane[lane])));
    }
    zigzagged = unaligned<Words>(residuals.data()).value;
  }

  const Ints residual = (Ints)((zigzagged >> 1U) ^ -(zigzagged & by.one));
  const Ints plus = (residual ^ ~below) - ~below;  // less it where the code above is likelier
  Ints own = ((code >> kEighthsBits) + plus) & by.sixteen_bits;
  Ints deviations = (own << kEighthsBits) - eighths;
  deviations = deviations < 0 ? -deviations : deviations;
  deviations = deviations > by.sixteen_bits ? by.sixteen_bits : deviations;
  if (!is_full) {
    const Ints fill = ((recent.own >> 16) + ((Ints)ne_nw >> 16)) >> 1;
    own = coded != 0 ? own : fill + kSampleShift;
    own = active != 0 ? own : by.low;
    deviations &= coded;
  }
  recent.lowest = own < recent.lowest ? own : recent.lowest;
  recent.highest = own > recent.highest ? own : recent.highest;
  Ints kept = (Ints)((Words)recent.own >> 16U) | (own << 16 ^ by.east_shift);
  if (!is_full) {
    kept = active != 0 ? kept : unaligned<Ints>(&now->pair(0)).value;
    deviations = active != 0 ? deviations : off(0, 0);
  }
  const auto pairs_before = (Ints)pairs(-1, 0);
  const Ints deviations_before = off(-1, 0);
  unaligned<Ints>(&now->pair(0)).value = kept;
  unaligned<Eight>(&now->deviation(0)).value = __builtin_convertvector(deviations, Eight);
  recent.keep(kept, deviations, pairs_before, deviations_before);
  return true;
}

template <bool kIsWide, bool kHasOneState>
ISOHF_KERNEL bool decode_band(const Band& band) {
  SymbolModel::View view = band.model.view();
  SymbolModel& model = band.model;
  Source& source = band.source;
  Recent recent(band.constants.low, band.constants.high);
  const bool is_whole = walk_band<kIsWide>(band, recent, [&](SlantedRows::Time* now, int t, Ints active, bool is_full) {
    return decode_time<kIsWide, kHasOneState>(band, model, view, source, now, t, active, is_full, recent);
  });
  return is_whole && recent.is_within<kIsWide>(band.constants.low, band.constants.high);
}

class WavefrontDecoder {
 public:
  WavefrontDecoder(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile)
      : payload_(payload),
        tile_(tile),
        columns_(shape.columns()),
        rows_(shape.rows()),
        slanted_(columns_),
        band_codes_(columns_, payload.type),
        words_(payload.words.size() + kSlack),
        extra_(payload.extra.size() + kSlack) {
    std::copy(payload.words.begin(), payload.words.end(), words_.begin());
    std::copy(payload.extra.begin(), payload.extra.end(), extra_.begin());
    std::copy(payload.states.begin(), payload.states.end(), source_.states.begin());
    std::transform(source_.states.begin(), source_.states.end(), source_.ends.begin(),
                   [](std::uint32_t state) { return state % kFrequencySum + 1; });
    constants_.low = Ints{} + payload.low;
    constants_.high = Ints{} + payload.high;
    constants_.least = constants_.low << kEighthsBits;
    constants_.most = constants_.high << kEighthsBits;
    source_.has_one_state = payload.states.size() == 1;
    source_.word = words_.data();
    source_.words_end = words_.data() + payload.words.size();
    source_.extra = extra_.data();
    source_.extra_end = 8 * std::uint64_t{payload.extra.size()};
    slanted_.fill_above(columns_, payload.base);
  }

  bool run() {
    for (int top = 0; top < rows_; top += kBandRows) {
      const int rows = std::min(kBandRows, rows_ - top);
      if (top <= kBandRows) constants_.weights = slanted_weights(payload_.predictors, top);
      const std::uint8_t* const is_void = voids_of_band(payload_.is_void, top, rows, columns_);
      if (!decode({{slanted_, columns_, rows, is_void}, source_, model_, constants_}, top)) {
        return false;
      }
      model_.end_band();
      slanted_.next_band(columns_);
    }
    return is_used_up();
  }

 private:
  bool decode(const Band& band, int top) {
    const bool is_good = source_.has_one_state ? vectorised<decode_band<false, true>, decode_band<true, true>>(band)
                                               : vectorised<decode_band<false, false>, decode_band<true, false>>(band);
    if (!is_good) return false;
    band_codes_.store(band, tile_.codes.data() + static_cast<std::ptrdiff_t>(top) * columns_);
    for (int lane = 0; lane < band.rows; ++lane) {
      std::uint16_t* const codes = tile_.codes.data() + static_cast<std::ptrdiff_t>(top + lane) * columns_;
      for (int side = 0; lane % 2 == 0 && side < 2; ++side) {
        if (!decode_slid(band, lane, side, codes)) return false;
      }
    }
    return source_.is_good();
  }

  bool decode_slid(const Band& band, int lane, int side, std::uint16_t* codes) {
    const int column = column_of_slid(columns_, side);
    if (band.is_void != nullptr && band.is_void[static_cast<std::ptrdiff_t>(lane) * columns_ + column] != 0)
      return true;
    const int at = side == 0 ? 1 : columns_ - 3;
    const FinePrediction prediction(4 * (slanted_.sample(lane, at) + slanted_.sample(lane, at + 1)));
    const std::uint32_t of_class =
        class_of(fine_energy_of_slid(slanted_.deviation(lane, at), slanted_.deviation(lane, at + 1)));
    const std::uint32_t context = context_of(of_class, prediction.quarter, kLevelPattern);
    SymbolModel::View view = model_.view();
    const std::uint32_t symbol = source_.take(model_, view, context, static_cast<std::size_t>(lane));
    const std::int32_t sample = prediction.sample_of(source_.residual(symbol, plain_bits_of(of_class)));
    codes[column] = static_cast<std::uint16_t>(sample);
    return sample >= payload_.low && sample <= payload_.high;
  }

  [[nodiscard]] bool is_used_up() const {
    if (std::any_of(source_.states.begin(),
                    source_.states.begin() + static_cast<std::ptrdiff_t>(payload_.states.size()),
                    [](std::uint32_t state) { return state != kFirstState; })) {
      return false;
    }
    if (source_.word != source_.words_end || (source_.position + 7) / 8 != payload_.extra.size()) return false;
    return source_.position % 8 == 0 ||
           std::to_integer<unsigned>(payload_.extra[source_.position / 8]) >> (source_.position % 8) == 0;
  }

  const AdaptivePayload& payload_;
  TileCodes& tile_;
  int columns_;
  int rows_;
  SlantedRows slanted_;
  BandCodes band_codes_;
  std::vector<std::byte> words_;
  std::vector<std::byte> extra_;
  Source source_{};
  SymbolModel model_;
  LaneConstants constants_;
};

}  // namespace

bool decode_wavefront(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile) {
  return WavefrontDecoder(shape, payload, tile).run();
}

}  // namespace isohf
