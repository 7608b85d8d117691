#include "isohf/restore/residual_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/base/sample.h"

namespace isohf {
namespace {

constexpr std::size_t kContexts = 8;

/// Stream of a residual from the bits of its two neighbours, West and North.
std::size_t context_of(unsigned west_bits, unsigned north_bits) {
  const unsigned sum = west_bits + north_bits;
  constexpr std::array<unsigned, kContexts - 1> kLimits = {1, 3, 5, 7, 9, 12, 18};
  std::size_t context = 0;
  while (context < kLimits.size() && sum > kLimits[context]) ++context;
  return context;
}

/// Nearest half-precision value, ties away from zero; the maximum where the number is larger. The format says so
/// (docs/archive_format.md); everything else rounds ties to even (base/sample.h).
std::uint16_t predicted_half(double value) {
  const std::uint16_t sign = std::signbit(value) ? 0x8000U : 0U;
  const double size = std::abs(value);
  if (size >= 65504.0) return static_cast<std::uint16_t>(sign | 0x7BFFU);
  int exponent = size > 0.0 ? std::ilogb(size) : -15;
  exponent = std::max(exponent, -14);
  const double steps = std::floor(std::ldexp(size, 10 - exponent) + 0.5);  // 2^10 to 2^11, less where subnormal
  const auto bits = static_cast<unsigned>(steps) + (static_cast<unsigned>(exponent + 14) << 10U);
  return static_cast<std::uint16_t>(sign | bits);
}

template <typename T>
struct BitsOf : std::make_unsigned<T> {};
template <>
struct BitsOf<StoredHalf> : std::type_identity<std::uint16_t> {};
template <>
struct BitsOf<float> : std::type_identity<std::uint32_t> {};
template <>
struct BitsOf<double> : std::type_identity<std::uint64_t> {};

/// The bits of a sample type as unsigned keys whose differences wrap: of integers the bits themselves, of floats in the
/// order of their values.
template <typename T>
struct Coding {
  using Bits = typename BitsOf<T>::type;
  static constexpr Bits kSign = static_cast<Bits>(Bits{1} << (sizeof(Bits) * 8 - 1));

  static Bits key(Bits bits) {
    if constexpr (std::is_integral_v<T>) return bits;
    return (bits & kSign) != 0 ? static_cast<Bits>(~bits) : static_cast<Bits>(bits | kSign);
  }
  static Bits bits(Bits key) {
    if constexpr (std::is_integral_v<T>) return key;
    return (key & kSign) != 0 ? static_cast<Bits>(key & ~kSign) : static_cast<Bits>(~key);
  }
  static Bits nearest(double raw) {
    if constexpr (std::is_same_v<T, StoredHalf>) {
      return predicted_half(raw);
    } else {
      constexpr auto kLeast = static_cast<double>(std::numeric_limits<T>::lowest());
      constexpr auto kMost = static_cast<double>(std::numeric_limits<T>::max());
      const double whole = std::is_integral_v<T> ? std::floor(raw + 0.5) : raw;
      return std::bit_cast<Bits>(static_cast<T>(std::clamp(whole, kLeast, kMost)));
    }
  }
};

template <typename Action>
auto with_type(SampleType type, Action action) {
  return with_stored_type(type, [&](auto stored) { return action(Coding<decltype(stored)>{}); });
}

/// Residual 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
template <typename Bits>
Bits fold(Bits difference) {
  constexpr unsigned kLast = sizeof(Bits) * 8 - 1;
  const auto negative = static_cast<Bits>(-static_cast<Bits>(difference >> kLast));
  return static_cast<Bits>(static_cast<Bits>(difference << 1U) ^ negative);
}
template <typename Bits>
Bits unfold(Bits folded) {
  return static_cast<Bits>(static_cast<Bits>(folded >> 1U) ^ static_cast<Bits>(-static_cast<Bits>(folded & 1U)));
}

/// The bits of the residuals of a row and the one above: what contexts are made of.
class Neighbours {
 public:
  explicit Neighbours(std::int64_t width) : bits_(static_cast<std::size_t>(width), 0) {}

  [[nodiscard]] std::size_t context(std::size_t column) const {
    return context_of(column == 0 ? bits_[0] : bits_[column - 1], bits_[column]);
  }
  template <typename Bits>
  void set(std::size_t column, Bits folded) {
    bits_[column] = static_cast<unsigned char>(std::bit_width(folded));
  }

