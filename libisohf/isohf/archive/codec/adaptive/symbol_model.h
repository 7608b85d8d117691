#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isohf/archive/codec/adaptive/fine_prediction.h"

namespace isohf {

inline constexpr unsigned kFrequencyBits = 14;
inline constexpr std::uint32_t kFrequencySum = 1U << kFrequencyBits;
inline constexpr std::size_t kModelSymbols = 16;
inline constexpr std::uint32_t kEscape = kModelSymbols - 1;  ///< the residual stands in the extra bits
inline constexpr unsigned kEscapeBits = 5;                   ///< of the number of bits after it

/// A context's symbols: where each begins among kFrequencySum slots, and how many it has; none for what only the escape
/// can say.
struct alignas(64) SymbolTable {
  std::array<std::uint16_t, kModelSymbols> starts{};
  std::array<std::uint16_t, kModelSymbols> frequencies{};
};

/// What symbols follow in which context, learnt from the bands of rows before (docs/archive_format.md, "Learning"):
/// encoder and decoder count alike. Integers only.
class SymbolModel {
 public:
  SymbolModel();

  /// A context's table, and what is counted in it until tables are made anew.
  struct alignas(64) Row {
    SymbolTable table;
    std::array<std::uint32_t, kModelSymbols> pending{};
  };

  /// The row of a context, opened where it is the first time; until the next is.
  [[nodiscard]] Row& row(std::uint32_t context) {
    std::uint32_t index = row_of_[context];
    if (index == kNoRow) index = open_row(context);
    add_to_pending(index);
    return rows_[index];
  }
  /// Without opening one: what the context would start with.
  [[nodiscard]] const SymbolTable& table(std::uint32_t context) const {
    const std::uint32_t index = row_of_[context];
    return rows_[index == kNoRow ? parent_of(context) : index].table;
  }
  /// Counts a symbol; tables stay as they are.
  void count(std::uint32_t context, std::uint32_t symbol) { ++row(context).pending[symbol]; }
  /// After each band: the tables of the contexts that occurred are made anew after 1 to 8 bands, 10, 12, 14, 16, 20, ...
  void end_band();

 private:
  static constexpr std::uint16_t kNoRow = 0xffff;

  struct Counts {
    std::array<std::uint32_t, kModelSymbols> symbols{};
    std::uint32_t all = 0;
    std::uint32_t context = 0;
  };

  std::uint32_t open_row(std::uint32_t context);
  /// Once each, without a branch that nobody could foresee.
  void add_to_pending(std::uint32_t index) {
    pending_[pending_count_] = static_cast<std::uint16_t>(index);
    pending_count_ += 1U - is_pending_[index];
    is_pending_[index] = 1;
  }
  void remake(std::uint32_t index);

  std::uint32_t bands_ = 0;
  std::vector<Row> rows_;                 ///< of the plain contexts, then of those that have come
  std::vector<Counts> counts_;            ///< likewise
  std::vector<std::uint8_t> is_pending_;  ///< likewise
  std::vector<std::uint16_t> row_of_;     ///< by context
  std::vector<std::uint16_t> pending_;    ///< rows to make anew, the first pending_count_
  std::size_t pending_count_ = 0;
};

}  // namespace isohf
