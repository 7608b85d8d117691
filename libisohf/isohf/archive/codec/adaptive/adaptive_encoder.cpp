#include "isohf/archive/codec/adaptive/adaptive_encoder.h"

#include <algorithm>
#include <array>
#include <bit>

#include "isohf/archive/codec/adaptive/symbol_model.h"
#include "isohf/archive/codec/predict/hex_predictor.h"
#include "isohf/archive/codec/residuals/bits.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr std::uint16_t kNoContext = 0xffff;
constexpr int kMargin = 3;
constexpr std::size_t kFewWords = 600;  ///< below, seven states more would cost too much

ISOHF_KERNEL void find_deviations(const std::int32_t* own, const std::int32_t* eighths, int first, int last,
                                  std::int32_t* __restrict deviations, std::uint16_t* __restrict residuals) {
  for (int p = first; p <= last; ++p) {
    const FinePrediction prediction(eighths[p]);
    residuals[p] = static_cast<std::uint16_t>(prediction.residual_of(own[p]));
    deviations[p] = deviation(own[p], eighths[p]);
  }
}

/// class_of, by the exponent and the first bit of the mantissa of a float; below 2^24.
ISOHF_KERNEL std::uint32_t class_by_float(std::uint32_t energy) {
  const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(static_cast<std::int32_t>(energy)));
  const std::int32_t of_class = (bits >> 22) - 253;
  return static_cast<std::uint32_t>(of_class < 0 ? 0 : of_class);
}

struct ContextRows {
  const std::int32_t* own;
  const std::int32_t* north;
  const std::int32_t* eighths;
  const std::int32_t* off;
  const std::int32_t* off_north;
  const std::int32_t* off_far;
};

ISOHF_KERNEL void find_contexts(const ContextRows& rows, int first, int last, std::uint16_t* __restrict contexts,
                                std::uint8_t* __restrict plain_bits) {
  const ContextRows at = rows;
  for (int p = first; p <= last; ++p) {
    const std::uint32_t of_class = class_by_float(fine_energy(at.off, at.off_north, at.off_far, p));
    const FinePrediction prediction(at.eighths[p]);
    const std::uint32_t pattern =
        pattern_of(at.own[p - 1], at.north[p - 1], at.north[p + 1], at.north[p - 2], at.north[p], prediction.is_above);
    const std::uint32_t smooth = kPlainContexts + (4 * of_class + prediction.quarter) * kPatterns + pattern;
    const std::uint32_t rough = kSmoothContexts + of_class - kLastSmoothClass - 1;
    contexts[p] = static_cast<std::uint16_t>(of_class > kLastSmoothClass ? rough : smooth);
    plain_bits[p] = static_cast<std::uint8_t>(of_class > kLastSmoothClass ? (of_class - kLastSmoothClass) / 2 : 0);
  }
}

/// A row's residuals and what they are coded with, by place; slid vertices apart.
struct CodedRow {
  std::vector<std::uint16_t> residuals;
  std::vector<std::uint16_t> contexts;
  std::vector<std::uint8_t> plain_bits;
  std::array<std::uint16_t, 2> slid_residuals;
  std::array<std::uint16_t, 2> slid_contexts;
  std::array<std::uint8_t, 2> slid_plain_bits;
};

/// A step of the coder: first slot and number of slots of a symbol, and which state takes them, in one number.
constexpr unsigned kStateShift = 2 * kFrequencyBits + 1;
constexpr std::uint32_t step_of(const SymbolTable& table, std::uint32_t symbol, int row_in_band) {
  return table.starts[symbol] | std::uint32_t{table.frequencies[symbol]} << kFrequencyBits |
         static_cast<std::uint32_t>(row_in_band) << kStateShift;
}
constexpr std::uint32_t frequency_of(std::uint32_t step) {
  return step >> kFrequencyBits & (2 * kFrequencySum - 1);
}

