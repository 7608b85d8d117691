#include "isohf/archive/codec/simd/wavefront_decoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

#include "isohf/archive/codec/adaptive/symbol_model.h"
#include "isohf/archive/codec/predict/sample_lattice.h"
#include "isohf/archive/codec/simd/vector_operations.h"
#include "isohf/base/simd.h"
#if defined(ISOHF_HAS_WIDE_BUILTINS)
#include <immintrin.h>
#endif

namespace isohf {
namespace {

constexpr int kLanes = kBandRows;
constexpr int kMargin = 3;
constexpr int kRowsAbove = 3;
constexpr unsigned kAllLanes = 0xff;
constexpr std::size_t kSlack = 64;  ///< bytes that a step may read past words and extra bits

/// When place 0 of a lane's row is worked on; lanes below 0 are the rows above the band.
constexpr int delay(int lane) {
  return (7 * lane + 1) >> 1;
}

/// What the lanes have at each time: lane i's place t - delay(i) at time t, so that each neighbour of all lanes' samples
/// is one vector: of W the one a time before, of those on the row above the one a lane before, three times before.
class SlantedRows {
 public:
  explicit SlantedRows(int columns)
      : values_(kStride *
                static_cast<std::size_t>(columns + 2 * kMargin + delay(kLanes - 1) - delay(-kRowsAbove) + 2)) {}

  [[nodiscard]] std::int32_t* at(int lane, int time) {
    return values_.data() + kStride * static_cast<std::size_t>(time - kFirstTime) + kRowsAbove + lane;
  }
  [[nodiscard]] std::int32_t& of(int lane, int place) { return *at(lane, place + delay(lane)); }
  void fill(int lane, int begin, int end, std::int32_t value) {
    for (int place = begin; place < end; ++place) of(lane, place) = value;
  }
  /// The last rows become those above the next band.
  void next_band(int columns) {
    for (int lane = -kRowsAbove; lane < 0; ++lane) {
      for (int place = -kMargin; place < columns + kMargin; ++place) of(lane, place) = of(lane + kLanes, place);
    }
  }

 private:
  static constexpr std::size_t kStride = 16;
  static constexpr int kFirstTime = delay(-kRowsAbove) - kMargin;
  std::vector<std::int32_t> values_;
};

template <bool kIsWide>
ISOHF_KERNEL std::uint32_t symbol_at(const SymbolTable& table, std::uint32_t slot) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  if constexpr (kIsWide) {
    using Shorts = short __attribute__((vector_size(32)));
    using Bytes = char __attribute__((vector_size(32)));
    const Shorts starts = unaligned<Shorts>(table.starts.data()).value;
    const auto above =
        static_cast<std::uint32_t>(__builtin_ia32_pmovmskb256((Bytes)(starts > (Shorts{} + static_cast<short>(slot)))));
    return kEscape - static_cast<std::uint32_t>(__builtin_popcount(above)) / 2;
  }
#endif
  std::uint32_t symbol = 0;
  for (std::uint32_t s = 1; s < kModelSymbols; ++s) symbol += table.starts[s] <= slot ? 1 : 0;
  return symbol;
}

/// Words and extra bits on their way.
struct Source {
  std::array<std::uint32_t, kLanes> states{};
  unsigned state_mask = 0;
  const std::byte* word;
  const std::byte* words_end;
  const std::byte* extra;
  std::uint64_t position = 0;
  std::uint64_t extra_end;

