#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// Canonical prefix codes as Deflate has them (RFC 1951, 3.2.2).

namespace isohf {

/// The order in which a dynamic block sends the lengths of the code for code lengths (RFC 1951, 3.2.7).
inline constexpr std::array<std::uint8_t, 19> kLengthOrder = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                              11, 4,  12, 3, 13, 2, 14, 1, 15};

/// The symbol that ends a block (RFC 1951, 3.2.5).
inline constexpr unsigned kEndOfBlock = 256;

using ByteCounts = std::array<std::uint32_t, 256>;

/// How often each byte occurs.
[[nodiscard]] ByteCounts count_bytes(std::span<const std::byte> bytes);

/// Shortest prefix code with no code longer than `limit` bits (nearly shortest where the limit bites); lengths are 0
/// for symbols of frequency 0. A single symbol gets length 1.
void build_code_lengths(std::span<const std::uint32_t> frequencies, unsigned limit, std::span<std::uint8_t> lengths);

/// The codes of these lengths, 15 at most, bit-reversed as Deflate sends them; those of length 0 stay as they are.
void assign_codes(std::span<const std::uint8_t> lengths, std::span<std::uint16_t> codes);

}  // namespace isohf