 private:
  std::vector<unsigned char> bits_;  ///< West of the place at hand this row's, from there on the row above's
};

[[noreturn]] void refuse_residuals(const char* what) {
  throw Error(ErrorCode::kCorrupt, what);
}

/// All lowest bytes, then all second bytes, ...; each plane a part.
template <typename Bits>
void add_planes(const std::vector<Bits>& values, ResidualPayload& payload) {
  for (std::size_t plane = 0; plane < sizeof(Bits); ++plane) {
    const std::size_t start = payload.bytes.size();
    payload.bytes.resize(start + values.size());
    std::byte* const to = payload.bytes.data() + start;
    for (std::size_t i = 0; i < values.size(); ++i) to[i] = static_cast<std::byte>((values[i] >> (8 * plane)) & 0xFFU);
    payload.end_part();
  }
}

template <typename Type>
ResidualPayload encode(const SampleMapping& mapping, std::int64_t width, std::span<const std::byte> raw,
                       std::span<const char> is_void, std::span<const double> predicted) {
  using Bits = typename Type::Bits;
  std::array<std::vector<Bits>, kContexts> streams;
  std::vector<Bits> kept;
  std::vector<std::byte> mask((predicted.size() + 7) / 8);
  Neighbours neighbours(width);
  bool any_masked = false;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    const Bits bits = stored_at<Bits>(raw.data() + i * sizeof(Bits));
    if (std::isnan(predicted[i]) || is_void[i] != 0) {
      kept.push_back(bits);
      if (std::isnan(predicted[i])) continue;
      mask[i / 8] |= std::byte{1} << (i % 8);
      any_masked = true;
      continue;
    }
    const Bits guess = Type::nearest((predicted[i] - mapping.z_offset) / mapping.z_scale);
    const Bits folded = fold(static_cast<Bits>(Type::key(bits) - Type::key(guess)));
    const std::size_t column = i % static_cast<std::size_t>(width);
    streams[neighbours.context(column)].push_back(folded);
    neighbours.set(column, folded);
  }
  ResidualPayload payload;
  ByteWriter out(payload.bytes);
  out.write(static_cast<std::uint8_t>(any_masked ? 1 : 0));
  for (const auto& stream : streams) out.write(static_cast<std::uint32_t>(stream.size()));
  if (any_masked) out.write_bytes(mask);
  payload.end_part();
  payload.bytes.reserve(payload.bytes.size() + predicted.size() * sizeof(Bits));
  add_planes<Bits>(kept, payload);
  for (auto& stream : streams) {
    add_planes<Bits>(stream, payload);
    stream = std::decay_t<decltype(stream)>();  // done with; {} would keep the memory
  }
  return payload;
}

/// Numbers that stand in planes: one context's residuals, or kept samples.
struct Stream {
  std::span<const std::byte> bytes;
  std::size_t count = 0;
  std::size_t next = 0;

  template <typename Bits>
  Bits take() {
    if (next == count) refuse_residuals("a stream of samples ends early");
    Bits value = 0;
    for (std::size_t plane = 0; plane < sizeof(Bits); ++plane) {
      const auto byte = std::to_integer<Bits>(bytes[plane * count + next]);
      value = static_cast<Bits>(value | static_cast<Bits>(byte << (8 * plane)));
    }
    ++next;
    return value;
  }
};

template <typename Type>
void decode(const SampleMapping& mapping, std::int64_t width, std::span<const std::byte> payload,
            std::span<const double> predicted, std::span<std::byte> raw) {
  using Bits = typename Type::Bits;
  ByteReader in(payload);
  const auto flags = in.read<std::uint8_t>();
  if (flags > 1) refuse_residuals("residuals of a kind that this build does not know");
  std::array<Stream, kContexts> streams;
  std::size_t coded = 0;
  for (Stream& stream : streams) {
    stream.count = in.read<std::uint32_t>();
    coded += stream.count;
  }
  if (coded > predicted.size()) refuse_residuals("more residuals than samples");
  std::span<const std::byte> mask;
  if (flags == 1) mask = in.read_bytes((predicted.size() + 7) / 8);
  if (!mask.empty() && predicted.size() % 8 != 0 &&
      std::to_integer<unsigned>(mask.back()) >> (predicted.size() % 8) != 0)
    refuse_residuals("the mask of kept samples has bits behind the last sample");
  Stream kept;
  kept.count = predicted.size() - coded;
  kept.bytes = in.read_bytes(kept.count * sizeof(Bits));
  for (Stream& stream : streams) stream.bytes = in.read_bytes(stream.count * sizeof(Bits));
  if (in.remaining() != 0) refuse_residuals("bytes behind the residuals");
  Neighbours neighbours(width);
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    Bits bits = 0;
    const bool is_masked = !mask.empty() && (mask[i / 8] & (std::byte{1} << (i % 8))) != std::byte{0};
    if (is_masked || std::isnan(predicted[i])) {
      bits = kept.template take<Bits>();
    } else {
      const Bits guess = Type::nearest((predicted[i] - mapping.z_offset) / mapping.z_scale);
      const std::size_t column = i % static_cast<std::size_t>(width);
      const Bits folded = streams[neighbours.context(column)].template take<Bits>();
      neighbours.set(column, folded);
      bits = Type::bits(static_cast<Bits>(Type::key(guess) + unfold(folded)));
    }
    std::memcpy(raw.data() + i * sizeof(Bits), &bits, sizeof(Bits));
  }
  // As many samples as are kept and coded together: where all kept ones are used, so are all residuals.
  if (kept.next != kept.count) refuse_residuals("more kept samples than there are places for");
}

}  // namespace

ResidualPayload encode_residuals(const SampleMapping& mapping, std::int64_t width, std::span<const std::byte> raw,
                                 std::span<const char> is_void, std::span<const double> predicted) {
  ISOHF_ASSERT(raw.size() == predicted.size() * size_bytes(mapping.type) && is_void.size() == predicted.size());
  return with_type(mapping.type,
                   [&](auto type) { return encode<decltype(type)>(mapping, width, raw, is_void, predicted); });
}

void decode_residuals(const SampleMapping& mapping, std::int64_t width, std::span<const std::byte> payload,
                      std::span<const double> predicted, std::span<std::byte> raw) {
  ISOHF_ASSERT(raw.size() == predicted.size() * size_bytes(mapping.type));
  with_type(mapping.type, [&](auto type) { decode<decltype(type)>(mapping, width, payload, predicted, raw); });
}

}  // namespace isohf
