#include "isohf/archive/lane_decoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "isohf/archive/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

/// What a symbol stands for: base plus so many extra bits. Symbols that codes never have get a base beyond 16 bits.
struct SymbolTable {
  std::array<std::uint32_t, 256> base{};
  std::array<std::uint8_t, 256> extra_bits{};
};

constexpr std::uint32_t kNoSuchResidual = 1U << 16U;

constexpr SymbolTable make_symbol_table() {
  SymbolTable table;
  for (unsigned symbol = 0; symbol < 256; ++symbol) {
    const bool exists = symbol < symbol_limit(16);
    table.base[symbol] = exists ? folded_from(symbol, 0) : kNoSuchResidual;
    table.extra_bits[symbol] = static_cast<std::uint8_t>(exists ? extra_bits_of_symbol(symbol) : 0);
  }
  return table;
}
constexpr SymbolTable kSymbolTable = make_symbol_table();
constexpr unsigned kMaxExtraBits = 12;

ISOHF_VECTORISED(void, find_activities_above,
                 (const std::uint32_t* __restrict north, int first, int last, std::uint32_t* __restrict out),
                 (north, first, last, out)) {
  for (int place = first; place <= last; ++place) out[place] = activity_from_above(north, place);
}

ISOHF_VECTORISED(bool, all_within,
                 (const std::int32_t* samples, int first, int last, std::int32_t low, std::int32_t high),
                 (samples, first, last, low, high)) {
  std::int32_t outside = 0;
  for (int place = first; place <= last; ++place) outside |= (samples[place] < low) | (samples[place] > high);
  return outside == 0;
}

ISOHF_VECTORISED(void, narrow, (const std::int32_t* __restrict samples, int count, std::uint16_t* __restrict codes),
                 (samples, count, codes)) {
  for (int i = 0; i < count; ++i) codes[i] = static_cast<std::uint16_t>(samples[i]);
}

/// What each step of a lane uses. Steps work on a copy of it on the stack, which no store through a pointer can change,
/// so that the compiler may keep it in registers.
struct LaneState {
  std::int32_t* own = nullptr;
  std::uint32_t* current = nullptr;
  const std::int32_t* parts = nullptr;
  const std::uint32_t* above = nullptr;
  const std::uint8_t* contexts = nullptr;  ///< by level
  const std::byte* extra = nullptr;
  std::uint64_t position = 0;  ///< bits of `extra` taken
  unsigned shift = 0;
  std::int32_t low = 0;
  std::int32_t high = 0;
  std::uint32_t weight_w = 0;
  std::uint32_t weight_ww = 0;
  std::int32_t west = 0;
  std::int32_t far_west = 0;
  std::uint32_t folded_west = 0;
  std::uint32_t folded_far_west = 0;
  std::uint32_t all_folded = 0;  ///< or'ed
  bool ran_out = false;
  std::array<const std::byte*, kMaxContexts> next{};
  std::array<const std::byte*, kMaxContexts> end{};
};

[[gnu::always_inline]] inline std::uint32_t take(LaneState& lane, std::uint32_t activity) {
  const std::size_t context = lane.contexts[activity_level(activity, lane.shift)];
  const std::byte* const at = lane.next[context];
  if (at == lane.end[context]) {
    lane.ran_out = true;
    return 0;
  }
  lane.next[context] = at + 1;
  const auto symbol = std::to_integer<std::size_t>(*at);
  std::uint64_t bits;
  std::memcpy(&bits, lane.extra + lane.position / 8, sizeof(bits));
  bits >>= lane.position % 8;
  const unsigned count = kSymbolTable.extra_bits[symbol];
  lane.position += count;
  const std::uint32_t folded = kSymbolTable.base[symbol] + (static_cast<std::uint32_t>(bits) & ((1U << count) - 1));
  lane.all_folded |= folded;
  return folded;
}

/// Prediction plus residual, modulo 2^16.
[[gnu::always_inline]] inline std::int32_t unfold(std::int32_t prediction, std::uint32_t folded) {
  return static_cast<std::int32_t>((static_cast<std::uint32_t>(prediction) + unzigzag(folded)) & 0xffffU);
}

[[gnu::always_inline]] inline void step(LaneState& lane, int place) {
  const std::uint32_t folded = take(lane, lane.above[place] + 3 * lane.folded_west + lane.folded_far_west);
  lane.folded_far_west = lane.folded_west;
  lane.folded_west = folded;
  lane.current[place] = folded;
  const std::uint32_t sum = static_cast<std::uint32_t>(lane.parts[place]) +
                            lane.weight_ww * static_cast<std::uint32_t>(lane.far_west) +
                            lane.weight_w * static_cast<std::uint32_t>(lane.west);
  const std::int32_t predicted = static_cast<std::int32_t>(sum) >> kWeightBits;
  const std::int32_t raised = predicted < lane.low ? lane.low : predicted;
  const std::int32_t inside = raised > lane.high ? lane.high : raised;
  lane.far_west = lane.west;
  lane.west = unfold(inside, folded);
  lane.own[place] = lane.west;
}

