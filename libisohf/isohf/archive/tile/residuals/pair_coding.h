#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/base/bytes.h"

/// Two symbols in a byte, for contexts of so little doubt that a Huffman code's whole bits waste a part of each symbol
/// (docs/archive_format.md, "Pairs").
///
///     byte < 225   symbols byte / 15 and byte % 15
///     225          the next two bytes are the two symbols, one of them at least 15
///
/// After an odd number of symbols a 0 fills the last pair.

namespace isohf {

inline constexpr unsigned kPairBase = 15;
inline constexpr unsigned kPairEscape = kPairBase * kPairBase;

/// True where pairs take clearly fewer bits than single symbols. O(symbols); deterministic, integers only.
[[nodiscard]] bool pairs_pay(std::span<const std::byte> symbols);

[[nodiscard]] std::vector<std::byte> pair_symbols(std::span<const std::byte> symbols);

/// Reads `symbols.size()` symbols. Throws Error{kCorrupt}: a byte above the escape, an escape without need, a last pair
/// that is not filled with 0, an early end.
void unpair_symbols(ByteReader& reader, std::span<std::byte> symbols);

}  // namespace isohf