class AdaptiveEncoder {
 public:
  AdaptiveEncoder(Lattice<std::int32_t>& lattice, AdaptivePayload& payload)
      : lattice_(lattice),
        payload_(payload),
        columns_(lattice.columns()),
        eighths_(static_cast<std::size_t>(columns_)),
        steps_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(lattice.rows())),
        extra_(3 * static_cast<std::size_t>(columns_) * static_cast<std::size_t>(lattice.rows())) {
    for (auto& row : deviations_) row.resize(static_cast<std::size_t>(columns_) + 2 * kMargin);
    for (CodedRow& row : band_) {
      row.residuals.resize(static_cast<std::size_t>(columns_));
      row.contexts.resize(row.residuals.size());
      row.plain_bits.resize(row.residuals.size());
    }
  }

  std::vector<std::byte> run() {
    const int rows = lattice_.rows();
    for (int top = 0; top < rows; top += kBandRows) {
      const int count = std::min(kBandRows, rows - top);
      for (int i = 0; i < count; ++i) find_row(top + i, band_[static_cast<std::size_t>(i)]);
      code_band(top, count);
      model_.end_band();
    }
    return finish();
  }

 private:
  std::int32_t* deviations(int r) { return deviations_[static_cast<std::size_t>(r % 3)].data() + kMargin; }
  [[nodiscard]] bool is_void(int r, int column) const {
    return payload_.is_void[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
                            static_cast<std::size_t>(column)] != 0;
  }

  void find_row(int r, CodedRow& row) {
    const int first = Lattice<std::int32_t>::first(r);
    const int last = lattice_.last(r);
    lattice_.open_row(r);
    predict_row_in_eighths(lattice_, r, payload_.predictors, payload_.low, payload_.high, eighths_);
    std::int32_t* const off = deviations(r);
    off[first - 1] = off[first - 2] = 0;
    vectorised<find_deviations>(lattice_.row(r), eighths_.data(), first, last, off, row.residuals.data());
    if (!payload_.is_void.empty()) {
      for (int p = first; p <= last; ++p) off[p] = is_void(r, column_of_place(columns_, r, p)) ? 0 : off[p];
    }
    const ContextRows rows = {lattice_.row(r),           lattice_.row(r - 1) + r % 2,
                              eighths_.data(),           off,
                              deviations(r + 2) + r % 2, deviations(r + 1)};
    vectorised<find_contexts>(rows, first, last, row.contexts.data(), row.plain_bits.data());
    lattice_.close_row(r);
    std::fill_n(off - kMargin, kMargin + first, off[first]);
    std::fill_n(off + last + 1, columns_ + kMargin - last - 1, off[last]);
    for (std::size_t side = 0; r % 2 == 0 && side < 2; ++side) find_slid(r, side, row);
    if (payload_.is_void.empty()) return;
    for (int p = first; p <= last; ++p) {
      if (is_void(r, column_of_place(columns_, r, p))) row.contexts[static_cast<std::size_t>(p)] = kNoContext;
    }
    for (std::size_t side = 0; r % 2 == 0 && side < 2; ++side) {
      if (is_void(r, column_of_slid(columns_, static_cast<int>(side)))) row.slid_contexts[side] = kNoContext;
    }
  }

  void find_slid(int r, std::size_t side, CodedRow& row) {
    const int at = side == 0 ? 1 : columns_ - 3;
    const std::int32_t* const own = lattice_.row(r);
    const std::int32_t* const off = deviations(r);
    const FinePrediction prediction(4 * (own[at] + own[at + 1]));
    const std::uint32_t of_class = class_of(fine_energy_of_slid(off[at], off[at + 1]));
    row.slid_residuals[side] =
        static_cast<std::uint16_t>(prediction.residual_of(lattice_.slid(r, static_cast<int>(side))));
    row.slid_contexts[side] = static_cast<std::uint16_t>(context_of(of_class, prediction.quarter, kLevelPattern));
    row.slid_plain_bits[side] = static_cast<std::uint8_t>(plain_bits_of(of_class));
  }

  void code_band(int top, int count) {
    for (int t = 0; t < columns_ + kMostBandDelay; ++t) {
      for (int i = 0; i < count; ++i) {
        const int place = t - delay_of_row(i);
        if (place < Lattice<std::int32_t>::first(i) || place > lattice_.last(top + i)) continue;
        const CodedRow& row = band_[static_cast<std::size_t>(i)];
        const auto at = static_cast<std::size_t>(place);
        code(i, row.residuals[at], row.contexts[at], row.plain_bits[at]);
      }
    }
    for (int i = 0; i < count; i += 2) {
      const CodedRow& row = band_[static_cast<std::size_t>(i)];
      for (std::size_t side = 0; side < 2; ++side) {
        code(i, row.slid_residuals[side], row.slid_contexts[side], row.slid_plain_bits[side]);
      }
    }
  }

  void code(int row_in_band, std::uint32_t residual, std::uint32_t context, unsigned plain_bits) {
    if (context == kNoContext) return;
    SymbolModel::Row& row = model_.row(context);
    std::uint32_t symbol = std::min(residual >> plain_bits, kEscape);
    if (row.table.frequencies[symbol] == 0) symbol = kEscape;
    *step_++ = step_of(row.table, symbol, row_in_band);
    ++row.pending[symbol];
    if (symbol == kEscape) {
      const auto bits = static_cast<unsigned>(std::bit_width(residual + 1)) - 1;
      extra_.put(bits | ((residual + 1) & ((1U << bits) - 1)) << kEscapeBits, kEscapeBits + bits);
    } else if (plain_bits != 0) {
      extra_.put(residual & ((1U << plain_bits) - 1), plain_bits);
    }
  }

  /// Runs the coder from the last step to the first, as a decoder runs from the first to the last. The words come to
  /// stand at the end of `words`; returns how many there are.
  std::size_t run_coder(std::size_t state_count, std::span<std::uint16_t> words) {
    std::array<std::uint32_t, kMostStates> states;
    states.fill(kFirstState);
    std::uint16_t* const end = words.data() + words.size();
    std::uint16_t* word = end;
    const std::size_t mask = state_count - 1;
    for (const std::uint32_t* step = step_; step != steps_.data();) {
      --step;
      const std::uint32_t frequency = frequency_of(*step);
      std::uint32_t& state = states[(*step >> kStateShift) & mask];
      std::uint32_t now = state;
      word[-1] = static_cast<std::uint16_t>(now);
      const bool is_full = now >> (32 - kFrequencyBits) >= frequency;
      word -= is_full ? 1 : 0;
      now = is_full ? now >> 16U : now;
      state = (now / frequency << kFrequencyBits) + now % frequency + *step % kFrequencySum;
    }
    payload_.states.assign(states.begin(), states.begin() + static_cast<std::ptrdiff_t>(state_count));
    return static_cast<std::size_t>(end - word);
  }

  std::vector<std::byte> finish() {
    // A step takes no more than a word; the one before the first is written to as well.
    Scratch<std::uint16_t> room(static_cast<std::size_t>(step_ - steps_.data()) + 1);
    const std::span<std::uint16_t> words(room.data(), static_cast<std::size_t>(step_ - steps_.data()) + 1);
    std::size_t count = run_coder(kMostStates, words);
    if (count < kFewWords) count = run_coder(1, words);
    std::vector<std::byte> bytes;
    write_adaptive_payload(payload_, words.last(count), extra_.finish(), bytes);
    return bytes;
  }

  Lattice<std::int32_t>& lattice_;
  AdaptivePayload& payload_;
  int columns_;
  std::vector<std::int32_t> eighths_;
  std::array<std::vector<std::int32_t>, 3> deviations_;
  std::array<CodedRow, kBandRows> band_{};
  SymbolModel model_;
  Scratch<std::uint32_t> steps_;
  std::uint32_t* step_ = steps_.data();
  BitPacker extra_;
};

}  // namespace

std::vector<std::byte> encode_adaptive(Lattice<std::int32_t>& lattice, AdaptivePayload payload) {
  return AdaptiveEncoder(lattice, payload).run();
}

}  // namespace isohf