/// One tile on its way. Samples of four rows, residuals of two; everything else goes straight to `codes`.
class Lane {
 public:
  explicit Lane(const TileShape& shape)
      : columns_(shape.columns()),
        stride_(shape.columns() + 4),
        samples_(4 * static_cast<std::size_t>(stride_)),
        parts_(static_cast<std::size_t>(shape.columns())),
        above_(static_cast<std::size_t>(shape.columns())),
        folded_(shape.columns()) {}

  /// False where the payload is not for this decoder.
  bool open(const TileShape& shape, CodeType type, std::span<const std::byte> payload, std::uint16_t* codes) {
    if (payload.size() > max_payload_bytes(shape, type)) return false;
    ByteReader reader(payload);
    header_ = read_payload_header(shape, type, reader);
    if (header_.has_voids || header_.is_constant || header_.mask_bytes != 0) return false;
    table_ = context_table(header_.thresholds);
    symbols_.emplace(header_, reader);
    for (std::size_t i = 0; i < header_.symbol_counts.size(); ++i) {
      const auto symbols = (*symbols_)[i];
      state.next[i] = symbols.data();
      state.end[i] = symbols.data() + symbols.size();
    }
    const auto extra = reader.read_bytes(header_.extra_bytes);
    if (reader.remaining() != 0) return false;
    // A row may read as far past the end as its bits can reach; what it finds there is zero, and told afterwards.
    const std::size_t spare = (static_cast<std::size_t>(columns_) + 2) * kMaxExtraBits / 8 + 16;
    extra_.assign(extra.size() + spare, std::byte{0});
    std::copy(extra.begin(), extra.end(), extra_.begin());
    extra_bits_ = 8 * std::uint64_t{extra.size()};
    state.parts = parts_.data();
    state.above = above_.data();
    state.contexts = table_.data();
    state.extra = extra_.data();
    state.shift = header_.activity_shift;
    state.low = header_.low;
    state.high = header_.high;
    codes_ = codes;
    std::fill(samples_.begin(), samples_.end(), header_.base);
    return true;
  }

  void open_row(int r) {
    row_ = r;
    first_ = r % 2 == 0 ? 1 : 0;
    last_ = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
    std::int32_t* const samples = row(r);
    const std::int32_t* const north = row(r - 1) + r % 2;
    samples[first_ - 1] = samples[first_ - 2] = north[first_];
    folded_.open_row(first_, r % 2);
    const PredictorWeights& weights = weights_of_row(header_.weights, r);
    predict_from_above({north, row(r - 2), row(r - 3) + r % 2}, first_, last_, weights, parts_.data());
    find_activities_above(folded_.above() + r % 2, first_, last_, above_.data());
    state.own = samples;
    state.current = folded_.current();
    state.weight_w = static_cast<std::uint32_t>(std::int32_t{weights[0]});
    state.weight_ww = static_cast<std::uint32_t>(std::int32_t{weights[2]});
    state.west = samples[first_ - 1];
    state.far_west = samples[first_ - 2];
    state.folded_west = state.current[first_ - 1];
    state.folded_far_west = state.current[first_ - 2];
  }

  /// Writes the row's codes; false where it was broken.
  bool close_row() {
    std::int32_t* const samples = state.own;
    std::uint16_t* const codes = codes_ + static_cast<std::ptrdiff_t>(row_) * columns_;
    bool is_good = all_within(samples, first_, last_, header_.low, header_.high);
    narrow(samples + first_, last_ + 1 - first_, codes + first_);
    if (row_ % 2 == 0) {
      codes[0] = codes[1];
      codes[columns_ - 1] = codes[columns_ - 2];
      for (int side = 0; side < 2; ++side) is_good &= take_slid(side, codes[column_of_slid(columns_, side)]);
    }
    for (int place = -2; place < first_; ++place) samples[place] = samples[first_];
    for (int place = last_ + 1; place < columns_ + 2; ++place) samples[place] = samples[last_];
    folded_.close_row(first_, last_);
    return is_good && !state.ran_out && state.all_folded < kNoSuchResidual && state.position <= extra_bits_;
  }

