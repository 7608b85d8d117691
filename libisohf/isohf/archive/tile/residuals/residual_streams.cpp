#include "isohf/archive/tile/residuals/residual_streams.h"

#include <bit>
#include <type_traits>

#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/residuals/pair_coding.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

/// A residual as a float, whose exponent and upper three bits of mantissa are octave and eighth. One of 32 bits is halved,
/// so that it has a sign to spare; and the bit eight below its highest one is cleared, so that no carry of rounding gets
/// past that.
constexpr std::uint32_t float_bits(std::uint16_t zigzagged) {
  return std::bit_cast<std::uint32_t>(static_cast<float>(std::int32_t{zigzagged}));
}
constexpr std::uint32_t float_bits(std::uint32_t zigzagged) {
  const std::uint32_t kept = zigzagged & ~(zigzagged >> 8U);
  return std::bit_cast<std::uint32_t>(static_cast<float>(static_cast<std::int32_t>(kept >> 1U)));
}

template <typename Zigzagged>
ISOHF_KERNEL void find_symbols(const Zigzagged* __restrict zigzagged, std::size_t count,
                               std::uint8_t* __restrict symbols) {
  constexpr bool kIsSmall = sizeof(Zigzagged) == 2;
  using Value = std::conditional_t<kIsSmall, std::int32_t, std::uint32_t>;  // machines compare signed numbers faster
  constexpr Value kFirst = (kIsSmall ? 127 + 4 : 127 + 3) * 8 - kFirstSplitSymbol;
  for (std::size_t i = 0; i < count; ++i) {
    const Value value = zigzagged[i];
    const Value split = static_cast<Value>(float_bits(zigzagged[i]) >> 20U) - kFirst;
    symbols[i] = static_cast<std::uint8_t>(value < Value{kFirstSplitSymbol} ? value : split);
  }
}

/// The extra bits of two neighbouring residuals of codes, together no more than 24, and how many these are.
ISOHF_KERNEL void join_extra_bits(const std::uint16_t* __restrict zigzagged, std::size_t pairs,
                                  std::uint32_t* __restrict bits, std::uint32_t* __restrict counts) {
  constexpr std::int32_t kFirstOctave = 127 + 4;
  for (std::size_t i = 0; i < pairs; ++i) {
    const auto extra = [&](std::uint32_t value, std::uint32_t& count) {
      const std::int32_t exponent =
          std::bit_cast<std::int32_t>(static_cast<float>(static_cast<std::int32_t>(value))) >> 23;
      const std::int32_t octave = exponent - kFirstOctave + 1;
      count = static_cast<std::uint32_t>(octave < 0 ? 0 : octave);
      return value & ((1U << count) - 1);
    };
    std::uint32_t first_count = 0;
    std::uint32_t second_count = 0;
    const std::uint32_t first = extra(zigzagged[2 * i], first_count);
    const std::uint32_t second = extra(zigzagged[2 * i + 1], second_count);
    bits[i] = first | second << first_count;
    counts[i] = first_count + second_count;
  }
}

/// The extra bits of residuals of floats, and how many these are.
ISOHF_KERNEL void find_extra_bits(const std::uint32_t* __restrict zigzagged, std::size_t count,
                                  std::uint32_t* __restrict bits, std::uint32_t* __restrict counts) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t octave = static_cast<std::int32_t>(float_bits(zigzagged[i]) >> 23U) - 129;
    counts[i] = static_cast<std::uint32_t>(octave < 0 ? 0 : octave);
    bits[i] = zigzagged[i] & ((1U << counts[i]) - 1);
  }
}

/// The bits of the residuals that their symbols leave out.
std::vector<std::byte> pack_extra_bits(const std::uint16_t* zigzagged, std::size_t count) {
  BitPacker packer(count * 2);
  const std::size_t pairs = count / 2;
  Scratch<std::uint32_t> bits(pairs);
  Scratch<std::uint32_t> counts(pairs);
  vectorised<join_extra_bits>(zigzagged, pairs, bits.data(), counts.data());
  for (std::size_t i = 0; i < pairs; ++i) packer.put(bits.data()[i], counts.data()[i]);
  if (count % 2 != 0) {
    const unsigned last = extra_bits_of_symbol(symbol_of(zigzagged[count - 1]));
    packer.put(zigzagged[count - 1] & ((1U << last) - 1), last);
  }
  return packer.finish();
}
std::vector<std::byte> pack_extra_bits(const std::uint32_t* zigzagged, std::size_t count) {
  BitPacker packer(count * 4);
  Scratch<std::uint32_t> bits(count);
  Scratch<std::uint32_t> counts(count);
  vectorised<find_extra_bits>(zigzagged, count, bits.data(), counts.data());
  std::size_t i = 0;
  for (; i + 2 <= count; i += 2) {
    const std::uint64_t second = bits.data()[i + 1];
    packer.put_many(bits.data()[i] | second << counts.data()[i], counts.data()[i] + counts.data()[i + 1]);
  }
  if (i < count) packer.put_many(bits.data()[i], counts.data()[i]);
  return packer.finish();
}

}  // namespace

