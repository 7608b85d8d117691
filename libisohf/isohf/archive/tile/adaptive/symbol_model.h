#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isohf/archive/tile/adaptive/fine_prediction.h"
#include "isohf/base/simd.h"

namespace isohf {

inline constexpr unsigned kFrequencyBits = 14;
inline constexpr std::uint32_t kFrequencySum = 1U << kFrequencyBits;
inline constexpr std::size_t kModelSymbols = 16;
inline constexpr std::uint32_t kEscape = kModelSymbols - 1;  ///< the residual stands in the extra bits
inline constexpr unsigned kEscapeBits = 5;                   ///< of the number of bits after it

/// A context's symbols: where each begins among kFrequencySum slots, whose last ones are the escape's, and how often it
/// has occurred since tables were made and was not carried to the counts; 0 where it has not. A line of the cache: there
/// may be a thousand of them.
struct alignas(64) SymbolTable {
  std::array<std::uint16_t, kModelSymbols> starts{};
  std::array<std::uint16_t, kModelSymbols> pending{};

  /// Its slots; none for what only the escape can say.
  [[nodiscard]] std::uint32_t frequency(std::uint32_t symbol) const {
    return (symbol == kEscape ? kFrequencySum : starts[symbol + 1]) - starts[symbol];
  }
};

/// What symbols follow in which context, learnt from the bands of rows before (docs/archive_format.md, "Learning"):
/// encoder and decoder count alike. Integers only.
class SymbolModel {
 public:
  SymbolModel();

  static constexpr std::uint16_t kNoTable = 0xffff;
  /// A context of no sample, whose table may be written to.
  static constexpr std::uint32_t kNoContext = kAllContexts;

  /// Where all that is; until a table is opened.
  struct View {
    const std::uint16_t* table_of;
    SymbolTable* tables;
  };
  [[nodiscard]] View view() { return {table_of_.data(), tables_.data()}; }
  /// The table of a context in which a symbol occurs, opened where it is the first time. `at` is a view of this.
  [[nodiscard]] SymbolTable& opened(std::uint32_t context, View& at) {
    std::size_t index = at.table_of[context];
    if (index == kNoTable) [[unlikely]] {
      index = open_table(context);
      at = view();
    }
    return at.tables[index];
  }
  [[nodiscard]] SymbolTable& opened(std::uint32_t context) {
    View now = view();
    return opened(context, now);
  }
  /// Without opening one: what the context would start with.
  [[nodiscard]] const SymbolTable& table(std::uint32_t context) const {
    const std::uint32_t index = table_of_[context];
    return tables_[index == kNoTable ? parent_of(context) : index];
  }
  /// Counts a symbol; tables stay as they are.
  void count(SymbolTable& table, std::uint32_t symbol) {
    if (++table.pending[symbol] == 0) [[unlikely]] {
      carry(table, symbol);
    }
  }
  void count(std::uint32_t context, std::uint32_t symbol) { count(opened(context), symbol); }
  /// Where a symbol was counted 2^16 times.
  void carry(SymbolTable& table, std::uint32_t symbol);
  /// After each band: the tables of the contexts that occurred are made anew after 1 to 8 bands, 10, 12, 14, 16, 20, ...
  void end_band();

 private:
  using Counts = std::array<std::uint32_t, kModelSymbols>;

  std::size_t open_table(std::uint32_t context);
  ISOHF_KERNEL static void remake(SymbolModel& model);

  std::uint32_t bands_ = 0;
  std::vector<SymbolTable> tables_;      ///< of the plain contexts, of none, then of those that have come
  std::vector<Counts> counts_;           ///< likewise, of all symbols but the pending ones
  std::vector<std::uint16_t> parents_;   ///< likewise, the plain contexts that they belong to
  std::vector<std::uint16_t> table_of_;  ///< by context
  std::vector<std::uint16_t> pending_;   ///< scratch: tables to make anew
};

}  // namespace isohf