  /// `next_word` is one's own copy, so that it stays in a register.
  template <bool kIsWide>
  ISOHF_KERNEL std::uint32_t take(const SymbolTable& table, unsigned lane, const std::byte*& next_word) {
    std::uint32_t& state = states[lane & state_mask];
    const std::uint32_t slot = state % kFrequencySum;
    const std::uint32_t symbol = symbol_at<kIsWide>(table, slot);
    const std::uint32_t next = table.frequencies[symbol] * (state / kFrequencySum) + slot - table.starts[symbol];
    std::uint16_t more;
    std::memcpy(&more, next_word, sizeof(more));
    const bool is_short = next < kFirstState;
    state = is_short ? next << 16U | more : next;
    next_word += is_short ? sizeof(more) : 0;
    return symbol;
  }
  ISOHF_KERNEL std::uint32_t bits(unsigned count) {
    std::uint64_t value;
    std::memcpy(&value, extra + position / 8, sizeof(value));
    value >>= position % 8;
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
  [[nodiscard]] bool is_good() const { return word <= words_end && position <= extra_end; }
};

using LaneWeights = std::array<Ints, kWeightCount + 1>;  ///< the last is NE's

struct Band {
  SlantedRows& samples;
  SlantedRows& deviations;
  Source& source;
  SymbolModel& model;
  const LaneWeights& weights;
  int columns;
  int rows;
  std::int32_t low;
  std::int32_t high;
  const std::uint8_t* is_void;  ///< of the band's first row; nullptr where nothing is
};

ISOHF_KERNEL bool is_any(Ints mask) {
  const LongWords any = (LongWords)mask;
  return (any[0] | any[1] | any[2] | any[3]) != 0;
}

ISOHF_KERNEL Ints compare(Ints a, Ints b) {
  return (Ints)(a < b) - (Ints)(a > b);
}

/// A lane's value beside those of the lanes before it.
ISOHF_KERNEL Ints one_lane_on(Ints values, std::int32_t first) {
  Ints on = __builtin_shufflevector(values, values, 0, 0, 1, 2, 3, 4, 5, 6);
  on[0] = first;
  return on;
}

/// What the last three times left, the latest first: a load that overlaps a store of just now would wait for it.
struct Recent {
  Ints own[2];
  Ints north[3];  ///< of lanes one before
  Ints off[2];
  Ints off_north[3];

