#include "isohf/archive/tile/adaptive/adaptive_encoder.h"

#include <algorithm>
#include <array>
#include <bit>

#include "isohf/archive/tile/adaptive/symbol_model.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/residuals/bits.h"
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

/// A row's residuals and what they are coded with, by place; the last two are the slid vertices.
struct CodedRow {
  std::vector<std::uint16_t> residuals;
  std::vector<std::uint16_t> contexts;
  std::vector<std::uint8_t> plain_bits;
  std::vector<std::uint32_t> extra;  ///< extra bits above their number; with zeros around, as steps have
};
constexpr unsigned kExtraShift = 5;

class AdaptiveEncoder {
 public:
  AdaptiveEncoder(Lattice<std::int32_t>& lattice, AdaptivePayload& payload)
      : lattice_(lattice),
        payload_(payload),
        columns_(lattice.columns()),
        eighths_(static_cast<std::size_t>(columns_)),
        stride_(2 * kMostBandDelay + columns_ + 2),
        steps_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(bands() * kBandRows)),
        extra_(3 * static_cast<std::size_t>(columns_) * static_cast<std::size_t>(lattice.rows())) {
    for (auto& row : deviations_) row.resize(static_cast<std::size_t>(columns_) + 2 * kMargin);
    for (CodedRow& row : band_) {
      row.residuals.resize(static_cast<std::size_t>(columns_) + 2);
      row.contexts.resize(row.residuals.size());
      row.plain_bits.resize(row.residuals.size());
      row.extra.resize(static_cast<std::size_t>(stride_));
    }
  }

  std::vector<std::byte> run() {
    const int rows = lattice_.rows();
    for (int top = 0; top < rows; top += kBandRows) {
      const int count = std::min(kBandRows, rows - top);
      bool has_extra = false;
      for (int i = 0; i < count; ++i) {
        CodedRow& row = band_[static_cast<std::size_t>(i)];
        find_row(top + i, row);
        has_extra |= code_row(row, i, steps_of(top + i));
      }
      if (has_extra) put_extra(count);
      model_.end_band();
    }
    return finish();
  }

 private:
  [[nodiscard]] int bands() const { return (lattice_.rows() + kBandRows - 1) / kBandRows; }
  /// Those of a row's places, with zeros around as far as other rows of its band are ahead or behind.
  std::uint32_t* steps_of(int r) { return steps_.data() + static_cast<std::ptrdiff_t>(r) * stride_ + kMostBandDelay; }
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
      if (is_void(r, column_of_slid(columns_, static_cast<int>(side)))) row.contexts[slid_place(side)] = kNoContext;
    }
  }

  void find_slid(int r, std::size_t side, CodedRow& row) {
    const int at = side == 0 ? 1 : columns_ - 3;
    const std::int32_t* const own = lattice_.row(r);
    const std::int32_t* const off = deviations(r);
    const FinePrediction prediction(4 * (own[at] + own[at + 1]));
    const std::uint32_t of_class = class_of(fine_energy_of_slid(off[at], off[at + 1]));
    const std::size_t place = slid_place(side);
    row.residuals[place] = static_cast<std::uint16_t>(prediction.residual_of(lattice_.slid(r, static_cast<int>(side))));
    row.contexts[place] = static_cast<std::uint16_t>(context_of(of_class, prediction.quarter, kLevelPattern));
    row.plain_bits[place] = static_cast<std::uint8_t>(plain_bits_of(of_class));
  }
  [[nodiscard]] std::size_t slid_place(std::size_t side) const { return static_cast<std::size_t>(columns_) + side; }

  /// Finds the steps of a row, counts its symbols; true where some have extra bits.
  bool code_row(CodedRow& row, int row_in_band, std::uint32_t* steps) {
    const auto first = static_cast<std::size_t>(Lattice<std::int32_t>::first(row_in_band));
    const auto end = static_cast<std::size_t>(lattice_.last(row_in_band)) + 1;
    std::uint32_t* const extra = row.extra.data() + kMostBandDelay;
    bool has_extra = code_places(row, first, end, steps, extra);
    if (row_in_band % 2 == 0) {
      has_extra |= code_places(row, slid_place(0), slid_place(2), steps + kMostBandDelay, extra + kMostBandDelay);
    }
    return has_extra;
  }
  bool code_places(const CodedRow& coded, std::size_t begin, std::size_t end, std::uint32_t* steps,
                   std::uint32_t* extra_out) {
    std::uint32_t any = 0;
    for (std::size_t place = begin; place < end; ++place) {
      extra_out[place] = 0;
      if (coded.contexts[place] == kNoContext) continue;
      SymbolTable& table = model_.opened(coded.contexts[place]);
      const std::uint32_t residual = coded.residuals[place];
      const unsigned plain_bits = coded.plain_bits[place];
      std::uint32_t symbol = std::min(residual >> plain_bits, kEscape);
      if (table.frequency(symbol) == 0) symbol = kEscape;
      steps[place] = table.starts[symbol] | table.frequency(symbol) << kFrequencyBits;
      model_.count(table, symbol);
      std::uint32_t extra = (residual & ((1U << plain_bits) - 1)) << kExtraShift | plain_bits;
      if (symbol == kEscape) {
        const auto bits = static_cast<unsigned>(std::bit_width(residual + 1)) - 1;
        const std::uint32_t both = bits | ((residual + 1) & ((1U << bits) - 1)) << kEscapeBits;
        extra = both << kExtraShift | (kEscapeBits + bits);
      }
      extra_out[place] = extra;
      any |= extra;
    }
    return any != 0;
  }

  /// The extra bits of a band in coding order.
  void put_extra(int rows) {
    const auto put = [&](int i, int place) {
      const std::uint32_t extra =
          band_[static_cast<std::size_t>(i)].extra[static_cast<std::size_t>(place + kMostBandDelay)];
      if (extra != 0) extra_.put(extra >> kExtraShift, extra & ((1U << kExtraShift) - 1));
    };
    for (int t = 0; t < columns_ + kMostBandDelay; ++t) {
      for (int i = 0; i < rows; ++i) put(i, t - delay_of_row(i));
    }
    for (int i = 0; i < rows; i += 2) {
      put(i, columns_ + kMostBandDelay);
      put(i, columns_ + kMostBandDelay + 1);
    }
  }

  /// Runs the coder from the last step to the first, as a decoder runs from the first to the last. The words come to
  /// stand at the end of `words`; returns how many there are.
  template <std::size_t kStates>
  std::size_t run_coder(std::span<std::uint16_t> words) {
    std::array<std::uint32_t, kStates> states;
    states.fill(kFirstState);
    std::uint16_t* const end = words.data() + words.size();
    std::uint16_t* word = end;
    const auto take = [&](std::uint32_t step, int row_in_band) {
      if (step == 0) return;
      const std::uint32_t frequency = step >> kFrequencyBits;
      std::uint32_t& state = states[static_cast<std::size_t>(row_in_band) % kStates];
      std::uint32_t now = state;
      word[-1] = static_cast<std::uint16_t>(now);
      const bool is_full = now >> (32 - kFrequencyBits) >= frequency;
      word -= is_full ? 1 : 0;
      now = is_full ? now >> 16U : now;
      state = (now / frequency << kFrequencyBits) + now % frequency + step % kFrequencySum;
    };
    for (int band = bands() - 1; band >= 0; --band) {
      const std::uint32_t* const steps = steps_of(band * kBandRows);
      for (int i = kBandRows - 2; i >= 0; i -= 2) {
        take(steps[i * stride_ + columns_ + kMostBandDelay + 1], i);
        take(steps[i * stride_ + columns_ + kMostBandDelay], i);
      }
      for (int t = columns_ + kMostBandDelay - 1; t >= 0; --t) {
#pragma GCC unroll 8
        for (int i = kBandRows - 1; i >= 0; --i) {
          take(steps[i * stride_ + t - delay_of_row(i)], i);
        }
      }
    }
    payload_.states.assign(states.begin(), states.end());
    return static_cast<std::size_t>(end - word);
  }

  std::vector<std::byte> finish() {
    // A step takes no more than a word; the one before the first is written to as well.
    const std::size_t most = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(lattice_.rows()) + 1;
    Scratch<std::uint16_t> room(most);
    const std::span<std::uint16_t> words(room.data(), most);
    std::size_t count = run_coder<kMostStates>(words);
    if (count < kFewWords) count = run_coder<1>(words);
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
  int stride_;
  std::vector<std::uint32_t> steps_;
  BitPacker extra_;
};

}  // namespace

std::vector<std::byte> encode_adaptive(Lattice<std::int32_t>& lattice, AdaptivePayload payload) {
  return AdaptiveEncoder(lattice, payload).run();
}

}  // namespace isohf
