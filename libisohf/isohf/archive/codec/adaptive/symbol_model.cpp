#include "isohf/archive/codec/adaptive/symbol_model.h"

#include <algorithm>
#include <bit>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

/// Symbols 1 to 3 and the escape have a slot more, symbol 0 what the others leave.
void complete(SymbolTable& table) {
  for (const std::size_t s : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{kEscape}}) {
    ++table.frequencies[s];
  }
  std::uint32_t others = 0;
  for (std::size_t s = 1; s < kModelSymbols; ++s) others += table.frequencies[s];
  table.frequencies[0] = static_cast<std::uint16_t>(kFrequencySum - others);
  std::uint32_t start = 0;
  for (std::size_t s = 0; s < kModelSymbols; ++s) {
    table.starts[s] = static_cast<std::uint16_t>(start);
    start += table.frequencies[s];
  }
}

/// What a class is thought to have before anything was counted: each symbol 2^-j times as often as the one before.
SymbolTable first_table(std::uint32_t of_class) {
  const std::uint32_t j = of_class >= 15 ? 1 : (17 - of_class) / 2;
  std::array<std::uint32_t, kModelSymbols> weights{};
  std::uint32_t sum = 0;
  for (std::uint32_t s = 0; s < kModelSymbols; ++s) sum += weights[s] = (32768U >> std::min(31U, s * j)) + 1;
  SymbolTable table;
  for (std::size_t s = 1; s < kModelSymbols; ++s) {
    table.frequencies[s] = static_cast<std::uint16_t>(weights[s] * (kFrequencySum - 4) / sum);
  }
  complete(table);
  return table;
}

/// Pending counts become counts; these and eight times what the parent expects become frequencies.
ISOHF_KERNEL void mix(std::uint32_t* __restrict counts, std::uint32_t* __restrict pending, std::uint32_t& all,
                      const SymbolTable& parent, SymbolTable& table) {
  using Half = std::uint32_t __attribute__((vector_size(32)));
  using Eight = std::uint16_t __attribute__((vector_size(16)));
  using Sixteen = std::uint16_t __attribute__((vector_size(32)));
  Half symbols[2];
  Half more{};
  for (std::size_t i = 0; i < 2; ++i) {
    auto& waiting = unaligned<Half>(pending + 8 * i);
    const Half now = waiting.value;
    more += now;
    symbols[i] = unaligned<Half>(counts + 8 * i).value + now;
    unaligned<Half>(counts + 8 * i).value = symbols[i];
    waiting.value = Half{};
  }
  more += __builtin_shufflevector(more, more, 4, 5, 6, 7, 0, 1, 2, 3);
  more += __builtin_shufflevector(more, more, 2, 3, 0, 1, 6, 7, 4, 5);
  all += more[0] + more[1];
  const std::uint32_t inverse = 0x7ff80000U / (all + 8);  // less than 2^31 parts, so that four slots are left
  Eight halves[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const Half expected = __builtin_convertvector(unaligned<Eight>(parent.frequencies.data() + 8 * i).value, Half);
    const Half shares = ((symbols[i] * inverse) >> (31U - kFrequencyBits)) + ((expected * (inverse >> 12U)) >> 16U);
    halves[i] = __builtin_convertvector(shares, Eight);
  }
  Sixteen frequencies =
      __builtin_shufflevector(halves[0], halves[1], 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  frequencies += Sixteen{0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  frequencies[0] = 0;
  const Sixteen none{};
  Sixteen ends = frequencies;
  ends += __builtin_shufflevector(none, ends, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30);
  ends += __builtin_shufflevector(none, ends, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29);
  ends += __builtin_shufflevector(none, ends, 0, 0, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27);
  ends += __builtin_shufflevector(none, ends, 0, 0, 0, 0, 0, 0, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23);
  const auto first = static_cast<std::uint16_t>(kFrequencySum - ends[kModelSymbols - 1]);
  Sixteen starts = ends - frequencies + first;
  starts[0] = 0;
  frequencies[0] = first;
  unaligned<Sixteen>(table.starts.data()).value = starts;
  unaligned<Sixteen>(table.frequencies.data()).value = frequencies;
}

constexpr bool is_due(std::uint32_t bands) {
  const int shift = static_cast<int>(std::bit_width(bands)) - 3;
  return shift <= 0 || (bands >> shift << shift) == bands;
}

/// What is known before anything was counted, by plain context.
const std::array<SymbolTable, kPlainContexts>& first_tables() {
  static const auto kTables = [] {
    std::array<SymbolTable, kPlainContexts> tables;
    for (std::uint32_t i = 0; i < kPlainContexts; ++i) {
      tables[i] = first_table(i < kSmoothContexts ? i / 4 : i - kSmoothContexts + kLastSmoothClass + 1);
    }
    return tables;
  }();
  return kTables;
}

}  // namespace

SymbolModel::SymbolModel()
    : rows_(kPlainContexts),
      counts_(kPlainContexts),
      is_pending_(kPlainContexts),
      row_of_(kAllContexts, kNoRow),
      pending_(kAllContexts + 1) {
  rows_.reserve(4 * kPlainContexts);
  counts_.reserve(4 * kPlainContexts);
  for (std::uint16_t i = 0; i < kPlainContexts; ++i) {
    rows_[i].table = first_tables()[i];
    counts_[i].context = i;
    row_of_[i] = i;
  }
}

std::uint32_t SymbolModel::open_row(std::uint32_t context) {
  const std::size_t index = rows_.size();
  // Tables change when those of all pending contexts do: the parent's is this one's until then.
  rows_.push_back({rows_[parent_of(context)].table, {}});
  counts_.emplace_back().context = context;
  is_pending_.push_back(0);
  row_of_[context] = static_cast<std::uint16_t>(index);
  return static_cast<std::uint32_t>(index);
}

void SymbolModel::remake(std::uint32_t index) {
  Row& row = rows_[index];
  Counts& counts = counts_[index];
  const SymbolTable& parent = index < kPlainContexts ? first_tables()[index] : rows_[parent_of(counts.context)].table;
  vectorised<mix>(counts.symbols.data(), row.pending.data(), counts.all, parent, row.table);
  is_pending_[index] = 0;
}

void SymbolModel::end_band() {
  if (!is_due(++bands_)) return;
  // What occurred with a pattern occurred without one. Parents come first, as what is expected of their children.
  const std::size_t occurred = pending_count_;
  for (std::size_t i = 0; i < occurred; ++i) {
    const std::uint16_t index = pending_[i];
    if (index < kPlainContexts) continue;
    const std::uint32_t parent = parent_of(counts_[index].context);
    for (std::size_t s = 0; s < kModelSymbols; ++s) rows_[parent].pending[s] += rows_[index].pending[s];
    add_to_pending(parent);
  }
  for (std::size_t i = 0; i < pending_count_; ++i) {
    if (pending_[i] < kPlainContexts) remake(pending_[i]);
  }
  for (std::size_t i = 0; i < pending_count_; ++i) {
    if (pending_[i] >= kPlainContexts) remake(pending_[i]);
  }
  pending_count_ = 0;
}

}  // namespace isohf