  ISOHF_KERNEL void push(const Band& band, int t, Ints sample, Ints deviation) {
    own[1] = own[0];
    own[0] = sample;
    off[1] = off[0];
    off[0] = deviation;
    north[2] = north[1];
    north[1] = north[0];
    north[0] = one_lane_on(sample, *band.samples.at(-1, t));
    off_north[2] = off_north[1];
    off_north[1] = off_north[0];
    off_north[0] = one_lane_on(deviation, *band.deviations.at(-1, t));
  }
  /// After a row has been opened or closed before time t.
  ISOHF_KERNEL void reload(const Band& band, int t) {
    for (int back = 3; back > 0; --back) {
      push(band, t - back, unaligned<Ints>(band.samples.at(0, t - back)).value,
           unaligned<Ints>(band.deviations.at(0, t - back)).value);
    }
  }
};

/// Places of all lanes at a time.
template <bool kIsWide, std::size_t kTerms>
ISOHF_KERNEL bool decode_time(const Band& band, int t, unsigned active, Recent& recent) {
  const auto near = [&](int lane, int time) { return unaligned<Ints>(band.samples.at(lane, time)).value; };
  const auto off = [&](int lane, int time) { return unaligned<Ints>(band.deviations.at(lane, time)).value; };
  const Ints w = recent.own[0];
  const Ints ne = recent.north[2], nw = near(-1, t - 4), nee = recent.north[1], nww = near(-1, t - 5);
  const LaneWeights& by = band.weights;
  Words sum = (Words)by[kWeightCount] * (Words)ne;
  const auto add = [&](std::size_t weight, Ints sample) { sum += (Words)by[weight] * (Words)sample; };
  add(1, nw);
  add(3, nee);
  add(4, nww);
  add(5, near(-2, t - 7));
  add(6, near(-2, t - 6));
  add(7, near(-2, t - 8));
  add(8, near(-2, t - 5));
  add(9, near(-2, t - 9));
  add(10, near(-3, t - 10));
  add(11, near(-3, t - 11));
  if constexpr (kTerms == kWeightCount) {
    add(12, near(-3, t - 9));
    add(13, near(-3, t - 12));
    add(14, recent.north[0]);
    add(15, near(-1, t - 6));
    add(16, near(-2, t - 4));
    add(17, near(-2, t - 10));
  }
  const Ints* const north = recent.off_north;
  const Ints above = 4 * (north[2] + off(-1, t - 4) + off(-2, t - 7)) + 3 * north[1] +
                     2 * (north[0] + off(-1, t - 5) + off(-2, t - 6) + off(-2, t - 8)) + off(-1, t - 6) +
                     off(-2, t - 5) + off(-2, t - 9);
  const Ints energy = above + 3 * recent.off[1] + 6 * recent.off[0];
  add(2, recent.own[1]);
  add(0, w);

  // As FinePrediction, class_of, pattern_of and context_of have it.
  Ints eighths = (Ints)sum >> (kWeightBits - kEighthsBits);
  const Ints least = Ints{} + (band.low << kEighthsBits);
  const Ints most = Ints{} + (band.high << kEighthsBits);
  eighths = eighths < least ? least : eighths;
  eighths = eighths > most ? most : eighths;
  const Ints code = (eighths + 4) >> kEighthsBits;
  const Ints beside = eighths - (code << kEighthsBits);
  const Ints below = beside >> 31;  // all ones where the code below is likelier
  const Ints quarter = beside ^ below;
  using Floats = float __attribute__((vector_size(32)));
  Ints of_class = ((Ints) __builtin_convertvector(energy, Floats) >> 22) - 253;
  of_class = of_class < 0 ? Ints{} : of_class;
  const Ints pattern = 27 * compare(w, ne) + 9 * compare(nw, ne) + 3 * compare(nee, ne) + compare(nww, ne);
  const Ints turned = (pattern ^ below) - below;
  constexpr auto kSmooth = static_cast<std::int32_t>(kPlainContexts + kLevelPattern);
  constexpr auto kRough = static_cast<std::int32_t>(kSmoothContexts - kLastSmoothClass - 1);
  constexpr auto kLast = static_cast<std::int32_t>(kLastSmoothClass);
  const Ints smooth = (4 * of_class + quarter) * static_cast<std::int32_t>(kPatterns) + turned + kSmooth;
  const Ints contexts = of_class > kLast ? of_class + kRough : smooth;

  alignas(32) std::array<std::int32_t, kLanes> context_of_lane;
  alignas(32) std::array<std::int32_t, kLanes> class_of_lane;
  alignas(32) std::array<std::uint32_t, kLanes> residuals{};
  if (!band.source.is_good()) return false;  // a time takes no more than there is room for behind words and extra bits
  unaligned<Ints>(context_of_lane.data()).value = contexts;
  unsigned coded = active;
  Ints is_void = {};
  if (band.is_void != nullptr) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if ((active >> lane & 1U) == 0) continue;
      const int column = column_of_place(band.columns, lane, t - delay(lane));
      if (band.is_void[static_cast<std::ptrdiff_t>(lane) * band.columns + column] == 0) continue;
      coded &= ~(1U << lane);
      is_void[lane] = -1;
    }
  }
  const std::byte* next_word = band.source.word;
  const auto take = [&](unsigned lane) -> std::uint32_t {
    SymbolModel::Row& row = band.model.row(static_cast<std::uint32_t>(context_of_lane[lane]));
    const std::uint32_t symbol = band.source.take<kIsWide>(row.table, lane, next_word);
    ++row.pending[symbol];
    return symbol;
  };
  Words zigzagged;
  if (coded == kAllLanes) {
    const std::uint32_t a = take(0), b = take(1), c = take(2), d = take(3);
    const std::uint32_t e = take(4), f = take(5), g = take(6), h = take(7);
    zigzagged = Words{a, b, c, d, e, f, g, h};
  } else {
    for (unsigned lanes = coded; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<unsigned>(std::countr_zero(lanes));
      residuals[lane] = take(lane);
    }
    zigzagged = unaligned<Words>(residuals.data()).value;
  }
  band.source.word = next_word;
  if (is_any((Ints)(zigzagged == kEscape) | (Ints)(of_class > kLast + 1))) {
    unaligned<Words>(residuals.data()).value = zigzagged;
    unaligned<Ints>(class_of_lane.data()).value = of_class;
    for (unsigned lanes = coded; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<unsigned>(std::countr_zero(lanes));
      residuals[lane] =
          band.source.residual(residuals[lane], plain_bits_of(static_cast<std::uint32_t>(class_of_lane[lane])));
    }
    zigzagged = unaligned<Words>(residuals.data()).value;
  }