  /// True where every symbol and every extra bit was used.
  [[nodiscard]] bool is_used_up() const {
    for (std::size_t i = 0; i < header_.symbol_counts.size(); ++i) {
      if (state.next[i] != state.end[i]) return false;
    }
    const std::uint64_t position = state.position;
    if ((position + 7) / 8 != extra_bits_ / 8) return false;
    return position % 8 == 0 || (std::to_integer<unsigned>(extra_[position / 8]) >> (position % 8)) == 0;
  }

  LaneState state;

 private:
  [[nodiscard]] std::int32_t* row(int r) { return samples_.data() + static_cast<std::ptrdiff_t>(r & 3) * stride_ + 2; }

  bool take_slid(int side, std::uint16_t& code) {
    const int at = side == 0 ? 1 : columns_ - 3;
    const std::uint32_t folded = take(state, activity_of_slid(state.current[at], state.current[at + 1]));
    const std::int32_t sample = unfold((state.own[at] + state.own[at + 1]) >> 1, folded);
    code = static_cast<std::uint16_t>(sample);
    return sample >= header_.low && sample <= header_.high;
  }

  PayloadHeader header_;
  std::optional<SymbolStreams> symbols_;
  std::array<std::uint8_t, kActivityLimit> table_{};
  int columns_;
  int stride_;
  int row_ = 0;
  int first_ = 0;
  int last_ = 0;
  std::vector<std::int32_t> samples_;
  std::vector<std::int32_t> parts_;
  std::vector<std::uint32_t> above_;
  ResidualRows folded_;
  std::vector<std::byte> extra_;
  std::uint64_t extra_bits_ = 0;
  std::uint16_t* codes_ = nullptr;
};

using Lanes = std::array<Lane*, kDecoderLanes>;

template <std::size_t kCount>
[[gnu::always_inline]] inline void step_lanes(const Lanes& lanes, int first, int last) {
  std::array<LaneState, kCount> states;
  for (std::size_t i = 0; i < kCount; ++i) states[i] = lanes[i]->state;
  for (int place = first; place <= last; ++place) {
    for (LaneState& state : states) step(state, place);
  }
  for (std::size_t i = 0; i < kCount; ++i) lanes[i]->state = states[i];
}
// Only free functions can be cloned for several machines, not templates.
ISOHF_VECTORISED(void, step_one, (const Lanes& lanes, int first, int last), (lanes, first, last)) {
  step_lanes<1>(lanes, first, last);
}
ISOHF_VECTORISED(void, step_two, (const Lanes& lanes, int first, int last), (lanes, first, last)) {
  step_lanes<2>(lanes, first, last);
}
ISOHF_VECTORISED(void, step_three, (const Lanes& lanes, int first, int last), (lanes, first, last)) {
  step_lanes<3>(lanes, first, last);
}
ISOHF_VECTORISED(void, step_four, (const Lanes& lanes, int first, int last), (lanes, first, last)) {
  step_lanes<4>(lanes, first, last);
}

void step_all(const Lanes& lanes, std::size_t count, int first, int last) {
  switch (count) {
    case 1:
      return step_one(lanes, first, last);
    case 2:
      return step_two(lanes, first, last);
    case 3:
      return step_three(lanes, first, last);
    default:
      return step_four(lanes, first, last);
  }
}

}  // namespace

void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded) {
  ISOHF_ASSERT(payloads.size() <= kDecoderLanes && tiles.size() == payloads.size());
  std::fill(decoded.begin(), decoded.end(), false);
  if (type == CodeType::kF32) return;
  std::vector<std::unique_ptr<Lane>> lanes;
  Lanes active{};
  std::array<std::size_t, kDecoderLanes> tile_of{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    tiles[i] = {};
    tiles[i].type = type;
    tiles[i].codes.resize(static_cast<std::size_t>(shape.stored_vertex_count()));
    lanes.push_back(std::make_unique<Lane>(shape));
    try {
      if (!lanes.back()->open(shape, type, payloads[i], tiles[i].codes.data())) continue;
    } catch (const Error&) {
      continue;  // decode_tile says what is wrong
    }
    active[count] = lanes.back().get();
    tile_of[count++] = i;
  }
  for (int r = 0; r < shape.rows() && count > 0; ++r) {
    for (std::size_t i = 0; i < count; ++i) active[i]->open_row(r);
    step_all(active, count, r % 2 == 0 ? 1 : 0, shape.columns() - (r % 2 == 0 ? 2 : 1));
    for (std::size_t i = 0; i < count;) {
      if (active[i]->close_row()) {
        ++i;
      } else {
        --count;
        std::swap(active[i], active[count]);
        std::swap(tile_of[i], tile_of[count]);
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) decoded[tile_of[i]] = active[i]->is_used_up();
}

}  // namespace isohf
