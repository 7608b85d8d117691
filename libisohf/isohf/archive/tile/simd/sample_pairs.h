#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "isohf/archive/tile/simd/vector_operations.h"

/// How decoders in lanes keep 16-bit samples: each with its western neighbour.

namespace isohf {

/// A sample less 2^15, so that it fits 16 bits with a sign. Weights add up to 2^12, hence the sum of weighted samples
/// is that of the shifted ones and 2^27.
inline constexpr std::int32_t kSampleShift = 1 << 15;

/// Two neighbouring samples, shifted, of each lane: that of the place in the low half, that East of it in the high
/// half. One multiplication by a pair of weights does for both.
constexpr std::int32_t pair_of(std::int32_t west, std::int32_t east) {
  return static_cast<std::int32_t>((static_cast<std::uint32_t>(west) & 0xffffU) | static_cast<std::uint32_t>(east)
                                                                                      << 16U);
}

/// The samples of eight places from first on, lane by lane: the pairs of every other place, a transposed square. Pairs of
/// all lanes lie kStride numbers behind those of the place before; `samples` is where those of the first two places are.
template <std::ptrdiff_t kStride>
ISOHF_KERNEL void turn_square(const std::int32_t* samples, const std::array<std::uint16_t*, 8>& codes, int first) {
  using Long = std::uint64_t __attribute__((vector_size(32)));
  using Quad = std::uint32_t __attribute__((vector_size(16)));
  Words pairs[4];
  for (std::size_t i = 0; i < 4; ++i) {
    pairs[i] = unaligned<Words>(samples + 2 * static_cast<std::ptrdiff_t>(i) * kStride).value ^ 0x80008000U;
  }
  // Within each half of the lanes: rows of four lanes become columns.
  const Long a = (Long)__builtin_shufflevector(pairs[0], pairs[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Long b = (Long)__builtin_shufflevector(pairs[0], pairs[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Long c = (Long)__builtin_shufflevector(pairs[2], pairs[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Long d = (Long)__builtin_shufflevector(pairs[2], pairs[3], 2, 10, 3, 11, 6, 14, 7, 15);
  const Words turned[4] = {
      (Words)__builtin_shufflevector(a, c, 0, 4, 2, 6), (Words)__builtin_shufflevector(a, c, 1, 5, 3, 7),
      (Words)__builtin_shufflevector(b, d, 0, 4, 2, 6), (Words)__builtin_shufflevector(b, d, 1, 5, 3, 7)};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    unaligned<Quad>(codes[lane] + first).value = __builtin_shufflevector(turned[lane], turned[lane], 0, 1, 2, 3);
    unaligned<Quad>(codes[lane + 4] + first).value = __builtin_shufflevector(turned[lane], turned[lane], 4, 5, 6, 7);
  }
}

}  // namespace isohf