  const Ints residual = (Ints)((zigzagged >> 1U) ^ -(zigzagged & 1U));
  const Ints plus = (residual ^ ~below) - ~below;  // less it where the code above is likelier
  Ints own = (code + plus) & 0xffff;
  Ints deviations = (own << kEighthsBits) - eighths;
  deviations = deviations < 0 ? -deviations : deviations;
  deviations = deviations > kMaxDeviation ? Ints{} + kMaxDeviation : deviations;
  own = is_void != 0 ? (w + ne) >> 1 : own;
  deviations = is_void != 0 ? Ints{} : deviations;
  const Ints lanes = {1, 2, 4, 8, 16, 32, 64, 128};
  const Ints is_active = (lanes & static_cast<std::int32_t>(active)) != 0;
  const Ints is_out = is_active & ((own < band.low) | (own > band.high));
  auto& samples_now = unaligned<Ints>(band.samples.at(0, t));
  auto& deviations_now = unaligned<Ints>(band.deviations.at(0, t));
  if (active != kAllLanes) {
    own = is_active != 0 ? own : samples_now.value;
    deviations = is_active != 0 ? deviations : deviations_now.value;
  }
  samples_now.value = own;
  deviations_now.value = deviations;
  recent.push(band, t, own, deviations);
  return !is_any(is_out);
}

int first_of(int lane) {
  return Lattice<std::int32_t>::first(lane);
}
int last_of(int lane, int columns) {
  return lane % 2 == 0 ? columns - 2 : columns - 1;
}

/// Sets the margins of a row that begins, of one whose first two places are known, of one that is done.
void open_row(const Band& band, int lane) {
  const int first = first_of(lane);
  band.samples.fill(lane, first - 2, first, band.samples.of(lane - 1, first + lane % 2));
  band.deviations.fill(lane, first - 2, first, 0);
}
void close_west(const Band& band, int lane) {
  const int first = first_of(lane);
  band.samples.fill(lane, -kMargin, first, band.samples.of(lane, first));
  band.deviations.fill(lane, -kMargin, first, band.deviations.of(lane, first));
}
void close_east(const Band& band, int lane) {
  const int last = last_of(lane, band.columns);
  band.samples.fill(lane, last + 1, band.columns + kMargin, band.samples.of(lane, last));
  band.deviations.fill(lane, last + 1, band.columns + kMargin, band.deviations.of(lane, last));
}

template <bool kIsWide, std::size_t kTerms>
ISOHF_KERNEL bool decode_band(const Band& band) {
  Recent recent{};
  unsigned active = 0;
  // The next lanes to open, to close in the West and in the East: rows begin and end one after the other.
  int opening = 0;
  int west = 0;
  int east = 0;
  const int times = band.columns + delay(kLanes - 1);
  for (int t = 0; t < times; ++t) {
    bool is_changed = t == 0;
    if (opening < band.rows && t == first_of(opening) + delay(opening)) {
      open_row(band, opening);
      active |= 1U << opening++;
      is_changed = true;
    }
    if (is_changed) recent.reload(band, t);
    if (!decode_time<kIsWide, kTerms>(band, t, active, recent)) return false;
    is_changed = false;
    if (west < band.rows && t == first_of(west) + 1 + delay(west)) {
      close_west(band, west++);
      is_changed = true;
    }
    if (east < band.rows && t == last_of(east, band.columns) + delay(east)) {
      close_east(band, east);
      active &= ~(1U << east++);
      is_changed = true;
    }
    if (is_changed) recent.reload(band, t + 1);
  }
  return true;
}

class WavefrontDecoder {
 public:
  WavefrontDecoder(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile)
      : payload_(payload),
        tile_(tile),
        columns_(shape.columns()),
        rows_(shape.rows()),
        samples_(columns_),
        deviations_(columns_),
        words_(payload.words.size() + kSlack),
        extra_(payload.extra.size() + kSlack) {
    std::copy(payload.words.begin(), payload.words.end(), words_.begin());
    std::copy(payload.extra.begin(), payload.extra.end(), extra_.begin());
    std::copy(payload.states.begin(), payload.states.end(), source_.states.begin());
    source_.state_mask = static_cast<unsigned>(payload.states.size()) - 1;
    source_.word = words_.data();
    source_.words_end = words_.data() + payload.words.size();
    source_.extra = extra_.data();
    source_.extra_end = 8 * std::uint64_t{payload.extra.size()};
    for (int lane = -kRowsAbove; lane < 0; ++lane) samples_.fill(lane, -kMargin, columns_ + kMargin, payload.base);
  }

