#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

/// What entropy coding would take, in integers, so that every machine chooses alike.

namespace isohf {

/// log2 of 1 + i/256 in 2^-16, by repeated squaring.
constexpr std::array<std::uint32_t, 257> make_log_table() {
  std::array<std::uint32_t, 257> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint64_t value = (std::uint64_t{256} + i) << 23U;  // 1.0 is 2^31
    std::uint32_t log = 0;
    for (unsigned bit = 0; bit < 17; ++bit) {
      const bool carry = (value >> 32U) != 0;
      log = log << 1U | (carry ? 1U : 0U);
      if (carry) value >>= 1U;
      value = (value * value) >> 31U;
    }
    table[i] = log;
  }
  return table;
}
inline constexpr auto kLogTable = make_log_table();

/// n·log2(n) in 2^-16 bits.
[[nodiscard]] inline std::uint64_t n_log_n(std::uint64_t n) {
  if (n < 2) return 0;
  const auto octave = static_cast<unsigned>(std::bit_width(n)) - 1;
  const std::uint64_t mantissa = octave >= 8 ? n >> (octave - 8) : n << (8 - octave);
  return n * ((std::uint64_t{octave} << 16U) + kLogTable[mantissa - 256]);
}

}  // namespace isohf
