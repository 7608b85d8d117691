#include "isohf/archive/residual_expander.h"

#include <array>
#include <cstring>

#include "isohf/archive/tile_payload.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

constexpr std::uint32_t kNoSuchSymbol = 1U << 31U;

/// What a symbol stands for: its smallest residual, and how many extra bits it has in bits 16 to 23.
constexpr std::array<std::uint32_t, 256> make_symbol_table() {
  std::array<std::uint32_t, 256> table{};
  for (unsigned symbol = 0; symbol < 256; ++symbol) {
    const bool exists = symbol < symbol_limit(16);
    table[symbol] = exists ? folded_from(symbol, 0) | extra_bits_of_symbol(symbol) << 16U : kNoSuchSymbol;
  }
  return table;
}
constexpr auto kSymbolTable = make_symbol_table();
constexpr std::size_t kGroup = 4;  // symbols whose extra bits, 12 at most each, come with one read

ISOHF_VECTORISED(std::uint64_t, expand_symbols,
                 (const std::byte* symbols, std::size_t count, const std::byte* extra, std::uint64_t position,
                  std::uint64_t end, std::uint16_t* __restrict folded),
                 (symbols, count, extra, position, end, folded)) {
  std::uint32_t seen = 0;
  std::size_t i = 0;
  while (i + 2 * kGroup <= count) {
    std::uint64_t eight;
    std::memcpy(&eight, symbols + i, sizeof(eight));
    if ((eight & 0xf0f0f0f0f0f0f0f0U) == 0) {  // residuals themselves
      for (std::size_t k = 0; k < 2 * kGroup; ++k) folded[i + k] = std::to_integer<std::uint16_t>(symbols[i + k]);
      i += 2 * kGroup;
      continue;
    }
    for (int half = 0; half < 2; ++half, i += kGroup, eight >>= 32U) {
      if (position > end) return kNotExpanded;
      std::uint64_t bits;
      std::memcpy(&bits, extra + position / 8, sizeof(bits));
      bits >>= position % 8;
      for (std::size_t k = 0; k < kGroup; ++k) {
        const std::uint32_t entry = kSymbolTable[(eight >> (8 * k)) & 0xffU];
        const unsigned taken = (entry >> 16U) & 0xffU;
        seen |= entry;
        folded[i + k] = static_cast<std::uint16_t>(entry + (bits & ((std::uint64_t{1} << taken) - 1)));
        bits >>= taken;
        position += taken;
      }
    }
  }
  for (; i < count; ++i) {
    if (position > end) return kNotExpanded;
    std::uint64_t bits;
    std::memcpy(&bits, extra + position / 8, sizeof(bits));
    bits >>= position % 8;
    const std::uint32_t entry = kSymbolTable[std::to_integer<std::size_t>(symbols[i])];
    const unsigned taken = (entry >> 16U) & 0xffU;
    seen |= entry;
    folded[i] = static_cast<std::uint16_t>(entry + (bits & ((std::uint64_t{1} << taken) - 1)));
    position += taken;
  }
  return position > end || (seen & kNoSuchSymbol) != 0 ? kNotExpanded : position;
}

}  // namespace

std::uint64_t expand_residuals(std::span<const std::byte> symbols, std::span<const std::byte> extra,
                               std::uint64_t position, std::uint16_t* folded) {
  return expand_symbols(symbols.data(), symbols.size(), extra.data(), position, 8 * std::uint64_t{extra.size()},
                        folded);
}

}  // namespace isohf
