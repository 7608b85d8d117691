#pragma once

#include <bit>
#include <cstdint>

#include "isohf/metadata.h"

/// Residuals as they are stored: zigzagged, then a symbol and some bits more (docs/archive_format.md, "Tile payload").

namespace isohf {

/// 0, -1, 1, -2, 2, ... to 0, 1, 2, 3, 4, ...
[[nodiscard]] inline std::uint32_t zigzag(std::int32_t residual) {
  return (static_cast<std::uint32_t>(residual) << 1U) ^ static_cast<std::uint32_t>(residual >> 31);
}
[[nodiscard]] inline std::uint32_t unzigzag(std::uint32_t zigzagged) {
  return (zigzagged >> 1U) ^ (0U - (zigzagged & 1U));
}

/// A zigzagged residual as a symbol and some bits more: itself below 16; above, eight symbols for every octave.
inline constexpr std::uint32_t kFirstSplitSymbol = 16;

[[nodiscard]] constexpr unsigned extra_bits_of_symbol(unsigned symbol) {
  return symbol < kFirstSplitSymbol ? 0U : (symbol - kFirstSplitSymbol) / 8 + 1;
}
[[nodiscard]] constexpr unsigned symbol_of(std::uint32_t zigzagged) {
  if (zigzagged < kFirstSplitSymbol) return zigzagged;
  const auto octave = static_cast<unsigned>(std::bit_width(zigzagged)) - 1;  // 4..31
  return kFirstSplitSymbol + (octave - 4) * 8 + ((zigzagged >> (octave - 3)) & 7U);
}
[[nodiscard]] constexpr std::uint32_t zigzagged_from(unsigned symbol, std::uint32_t extra) {
  if (symbol < kFirstSplitSymbol) return symbol;
  const unsigned bits = extra_bits_of_symbol(symbol);
  return ((8U + (symbol & 7U)) << bits) + extra;
}
/// One more than the last symbol of residuals of that many bits: 112 for 16, 240 for 32.
[[nodiscard]] constexpr unsigned symbol_limit(unsigned residual_bits) {
  return kFirstSplitSymbol + (residual_bits - 4) * 8;
}
[[nodiscard]] inline unsigned residual_bits(CodeType type) {
  return type == CodeType::kF32 ? 32U : 16U;
}

}  // namespace isohf
