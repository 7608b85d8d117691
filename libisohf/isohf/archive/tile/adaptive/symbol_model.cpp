#include "isohf/archive/tile/adaptive/symbol_model.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr std::size_t kUsualTables = 1024;

/// Symbols 1 to 3 and the escape have a slot more, symbol 0 what the others leave.
SymbolTable table_of(std::array<std::uint32_t, kModelSymbols> frequencies) {
  for (const std::size_t s : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{kEscape}}) ++frequencies[s];
  frequencies[0] = kFrequencySum - std::accumulate(frequencies.begin() + 1, frequencies.end(), 0U);
  SymbolTable table;
  std::uint32_t start = 0;
  for (std::uint32_t s = 0; s < kModelSymbols; ++s) {
    table.starts[s] = static_cast<std::uint16_t>(start);
    start += frequencies[s];
  }
  return table;
}

/// What a class is thought to have before anything was counted: each symbol 2^-j times as often as the one before.
SymbolTable first_table(std::uint32_t of_class) {
  const std::uint32_t j = of_class >= 15 ? 1 : (17 - of_class) / 2;
  std::array<std::uint32_t, kModelSymbols> weights{};
  std::uint32_t sum = 0;
  for (std::uint32_t s = 0; s < kModelSymbols; ++s) sum += weights[s] = (32768U >> std::min(31U, s * j)) + 1;
  for (std::uint32_t& weight : weights) weight = weight * (kFrequencySum - 4) / sum;
  return table_of(weights);
}

using Half = std::uint32_t __attribute__((vector_size(32)));
using Eight = std::uint16_t __attribute__((vector_size(16)));
using Sixteen = std::uint16_t __attribute__((vector_size(32)));

ISOHF_KERNEL bool has_pending(const SymbolTable& table) {
  using Longs = std::uint64_t __attribute__((vector_size(32)));
  const Longs any = unaligned<Longs>(table.pending.data()).value;
  return (any[0] | any[1] | any[2] | any[3]) != 0;
}

/// Adds a table's pending counts.
ISOHF_KERNEL void add_pending(const SymbolTable& table, std::uint32_t* __restrict counts) {
  for (std::size_t i = 0; i < kModelSymbols; i += 8) {
    unaligned<Half>(counts + i).value +=
        __builtin_convertvector(unaligned<Eight>(table.pending.data() + i).value, Half);
  }
}

/// Counts and eight times what the parent expects become frequencies.
ISOHF_KERNEL void mix(const std::uint32_t* counts, const SymbolTable& parent, SymbolTable& table) {
  const Half seen[2] = {unaligned<Half>(counts).value, unaligned<Half>(counts + 8).value};
  Half all = seen[0] + seen[1];
  all += __builtin_shufflevector(all, all, 4, 5, 6, 7, 0, 1, 2, 3);
  all += __builtin_shufflevector(all, all, 2, 3, 0, 1, 6, 7, 4, 5);
  const std::uint32_t inverse = 0x7ff80000U / (all[0] + all[1] + 8);  // less than 2^31 parts: four slots are left
  // What the parent has: the start of the next symbol less its own.
  const Sixteen of_parent = unaligned<Sixteen>(parent.starts.data()).value;
  const Sixteen end = {kFrequencySum};
  const Sixteen parts =
      __builtin_shufflevector(of_parent, end, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16) - of_parent;
  const Eight expected[2] = {__builtin_shufflevector(parts, parts, 0, 1, 2, 3, 4, 5, 6, 7),
                             __builtin_shufflevector(parts, parts, 8, 9, 10, 11, 12, 13, 14, 15)};
  Eight halves[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const Half shares = ((seen[i] * inverse) >> (31U - kFrequencyBits)) +
                        ((__builtin_convertvector(expected[i], Half) * (inverse >> 12U)) >> 16U);
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
  Sixteen starts = ends - frequencies + static_cast<std::uint16_t>(kFrequencySum - ends[kModelSymbols - 1]);
  starts[0] = 0;
  unaligned<Sixteen>(table.starts.data()).value = starts;
  unaligned<Sixteen>(table.pending.data()).value = none;
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
    : tables_(kPlainContexts + 1),
      counts_(kPlainContexts + 1),
      parents_(kPlainContexts + 1),
      table_of_(kAllContexts + 1, kNoTable),
      pending_(kAllContexts + 1) {
  tables_.reserve(kUsualTables);
  counts_.reserve(kUsualTables);
  parents_.reserve(kUsualTables);
  std::copy(first_tables().begin(), first_tables().end(), tables_.begin());
  std::iota(table_of_.begin(), table_of_.begin() + kPlainContexts, std::uint16_t{0});
  table_of_[kNoContext] = kPlainContexts;
}

std::size_t SymbolModel::open_table(std::uint32_t context) {
  const std::size_t index = tables_.size();
  const std::uint32_t parent = parent_of(context);
  // Tables change when those of all pending contexts do: the parent's is this one's until then.
  tables_.push_back({tables_[parent].starts, {}});
  counts_.emplace_back();
  parents_.push_back(static_cast<std::uint16_t>(parent));
  table_of_[context] = static_cast<std::uint16_t>(index);
  return index;
}

ISOHF_KERNEL void SymbolModel::remake(SymbolModel& model) {
  SymbolTable* const tables = model.tables_.data();
  Counts* const counts = model.counts_.data();
  const std::uint16_t* const parents = model.parents_.data();
  std::array<bool, kPlainContexts> is_pending{};
  std::uint16_t* const children = model.pending_.data();
  std::size_t count = 0;
  for (std::size_t i = kPlainContexts + 1; i < model.tables_.size(); ++i) {
    if (!has_pending(tables[i])) continue;
    children[count++] = static_cast<std::uint16_t>(i);
    // What occurred with a pattern occurred without one.
    is_pending[parents[i]] = true;
    add_pending(tables[i], counts[i].data());
    add_pending(tables[i], counts[parents[i]].data());
  }
  for (std::size_t i = 0; i < kPlainContexts; ++i) {
    if (!is_pending[i] && !has_pending(tables[i])) continue;
    add_pending(tables[i], counts[i].data());
    mix(counts[i].data(), first_tables()[i], tables[i]);
  }
  for (std::size_t i = 0; i < count; ++i) {
    mix(counts[children[i]].data(), tables[parents[children[i]]], tables[children[i]]);
  }
}

void SymbolModel::carry(SymbolTable& table, std::uint32_t symbol) {
  const auto index = static_cast<std::size_t>(&table - tables_.data());
  table.pending[symbol] = 1;
  counts_[index][symbol] += 0xffff;
  if (index > kPlainContexts) counts_[parents_[index]][symbol] += 0xffff;
}

void SymbolModel::end_band() {
  if (is_due(++bands_)) vectorised<SymbolModel::remake>(*this);
}

}  // namespace isohf
