#pragma once

#include <cstdint>

#include "isohf/base/simd.h"
#if defined(ISOHF_HAS_WIDE_BUILTINS)
#include <immintrin.h>
#endif

/// The few operations that GCC does not make of vector types by itself; kIsWide says that AVX2 is there (simd.h).

namespace isohf {

using Ints = std::int32_t __attribute__((vector_size(32)));
using Words = std::uint32_t __attribute__((vector_size(32)));
using Longs = std::int64_t __attribute__((vector_size(32)));
using LongWords = std::uint64_t __attribute__((vector_size(32)));

/// Products of the low halves of 64 bits, taken as numbers with a sign.
template <bool kIsWide>
ISOHF_KERNEL Longs multiply_low_halves(Longs a, Longs b) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  if constexpr (kIsWide) return (Longs)__builtin_ia32_pmuldq256((Ints)a, (Ints)b);
#endif
  return ((Longs)((LongWords)a << 32U) >> 32U) * ((Longs)((LongWords)b << 32U) >> 32U);
}

/// Both signed halves of 16 bits of each element times those of the other, added up modulo 2^32.
template <bool kIsWide>
ISOHF_KERNEL Words multiply_pairs(Words a, Words b) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  using Halves = short __attribute__((vector_size(32)));
  if constexpr (kIsWide) return (Words)__builtin_ia32_pmaddwd256((Halves)a, (Halves)b);
#endif
  const auto low = [](Words pairs) { return (Ints)(pairs << 16U) >> 16U; };
  return (Words)(low(a) * low(b)) + (Words)(((Ints)a >> 16U) * ((Ints)b >> 16U));
}

/// One of two, by the sign of each element.
template <bool kIsWide>
ISOHF_KERNEL Ints choose_by_sign(Ints signs, Ints negative, Ints otherwise) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  using Floats = float __attribute__((vector_size(32)));
  if constexpr (kIsWide) return (Ints)__builtin_ia32_blendvps256((Floats)otherwise, (Floats)negative, (Floats)signs);
#endif
  return signs < 0 ? negative : otherwise;
}

}  // namespace isohf
