#include "isohf/archive/deflate/literal_inflater.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>

#include "isohf/archive/deflate/huffman_code.h"
#include "isohf/base/bytes.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr unsigned kLastSymbol = 285;
constexpr unsigned kMaxLength = 15;
constexpr unsigned kTableBits = 11;

/// What the next bits say: bits 0-5 how many of them, bits 6-7 how many literals these are (0: a symbol that is none),
/// bits 8-15 and 16-23 the literals, or from bit 8 on the symbol; kLongCode where the code is longer than the table's.
using Entry = std::uint32_t;
constexpr Entry kOneLiteral = 1U << 6U;
constexpr unsigned kLongCode = 511;

constexpr unsigned bits_of(Entry entry) {
  return entry & 63U;
}
constexpr unsigned literals_of(Entry entry) {
  return (entry >> 6U) & 3U;
}

struct RunLength {
  std::uint16_t base;
  std::uint8_t extra_bits;
};

/// Lengths of matches by symbol, from 257 on (RFC 1951, 3.2.5).
constexpr std::array<RunLength, 29> make_run_lengths() {
  std::array<RunLength, 29> lengths{};
  unsigned base = 3;
  for (unsigned i = 0; i < 28; ++i) {
    const unsigned extra_bits = i < 8 ? 0 : i / 4 - 1;
    lengths[i] = {static_cast<std::uint16_t>(base), static_cast<std::uint8_t>(extra_bits)};
    base += 1U << extra_bits;
  }
  lengths[28] = {258, 0};
  return lengths;
}
constexpr auto kRunLengths = make_run_lengths();

/// A canonical code, ready to be read: a table for short codes, and the symbols in order of their codes for all.
class Decoding {
 public:
  /// False where the lengths make no complete code. Symbols from `literals` on are none. With `is_joined` the table
  /// tells two literals where its bits hold both.
  bool build(std::span<const std::uint8_t> lengths, unsigned table_bits, unsigned literals, bool is_joined) {
    table_bits_ = table_bits;
    starts_.fill(0);
    literal_ends_.fill(0);
    for (const std::uint8_t length : lengths) ++starts_[length + 1U];
    starts_[1] = 0;  // symbols without a code
    std::uint32_t filled = 0;
    for (unsigned length = 1; length <= kMaxLength; ++length) {
      filled += std::uint32_t{starts_[length + 1]} << (kMaxLength - length);
      starts_[length + 1] = static_cast<std::uint16_t>(starts_[length] + starts_[length + 1]);
    }
    if (filled != 1U << kMaxLength) return false;
    auto next = starts_;
    for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
      const unsigned length = lengths[symbol];
      if (length == 0) continue;
      const bool is_literal = symbol < literals;
      if (is_literal) literal_ends_[length] = static_cast<std::uint16_t>(next[length] + 1);
      sorted_[next[length]++] = length | (is_literal ? kOneLiteral : 0U) | static_cast<Entry>(symbol << 8U);
    }
    fill_table(is_joined);
    return true;
  }

  [[nodiscard]] Entry look_up(std::uint64_t bits) const { return table_[bits & ((1U << table_bits_) - 1)]; }
  [[nodiscard]] const Entry* table() const { return table_.data(); }

  /// The entry of a symbol whose code is too long for the table.
  [[nodiscard]] Entry read_long(std::uint64_t bits) const {
    unsigned code = 0, first = 0;
    for (unsigned length = 1; length <= kMaxLength; ++length) {
      code |= static_cast<unsigned>(bits & 1U);
      bits >>= 1U;
      const unsigned count = starts_[length + 1] - starts_[length];
      if (code - first < count) return sorted_[starts_[length] + code - first];
      first = (first + count) << 1U;
      code <<= 1U;
    }
    return 0;  // no complete code gets here
  }

 private:
  /// Codes of ascending length, each table twice the one before with the codes of its length put in.
  void fill_table(bool is_joined) {
    table_[0] = kLongCode << 8U;
    unsigned code = 0;  // bit-reversed, as streams have it
    for (unsigned length = 1; length <= table_bits_; ++length) {
      const unsigned size = 1U << (length - 1);
      std::memcpy(table_.data() + size, table_.data(), size * sizeof(Entry));
      for (unsigned i = starts_[length]; i < starts_[length + 1]; ++i) {
        codes_[i] = static_cast<std::uint16_t>(code);
        table_[code] = sorted_[i];
        unsigned bit = size;  // the next code: the carry runs towards the low bits
        while ((code & bit) != 0) bit >>= 1U;
        if (bit != 0) code = (code & (bit - 1)) | bit;
      }
      for (unsigned first = 1; is_joined && first < length; ++first) join_literals(first, length - first);
    }
  }

  /// Literals of one length before those of another, in place of the first ones alone.
  void join_literals(unsigned first_length, unsigned second_length) {
    const auto literals = [&](unsigned length) {
      return std::pair<unsigned, unsigned>(starts_[length], std::max(starts_[length], literal_ends_[length]));
    };
    const auto [begin, end] = literals(first_length);
    const auto [second_begin, second_end] = literals(second_length);
    for (unsigned i = begin; i < end; ++i) {
      for (unsigned k = second_begin; k < second_end; ++k) {
        const Entry second = sorted_[k];
        table_[codes_[i] | unsigned{codes_[k]} << first_length] =
            sorted_[i] + (second & 0xffU) + ((second & 0xff00U) << 8U);
      }
    }
  }

  unsigned table_bits_ = 0;
  std::array<std::uint16_t, kMaxLength + 2> starts_{};        ///< of the codes of each length among the sorted ones
  std::array<std::uint16_t, kMaxLength + 1> literal_ends_{};  ///< literals come first; below the start where none does
  std::array<Entry, 288> sorted_{};
  std::array<std::uint16_t, 288> codes_{};
  std::array<Entry, std::size_t{1} << kTableBits> table_{};
};

