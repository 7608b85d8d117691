#include "isohf/archive/tile/adaptive/adaptive_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "isohf/archive/tile/adaptive/adaptive_payload.h"
#include "isohf/archive/tile/adaptive/symbol_model.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, "tile payload: " + why);
}

/// Symbols from the states, in coding order; and what follows them in the extra bits.
class SymbolReader {
 public:
  explicit SymbolReader(const AdaptivePayload& payload)
      : states_(payload.states), words_(payload.words), extra_(payload.extra) {}

  std::uint32_t take(const SymbolTable& table, int row_in_band) {
    std::uint32_t& state = states_[static_cast<std::size_t>(row_in_band) % states_.size()];
    const std::uint32_t slot = state % kFrequencySum;
    std::uint32_t symbol = kEscape;
    while (table.starts[symbol] > slot) --symbol;
    state = table.frequency(symbol) * (state / kFrequencySum) + slot - table.starts[symbol];
    if (state < kFirstState) {
      if (next_word_ + 2 > words_.size()) refuse("it holds too few words");
      const auto word = load_little<std::uint16_t>(words_.data() + next_word_);
      next_word_ += sizeof(word);
      state = state << 16U | word;
    }
    return symbol;
  }

  /// The residual that a symbol begins.
  std::uint32_t complete(std::uint32_t symbol, std::uint32_t plain_bits) {
    if (symbol != kEscape) return symbol << plain_bits | extra_.take(plain_bits);
    const std::uint32_t bits = extra_.take(kEscapeBits);
    if (bits > 16) refuse(fmt::format("a residual has {} bits", bits + 1));
    const std::uint32_t residual = (1U << bits | extra_.take(bits)) - 1;
    if (residual > 0xffff) refuse(fmt::format("a residual is {}, the last is 65535", residual));
    return residual;
  }

  void check_used_up() const {
    if (next_word_ != words_.size()) refuse("it holds more words than its symbols ask for");
    if (std::any_of(states_.begin(), states_.end(), [](std::uint32_t state) { return state != kFirstState; })) {
      refuse("its states do not end where they began");
    }
    if (extra_.ran_out()) refuse("it holds too few extra bits");
    if (!extra_.is_used_up()) refuse("it holds more extra bits than its symbols ask for");
  }

 private:
  std::vector<std::uint32_t> states_;
  std::span<const std::byte> words_;
  std::size_t next_word_ = 0;
  BitReader extra_;
};

class AdaptiveDecoder {
 public:
  AdaptiveDecoder(const TileShape& shape, const AdaptivePayload& payload, TileCodes& tile)
      : payload_(payload),
        tile_(tile),
        columns_(shape.columns()),
        rows_(shape.rows()),
        lattice_(shape),
        deviations_(static_cast<std::size_t>(columns_ + 2 * kMargin) * static_cast<std::size_t>(rows_ + 2)),
        reader_(payload) {
    lattice_.fill_rows_above(payload.base);
  }

  void run() {
    for (int top = 0; top < rows_; top += kBandRows) {
      const int rows = std::min(kBandRows, rows_ - top);
      for (int t = 0; t < columns_ + kMostBandDelay; ++t) {
        for (int i = 0; i < rows; ++i) decode_place(top, i, t - delay_of_row(i));
      }
      for (int r = top; r < top + rows; r += 2) {
        for (int side = 0; side < 2; ++side) decode_slid(r, side);
      }
      model_.end_band();
    }
    reader_.check_used_up();
  }

 private:
  static constexpr int kMargin = 3;

  std::int32_t* deviations(int r) {
    return deviations_.data() + static_cast<std::ptrdiff_t>(r + 2) * (columns_ + 2 * kMargin) + kMargin;
  }
  [[nodiscard]] std::size_t at(int r, int column) const {
    return static_cast<std::size_t>(std::int64_t{r} * columns_ + column);
  }
  [[nodiscard]] bool is_void(int r, int column) const {
    return !payload_.is_void.empty() && payload_.is_void[at(r, column)] != 0;
  }
  void store(int r, int column, std::int32_t sample) {
    if (sample < payload_.low || sample > payload_.high) {
      refuse(fmt::format("row {} leaves the range {}..{} that the header states", r, payload_.low, payload_.high));
    }
    tile_.codes[at(r, column)] = static_cast<std::uint16_t>(sample);
  }