template <typename Zigzagged>
std::vector<std::uint32_t> sort_by_context(const Residuals<Zigzagged>& residuals,
                                           std::span<const std::uint16_t> thresholds,
                                           std::span<const std::uint32_t> histogram, Zigzagged* sorted) {
  const auto table = context_table(thresholds);
  std::vector<std::uint32_t> counts(thresholds.size() + 1);
  for (std::size_t level = 0; level < histogram.size(); ++level) counts[table[level]] += histogram[level];
  std::array<Zigzagged*, kMaxContexts> to{};
  std::array<Zigzagged*, kMaxContexts> to_end{};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    to[i] = sorted;
    sorted += counts[i];
    to_end[i] = sorted;
  }
  const Zigzagged* const zigzagged = residuals.zigzagged.data();
  const std::uint16_t* const energies = residuals.energies.data();
  const std::size_t count = residuals.count;
  for (std::size_t i = 0; i < count / 2; ++i) {
    const std::size_t from_end = count - 1 - i;
    *to[table[energies[i]]]++ = zigzagged[i];
    *--to_end[table[energies[from_end]]] = zigzagged[from_end];
  }
  if (count % 2 != 0) *to[table[energies[count / 2]]] = zigzagged[count / 2];
  return counts;
}

template <typename Zigzagged>
std::uint8_t choose_energy_shift(const Residuals<Zigzagged>& residuals) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < residuals.count; ++i) sum += residuals.zigzagged.data()[i];
  std::size_t count = residuals.count;
  for (const std::uint8_t is_void : residuals.is_void) count -= is_void;
  const std::uint64_t mean = count == 0 ? 0 : sum / count;
  unsigned shift = 0;
  while ((mean >> shift) > kMagnitudeLimit / 10) ++shift;
  return static_cast<std::uint8_t>(shift);
}

template <typename Zigzagged>
Streams make_streams(const Residuals<Zigzagged>& residuals, const StreamEffort& effort, PayloadHeader& header) {
  const std::size_t count = residuals.count;
  Streams streams;
  streams.single = std::make_unique_for_overwrite<std::uint8_t[]>(count);
  std::uint8_t* const symbols = streams.single.get();
  vectorised<find_symbols<Zigzagged>>(residuals.zigzagged.data(), count, symbols);
  const std::span<const std::uint16_t> energies(residuals.energies.data(), count);
  const std::vector<std::uint32_t> histogram = count_energies(energies);
  header.thresholds = choose_thresholds({symbols, count}, energies, histogram, effort.context_thinning);
  Scratch<Zigzagged> sorted(count);
  header.symbol_counts = sort_by_context(residuals, header.thresholds, histogram, sorted.data());
  vectorised<find_symbols<Zigzagged>>(sorted.data(), count, symbols);
  streams.extra = pack_extra_bits(sorted.data(), count);
  auto from = std::as_bytes(std::span<const std::uint8_t>(symbols, count));
  streams.paired.reserve(header.symbol_counts.size());
  for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
    streams.symbols.push_back(from.first(header.symbol_counts[i]));
    from = from.subspan(header.symbol_counts[i]);
    if (!effort.has_pairs || !pairs_pay(streams.symbols.back())) continue;
    std::vector<std::byte> pairs = pair_symbols(streams.symbols.back());
    if (pairs.size() > streams.symbols.back().size()) continue;  // max_payload_bytes holds for either
    streams.paired.push_back(std::move(pairs));
    streams.symbols.back() = streams.paired.back();
    header.paired = static_cast<std::uint16_t>(header.paired | 1U << i);
  }
  return streams;
}

template std::vector<std::uint32_t> sort_by_context(const Residuals<std::uint16_t>& residuals,
                                                    std::span<const std::uint16_t> thresholds,
                                                    std::span<const std::uint32_t> histogram, std::uint16_t* sorted);
template std::vector<std::uint32_t> sort_by_context(const Residuals<std::uint32_t>& residuals,
                                                    std::span<const std::uint16_t> thresholds,
                                                    std::span<const std::uint32_t> histogram, std::uint32_t* sorted);
template std::uint8_t choose_energy_shift(const Residuals<std::uint16_t>& residuals);
template std::uint8_t choose_energy_shift(const Residuals<std::uint32_t>& residuals);
template Streams make_streams(const Residuals<std::uint16_t>& residuals, const StreamEffort& effort,
                              PayloadHeader& header);
template Streams make_streams(const Residuals<std::uint32_t>& residuals, const StreamEffort& effort,
                              PayloadHeader& header);

}  // namespace isohf