/// Where reading and writing have come to.
struct Progress {
  const std::byte* in;
  const std::byte* in_end;
  std::byte* out;
  std::byte* out_end;
  std::uint64_t bits;       ///< those that were read and not used, the next one lowest; above them bits that come again
  unsigned bit_count;       ///< of bits that count
  std::size_t made_up = 0;  ///< zero bytes that were read past the end
};

/// Literals while whole words can be read and written; returns at the first symbol that is none, or near an end.
ISOHF_KERNEL void copy_literals(const Entry* table, std::uint64_t mask, Progress& progress) {
  constexpr int kLookUps = 56 / kTableBits;
  const std::byte* in = progress.in;
  std::byte* out = progress.out;
  std::uint64_t bits = progress.bits;
  unsigned bit_count = progress.bit_count;
  while (progress.in_end - in >= 8 && progress.out_end - out >= 2 * kLookUps) {
    bits |= load_little<std::uint64_t>(in) << bit_count;
    in += (63U - bit_count) >> 3U;
    bit_count |= 56U;
    Entry entry = 0;
    for (int i = 0; i < kLookUps; ++i) {
      entry = table[bits & mask];
      if (literals_of(entry) == 0) break;
      store_little(out, static_cast<std::uint16_t>(entry >> 8U));
      out += literals_of(entry);
      bits >>= bits_of(entry);
      bit_count -= bits_of(entry);
    }
    if (literals_of(entry) == 0) break;
  }
  progress.in = in;
  progress.out = out;
  progress.bits = bits;
  progress.bit_count = bit_count;
}

class LiteralInflater {
 public:
  LiteralInflater(std::span<const std::byte> deflated, std::span<std::byte> out)
      : begin_(out.data()),
        at_{deflated.data(), deflated.data() + deflated.size(), out.data(), out.data() + out.size(), 0, 0} {}

  bool run() {
    for (bool is_last = false; !is_last;) {
      refill();
      is_last = take(1) != 0;
      const unsigned type = take(2);
      if (!(type == 0 ? copy_stored() : type == 1 ? inflate_fixed() : type == 2 && inflate_dynamic())) return false;
    }
    return at_.out == at_.out_end && at_.in == at_.in_end && at_.made_up == 0 && at_.bit_count < 8;
  }

 private:
  /// At least 48 bits, made up past the end.
  void refill() {
    at_.bits &= (std::uint64_t{1} << at_.bit_count) - 1;
    while (at_.bit_count < 56) {
      if (at_.in < at_.in_end) {
        at_.bits |= std::uint64_t{std::to_integer<unsigned>(*at_.in++)} << at_.bit_count;
      } else {
        ++at_.made_up;
      }
      at_.bit_count += 8;
    }
  }
  void drop(unsigned count) {
    at_.bits >>= count;
    at_.bit_count -= count;
  }
  unsigned take(unsigned count) {
    const auto value = static_cast<unsigned>(at_.bits & ((std::uint64_t{1} << count) - 1));
    drop(count);
    return value;
  }
  /// Gives back the whole bytes that were read and not used; false where some of those used were made up.
  bool align() {
    std::size_t bytes = at_.bit_count / 8;
    if (at_.made_up > bytes) return false;
    bytes -= at_.made_up;
    at_.made_up = 0;
    at_.in -= bytes;
    at_.bits = 0;
    at_.bit_count = 0;
    return true;
  }

  bool copy_stored() {
    if (!align() || at_.in_end - at_.in < 4) return false;
    const auto byte = [&](std::size_t i) { return std::to_integer<unsigned>(at_.in[i]); };
    const unsigned count = byte(0) | byte(1) << 8U;
    if ((byte(2) | byte(3) << 8U) != (~count & 0xffffU)) return false;
    at_.in += 4;
    if (at_.in_end - at_.in < std::ptrdiff_t{count} || at_.out_end - at_.out < std::ptrdiff_t{count}) return false;
    std::copy_n(at_.in, count, at_.out);
    at_.in += count;
    at_.out += count;
    return true;
  }