  void decode_place(int top, int row_in_band, int place) {
    const int r = top + row_in_band;
    const int first = Lattice<std::int32_t>::first(r);
    const int last = lattice_.last(r);
    if (place < first || place > last) return;
    if (place == first) lattice_.open_row(r);
    std::int32_t* const own = lattice_.row(r);
    std::int32_t* const off = deviations(r);
    const int column = column_of_place(columns_, r, place);
    if (is_void(r, column)) {
      own[place] = void_fill(own, lattice_.row(r - 1) + r % 2, place);
      off[place] = 0;
    } else {
      const Neighbours<std::int32_t> at(lattice_, r);
      const std::int32_t eighths = predict(at, payload_.predictors.of_row(r), place);
      const FinePrediction prediction(eighths);
      const std::uint32_t of_class = class_of(fine_energy(off, deviations(r - 1) + r % 2, deviations(r - 2), place));
      const std::uint32_t pattern = pattern_of(own[place - 1], at.north[place - 1], at.north[place + 1],
                                               at.north[place - 2], at.north[place], prediction.is_above);
      own[place] = take(prediction, of_class, pattern, row_in_band);
      off[place] = deviation(own[place], eighths);
      store(r, column, own[place]);
    }
    if (place == first + 1) close_west(r, first);
    if (place == last) close_east(r, last);
  }

  void close_west(int r, int first) {
    lattice_.close_west(r);
    std::fill_n(deviations(r) - kMargin, kMargin + first, deviations(r)[first]);
  }
  void close_east(int r, int last) {
    lattice_.close_east(r);
    std::fill_n(deviations(r) + last + 1, columns_ + kMargin - last - 1, deviations(r)[last]);
  }

  void decode_slid(int r, int side) {
    const int column = column_of_slid(columns_, side);
    if (is_void(r, column)) return;
    const int at = side == 0 ? 1 : columns_ - 3;
    const std::int32_t* const own = lattice_.row(r);
    const std::int32_t* const off = deviations(r);
    const std::uint32_t of_class = class_of(fine_energy_of_slid(off[at], off[at + 1]));
    store(r, column, take(FinePrediction(4 * (own[at] + own[at + 1])), of_class, kLevelPattern, r % kBandRows));
  }

  std::int32_t take(const FinePrediction& prediction, std::uint32_t of_class, std::uint32_t pattern, int row_in_band) {
    const std::uint32_t context = context_of(of_class, prediction.quarter, pattern);
    const std::uint32_t symbol = reader_.take(model_.table(context), row_in_band);
    model_.count(context, symbol);
    return prediction.sample_of(reader_.complete(symbol, plain_bits_of(of_class)));
  }

  /// In eighths, as predict_row_in_eighths has it; sums modulo 2^32.
  [[nodiscard]] std::int32_t predict(const Neighbours<std::int32_t>& at, const PredictorWeights& weights,
                                     int place) const {
    const std::int32_t ne = at.north[place];
    std::uint32_t sum = static_cast<std::uint32_t>(ne) << kWeightBits;
    const auto neighbours = at.of_all_weights();
    for (std::size_t i = 0; i < kWeightCount; ++i) {
      sum += static_cast<std::uint32_t>(int{weights[i]}) * static_cast<std::uint32_t>(neighbours[i][place] - ne);
    }
    return std::clamp(static_cast<std::int32_t>(sum) >> (kWeightBits - kEighthsBits), payload_.low << kEighthsBits,
                      payload_.high << kEighthsBits);
  }

  const AdaptivePayload& payload_;
  TileCodes& tile_;
  int columns_;
  int rows_;
  Lattice<std::int32_t> lattice_;
  std::vector<std::int32_t> deviations_;  ///< with margins and two rows above, zero
  SymbolReader reader_;
  SymbolModel model_;
};

}  // namespace

TileCodes decode_adaptive(const TileShape& shape, CodeType type, std::span<const std::byte> bytes) {
  const AdaptivePayload payload = read_adaptive_payload(shape, type, bytes);
  TileCodes tile = void_tile(shape, {type, 0.0, 1.0});
  AdaptiveDecoder(shape, payload, tile).run();
  return tile;
}

}  // namespace isohf