  bool run() {
    for (int top = 0; top < rows_; top += kBandRows) {
      const int rows = std::min(kBandRows, rows_ - top);
      if (top <= kBandRows) set_weights(top);
      const std::uint8_t* const is_void =
          payload_.is_void.empty() ? nullptr : payload_.is_void.data() + static_cast<std::ptrdiff_t>(top) * columns_;
      if (!decode(
              {samples_, deviations_, source_, model_, weights_, columns_, rows, payload_.low, payload_.high, is_void},
              top)) {
        return false;
      }
      model_.end_band();
      samples_.next_band(columns_);
      deviations_.next_band(columns_);
    }
    return is_used_up();
  }

 private:
  void set_weights(int top) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const PredictorWeights& of_row = payload_.predictors.of_block(top + lane, 0);
      std::int32_t anchor = 1 << kWeightBits;
      for (std::size_t i = 0; i < kWeightCount; ++i) {
        weights_[i][lane] = of_row[i];
        anchor -= of_row[i];
      }
      weights_[kWeightCount][lane] = anchor;
    }
  }

  bool decode(const Band& band, int top) {
    const bool is_good =
        payload_.predictors.is_wide
            ? vectorised<decode_band<false, kWeightCount>, decode_band<true, kWeightCount>>(band)
            : vectorised<decode_band<false, kNearWeightCount>, decode_band<true, kNearWeightCount>>(band);
    if (!is_good) return false;
    for (int lane = 0; lane < band.rows; ++lane) {
      std::uint16_t* const codes = tile_.codes.data() + static_cast<std::ptrdiff_t>(top + lane) * columns_;
      store_row(band, lane, codes);
      for (int side = 0; lane % 2 == 0 && side < 2; ++side) {
        if (!decode_slid(band, lane, side, codes)) return false;
      }
      if (band.is_void == nullptr) continue;
      const std::uint8_t* const is_void = band.is_void + static_cast<std::ptrdiff_t>(lane) * columns_;
      const auto void_code = static_cast<std::uint16_t>(Quantisation{payload_.type, 0.0, 1.0}.void_code());
      for (int c = 0; c < columns_; ++c) codes[c] = is_void[c] != 0 ? void_code : codes[c];
    }
    return source_.is_good();
  }

  void store_row(const Band& band, int lane, std::uint16_t* codes) {
    const int first = first_of(lane);
    const int last = last_of(lane, columns_);
    for (int p = first; p <= last; ++p) codes[p] = static_cast<std::uint16_t>(band.samples.of(lane, p));
    if (lane % 2 != 0) return;
    codes[0] = codes[first];
    codes[columns_ - 1] = codes[last];
  }

  bool decode_slid(const Band& band, int lane, int side, std::uint16_t* codes) {
    const int column = column_of_slid(columns_, side);
    if (band.is_void != nullptr && band.is_void[static_cast<std::ptrdiff_t>(lane) * columns_ + column] != 0)
      return true;
    const int at = side == 0 ? 1 : columns_ - 3;
    const FinePrediction prediction(4 * (samples_.of(lane, at) + samples_.of(lane, at + 1)));
    const std::uint32_t of_class =
        class_of(fine_energy_of_slid(deviations_.of(lane, at), deviations_.of(lane, at + 1)));
    const std::uint32_t context = context_of(of_class, prediction.quarter, kLevelPattern);
    const std::uint32_t symbol = source_.take<false>(model_.table(context), static_cast<unsigned>(lane), source_.word);
    model_.count(context, symbol);
    const std::int32_t sample = prediction.sample_of(source_.residual(symbol, plain_bits_of(of_class)));
    codes[column] = static_cast<std::uint16_t>(sample);
    return sample >= payload_.low && sample <= payload_.high;
  }

  [[nodiscard]] bool is_used_up() const {
    for (unsigned i = 0; i <= source_.state_mask; ++i) {
      if (source_.states[i] != kFirstState) return false;
    }
    if (source_.word != source_.words_end || (source_.position + 7) / 8 != payload_.extra.size()) return false;
    return source_.position % 8 == 0 ||
           std::to_integer<unsigned>(payload_.extra[source_.position / 8]) >> (source_.position % 8) == 0;
  }

  const AdaptivePayload& payload_;
  TileCodes& tile_;
  int columns_;
  int rows_;
  SlantedRows samples_;
  SlantedRows deviations_;
  std::vector<std::byte> words_;
  std::vector<std::byte> extra_;
  Source source_{};
  SymbolModel model_;
  LaneWeights weights_{};
};

}  // namespace

bool decode_wavefront(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile) {
  return WavefrontDecoder(shape, payload, tile).run();
}

}  // namespace isohf