  bool inflate_fixed() {
    if ((at_.bits & 0x7fU) == 0) {  // the end at once, as at the end of each stream
      drop(7);
      return finish_block();
    }
    std::array<std::uint8_t, 288> lengths{};
    std::fill_n(lengths.begin(), 144, std::uint8_t{8});
    std::fill_n(lengths.begin() + 144, 112, std::uint8_t{9});
    std::fill_n(lengths.begin() + 256, 24, std::uint8_t{7});
    std::fill_n(lengths.begin() + 280, 8, std::uint8_t{8});
    return code_.build(lengths, kTableBits, kEndOfBlock, false) && inflate_symbols(5);
  }

  bool inflate_dynamic() {
    const unsigned literal_count = take(5) + 257;
    const unsigned distance_count = take(5) + 1;
    const unsigned length_count = take(4) + 4;
    if (literal_count > kLastSymbol + 1 || distance_count != 1) return false;
    std::array<std::uint8_t, 19> short_lengths{};
    refill();
    for (unsigned i = 0; i < length_count; ++i) {
      if (i == 16) refill();
      short_lengths[kLengthOrder[i]] = static_cast<std::uint8_t>(take(3));
    }
    std::array<std::uint8_t, kLastSymbol + 2> lengths{};
    if (!code_.build(short_lengths, 7, 16, false) || !read_lengths(std::span(lengths).first(literal_count + 1)))
      return false;
    const unsigned distance_bits = lengths[literal_count];
    if (distance_bits > 1 || lengths[kEndOfBlock] == 0) return false;
    return code_.build(std::span(lengths).first(literal_count), kTableBits, kEndOfBlock, true) &&
           inflate_symbols(distance_bits);
  }

  bool read_lengths(std::span<std::uint8_t> lengths) {
    for (std::size_t i = 0; i < lengths.size();) {
      refill();
      const Entry entry = code_.look_up(at_.bits);
      drop(bits_of(entry));
      const unsigned symbol = (entry >> 8U) & 0x1ffU;
      if (symbol < 16) {
        lengths[i++] = static_cast<std::uint8_t>(symbol);
        continue;
      }
      if (symbol == 16 && i == 0) return false;
      const std::uint8_t length = symbol == 16 ? lengths[i - 1] : std::uint8_t{0};
      const unsigned run = symbol == 16 ? 3 + take(2) : symbol == 17 ? 3 + take(3) : 11 + take(7);
      if (run > lengths.size() - i) return false;
      std::fill_n(lengths.begin() + static_cast<std::ptrdiff_t>(i), run, length);
      i += run;
    }
    return true;
  }

  /// Literals and runs up to the end of the block. A match's distance is one code, `distance_bits` zeros.
  bool inflate_symbols(unsigned distance_bits) {
    for (;;) {
      vectorised<copy_literals>(code_.table(), (std::uint64_t{1} << kTableBits) - 1, at_);
      refill();
      Entry entry = code_.look_up(at_.bits);
      if (((entry >> 8U) & 0x1ffU) == kLongCode && literals_of(entry) == 0) {
        entry = code_.read_long(at_.bits);
      }
      drop(bits_of(entry));
      const unsigned literals = literals_of(entry);
      if (literals != 0) {
        if (at_.out_end - at_.out < std::ptrdiff_t{literals}) return false;
        for (unsigned i = 0; i < literals; ++i) *at_.out++ = static_cast<std::byte>(entry >> (8 * (i + 1)));
        continue;
      }
      const unsigned symbol = (entry >> 8U) & 0x1ffU;
      if (symbol == kEndOfBlock) return finish_block();
      if (symbol > kLastSymbol || !repeat(kRunLengths[symbol - kEndOfBlock - 1], distance_bits)) return false;
    }
  }

  bool repeat(RunLength length, unsigned distance_bits) {
    const std::size_t count = length.base + take(length.extra_bits);
    if (distance_bits == 0 || take(distance_bits) != 0) return false;
    if (at_.out == begin_ || at_.out_end - at_.out < static_cast<std::ptrdiff_t>(count)) return false;
    std::fill_n(at_.out, count, at_.out[-1]);
    at_.out += count;
    return true;
  }

  /// Nothing may have been read past the end.
  bool finish_block() {
    const std::size_t unused = at_.bit_count / 8;
    if (at_.made_up > unused) return false;
    // Bytes are given back at the end of the last block alone, but that costs nothing here.
    at_.in -= unused - at_.made_up;
    at_.made_up = 0;
    at_.bit_count %= 8;
    at_.bits &= (std::uint64_t{1} << at_.bit_count) - 1;
    return true;
  }

  const std::byte* begin_;
  Progress at_;
  Decoding code_;
};

}  // namespace

bool inflate_literals(std::span<const std::byte> deflated, std::span<std::byte> out) {
  return LiteralInflater(deflated, out).run();
}

}  // namespace isohf
