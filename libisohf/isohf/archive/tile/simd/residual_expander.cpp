#include "isohf/archive/tile/simd/residual_expander.h"

#include <array>
#include <cstring>

#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/base/bytes.h"
#include "isohf/base/simd.h"
#if defined(ISOHF_TARGET_WIDE)
#include <immintrin.h>
#endif

namespace isohf {
namespace {

constexpr std::uint32_t kNoSuchSymbol = 1U << 31U;
constexpr unsigned kSymbols = symbol_limit(16);  // of codes
constexpr std::size_t kGroup = 4;                // symbols whose extra bits come with one read of 8 bytes
static_assert(7 + kGroup * extra_bits_of_symbol(kSymbols - 1) <= 64);

/// What a symbol stands for: its smallest residual, and how many extra bits it has in bits 16 to 23.
constexpr std::array<std::uint32_t, 256> make_symbol_table() {
  std::array<std::uint32_t, 256> table{};
  for (unsigned symbol = 0; symbol < 256; ++symbol) {
    table[symbol] = symbol < kSymbols ? zigzagged_from(symbol, 0) | extra_bits_of_symbol(symbol) << 16U : kNoSuchSymbol;
  }
  return table;
}
constexpr auto kSymbolTable = make_symbol_table();

std::uint64_t expand_plainly(const std::byte* symbols, std::size_t count, const std::byte* extra,
                             std::uint64_t position, std::uint64_t end, std::uint16_t* __restrict zigzagged) {
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (position > end) return kNotExpanded;
    const std::uint64_t bits = load_little<std::uint64_t>(extra + position / 8) >> position % 8;
    const std::uint32_t entry = kSymbolTable[std::to_integer<std::size_t>(symbols[i])];
    const unsigned taken = (entry >> 16U) & 0xffU;
    seen |= entry;
    zigzagged[i] = static_cast<std::uint16_t>(entry + (bits & ((std::uint64_t{1} << taken) - 1)));
    position += taken;
  }
  return position > end || (seen & kNoSuchSymbol) != 0 ? kNotExpanded : position;
}

#if defined(ISOHF_TARGET_WIDE)
/// Sixteen symbols at a time: octaves and mantissas by bytes, then the extra bits of four symbols put to them by one
/// deposit. The last symbols, fewer than sixteen, are left to the plain loop.
ISOHF_TARGET_WIDE std::uint64_t expand_widely(const std::byte* symbols, std::size_t count, const std::byte* extra,
                                              std::uint64_t position, std::uint64_t end,
                                              std::uint16_t* __restrict zigzagged) {
  const __m128i low_powers = _mm_setr_epi8(1, 2, 4, 8, 16, 32, 64, -128, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m128i high_powers = _mm_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 4, 8, 16, 32, 64, -128);
  const __m128i eight = _mm_set1_epi8(8);
  const __m128i zero = _mm_setzero_si128();
  __m128i most = zero;
  const auto put_four = [&](std::uint64_t least, std::uint64_t mask, std::uint16_t* to) ISOHF_TARGET_WIDE {
    std::uint64_t bits;
    std::memcpy(&bits, extra + position / 8, sizeof(bits));
    const std::uint64_t four = least + _pdep_u64(bits >> (position % 8), mask);  // no bit of the least is in the mask
    std::memcpy(to, &four, sizeof(four));
    position += static_cast<std::uint64_t>(_mm_popcnt_u64(mask));
  };
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m128i symbol = _mm_loadu_si128(static_cast<const __m128i*>(static_cast<const void*>(symbols + i)));
    auto* const to = static_cast<__m128i*>(static_cast<void*>(zigzagged + i));
    if (_mm_testz_si128(symbol, _mm_set1_epi8(-16)) != 0) {  // residuals themselves
      _mm_storeu_si128(to, _mm_unpacklo_epi8(symbol, zero));
      _mm_storeu_si128(to + 1, _mm_unpackhi_epi8(symbol, zero));
      continue;
    }
    // Twelve symbols may move on by 18 bytes before the last read of eight: kExpanderSlack.
    if (position > end) return kNotExpanded;
    most = _mm_max_epu8(most, symbol);
    const __m128i octave = _mm_and_si128(_mm_srli_epi16(_mm_subs_epu8(symbol, eight), 3), _mm_set1_epi8(15));
    const __m128i low = _mm_shuffle_epi8(low_powers, octave);
    const __m128i high = _mm_shuffle_epi8(high_powers, octave);
    const __m128i mantissa = _mm_min_epu8(symbol, _mm_or_si128(_mm_and_si128(symbol, _mm_set1_epi8(7)), eight));
    const auto put_eight = [&](__m128i power, __m128i mantissas, std::uint16_t* eight_to) ISOHF_TARGET_WIDE {
      const __m128i least = _mm_mullo_epi16(mantissas, power);
      const __m128i mask = _mm_sub_epi16(power, _mm_set1_epi16(1));
      put_four(static_cast<std::uint64_t>(_mm_cvtsi128_si64(least)),
               static_cast<std::uint64_t>(_mm_cvtsi128_si64(mask)), eight_to);
      put_four(static_cast<std::uint64_t>(_mm_extract_epi64(least, 1)),
               static_cast<std::uint64_t>(_mm_extract_epi64(mask, 1)), eight_to + kGroup);
    };
    put_eight(_mm_unpacklo_epi8(low, high), _mm_unpacklo_epi8(mantissa, zero), zigzagged + i);
    put_eight(_mm_unpackhi_epi8(low, high), _mm_unpackhi_epi8(mantissa, zero), zigzagged + i + 2 * kGroup);
  }
  const __m128i last = _mm_set1_epi8(static_cast<char>(kSymbols - 1));
  if (_mm_movemask_epi8(_mm_cmpeq_epi8(_mm_max_epu8(most, last), last)) != 0xffff) return kNotExpanded;
  return expand_plainly(symbols + i, count - i, extra, position, end, zigzagged + i);
}
#endif

}  // namespace

std::uint64_t expand_residuals(std::span<const std::byte> symbols, std::span<const std::byte> extra,
                               std::uint64_t position, std::uint16_t* zigzagged) {
  const std::uint64_t end = 8 * std::uint64_t{extra.size()};
#if defined(ISOHF_TARGET_WIDE)
  if (detail::simd_level.load(std::memory_order_relaxed) != detail::SimdLevel::kBase) {
    return expand_widely(symbols.data(), symbols.size(), extra.data(), position, end, zigzagged);
  }
#endif
  return expand_plainly(symbols.data(), symbols.size(), extra.data(), position, end, zigzagged);
}

}  // namespace isohf
