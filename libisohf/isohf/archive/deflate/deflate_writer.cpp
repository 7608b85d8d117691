#include "isohf/archive/deflate/deflate_writer.h"

#include <algorithm>

#include "isohf/archive/deflate/huffman_code.h"
#include "isohf/base/bytes.h"

namespace isohf {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 17;
constexpr std::size_t kMaxRun = 258;  // the longest match of Deflate

/// Deflate's match lengths: symbol, number of extra bits and their value, for lengths 3..258 (RFC 1951, 3.2.5).
struct MatchCode {
  std::uint16_t symbol;
  std::uint8_t extra_bits;
  std::uint8_t extra;
};

constexpr std::array<MatchCode, kMaxRun + 1> make_match_codes() {
  std::array<MatchCode, kMaxRun + 1> codes{};
  unsigned length = 3;
  for (unsigned symbol = 257; symbol < 285; ++symbol) {
    const unsigned extra_bits = symbol < 265 ? 0 : (symbol - 261) / 4;
    for (unsigned extra = 0; extra < (1U << extra_bits) && length <= kMaxRun; ++extra, ++length) {
      codes[length] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint8_t>(extra_bits),
                       static_cast<std::uint8_t>(extra)};
    }
  }
  codes[kMaxRun] = {285, 0, 0};
  return codes;
}
constexpr auto kMatchCodes = make_match_codes();

}  // namespace

/// Bits on their way to memory that has room for them.
struct DeflateWriter::BitsOut {
  std::byte* next;
  std::uint64_t bits;
  unsigned count;

  void put(std::uint64_t value, unsigned length) {
    bits |= value << count;
    count += length;
  }
  void flush_words() {
    if (count < 32) return;
    store_little(next, bits, 4);
    next += 4;
    bits >>= 32U;
    count -= 32;
  }
};

struct DeflateWriter::Header {
  unsigned literal_count = 257;
  unsigned distance_length = 0;     ///< of the only distance code, 0 where there are no matches
  std::vector<std::uint16_t> runs;  ///< symbol | extra << 5, run-length coded code lengths
  std::array<std::uint8_t, 19> lengths{};
  std::array<std::uint16_t, 19> codes{};
  unsigned length_count = 4;
  std::uint64_t bits = 0;
};

DeflateWriter::Header DeflateWriter::describe(const Code& code, bool has_matches) {
  Header header;
  header.literal_count = 286;
  while (header.literal_count > 257 && code.lengths[header.literal_count - 1] == 0) --header.literal_count;
  header.distance_length = has_matches ? 1 : 0;
  std::array<std::uint8_t, 288> all = code.lengths;
  const unsigned total = header.literal_count + 1;
  all[header.literal_count] = static_cast<std::uint8_t>(header.distance_length);
  std::array<std::uint32_t, 19> frequencies{};
  const auto emit = [&](unsigned symbol, unsigned extra) {
    header.runs.push_back(static_cast<std::uint16_t>(symbol | extra << 5U));
    ++frequencies[symbol];
  };
  for (unsigned i = 0; i < total;) {
    const unsigned length = all[i];
    unsigned run = 1;
    while (i + run < total && all[i + run] == length) ++run;
    i += run;
    if (length == 0) {
      for (; run >= 11; run -= std::min(run, 138U)) emit(18, std::min(run, 138U) - 11);
      if (run >= 3) {
        emit(17, run - 3);
        run = 0;
      }
    } else {
      emit(length, 0);
      --run;
      for (; run >= 3; run -= std::min(run, 6U)) emit(16, std::min(run, 6U) - 3);
    }
    for (; run > 0; --run) emit(length, 0);
  }
  build_code_lengths(frequencies, 7, header.lengths);
  assign_codes(header.lengths, header.codes);
  header.length_count = 19;
  while (header.length_count > 4 && header.lengths[kLengthOrder[header.length_count - 1]] == 0) --header.length_count;
  header.bits = 3 + 5 + 5 + 4 + 3 * std::uint64_t{header.length_count} + 2 * std::uint64_t{frequencies[16]} +
                3 * std::uint64_t{frequencies[17]} + 7 * std::uint64_t{frequencies[18]};
  for (std::size_t symbol = 0; symbol < frequencies.size(); ++symbol) {
    header.bits += std::uint64_t{frequencies[symbol]} * header.lengths[symbol];
  }
  return header;
}

void DeflateWriter::put(std::uint64_t bits, unsigned count) {
  bits_ |= bits << bit_count_;
  bit_count_ += count;
  if (bit_count_ >= 32) flush_bits();
}

void DeflateWriter::flush_bits() {
  const unsigned bytes = bit_count_ / 8;
  const std::size_t at = out_->size();
  out_->resize(at + bytes);
  store_little(out_->data() + at, bits_, bytes);
  bits_ = bytes == 8 ? 0 : bits_ >> (8 * bytes);
  bit_count_ -= 8 * bytes;
}

void DeflateWriter::add(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t count = std::min(bytes.size(), kBlockBytes);
    write_block(bytes.first(count));
    bytes = bytes.subspan(count);
  }
}

void DeflateWriter::finish() {
  put(0b011, 3);  // final, fixed codes
  put(0, 7);      // end of block
  bit_count_ = (bit_count_ + 7) / 8 * 8;
  flush_bits();
}

namespace {

/// Whole bits that one occurrence of each byte costs, rounded up, and so the run from which on a match is cheaper.
std::array<std::uint32_t, 256> shortest_worthwhile_runs(const std::array<std::uint32_t, 256>& counts,
                                                        std::size_t total) {
  constexpr unsigned kMatchBits = 14;  // length symbol, its extra bits, one bit of distance
  std::array<std::uint32_t, 256> runs{};
  for (std::size_t byte = 0; byte < counts.size(); ++byte) {
    unsigned bits = 1;
    while (bits < kMatchBits && (std::uint64_t{counts[byte]} << bits) < total) ++bits;
    runs[byte] = std::max(4U, (kMatchBits + bits - 1) / bits + 1);
  }
  return runs;
}

/// Bytes to tokens: literals, and repetitions of the byte before.
void tokenise(std::span<const std::byte> bytes, const std::array<std::uint32_t, 256>& shortest,
              std::vector<std::uint16_t>& tokens) {
  tokens.resize(bytes.size());
  std::uint16_t* out = tokens.data();
  for (std::size_t i = 0; i < bytes.size();) {
    const auto byte = std::to_integer<std::uint16_t>(bytes[i]);
    *out++ = byte;
    std::size_t end = i + 1;
    while (end < bytes.size() && bytes[end] == bytes[i]) ++end;
    std::size_t repeats = end - i - 1;
    if (repeats >= shortest[byte]) {
      while (repeats >= 3) {
        const std::size_t length = std::min(repeats, kMaxRun);
        *out++ = static_cast<std::uint16_t>(256 + length);
        repeats -= length;
      }
    }
    for (; repeats > 0; --repeats) *out++ = byte;
    i = end;
  }
  tokens.resize(static_cast<std::size_t>(out - tokens.data()));
}

}  // namespace

void DeflateWriter::write_block(std::span<const std::byte> bytes) {
  const std::array<std::uint32_t, 256> counts = count_bytes(bytes);
  std::array<std::uint32_t, 288> frequencies{};
  std::uint64_t extra_bits = 0;
  bool has_matches = false;
  tokens_.clear();
  // Bytes that never take more than a quarter of a block do not come in runs worth a match.
  const bool may_have_runs = *std::max_element(counts.begin(), counts.end()) > bytes.size() / 4;
  if (may_have_runs) {
    tokenise(bytes, shortest_worthwhile_runs(counts, bytes.size()), tokens_);
  } else {
    std::copy(counts.begin(), counts.end(), frequencies.begin());
  }
  for (const std::uint16_t token : tokens_) {
    if (token < 256) {
      ++frequencies[token];
    } else {
      const MatchCode& match = kMatchCodes[token - 256U];
      ++frequencies[match.symbol];
      extra_bits += match.extra_bits;
      has_matches = true;
    }
  }
  frequencies[kEndOfBlock] = 1;
  Code dynamic;
  build_code_lengths(frequencies, 15, dynamic.lengths);
  Code fixed;
  for (std::size_t symbol = 0; symbol < 288; ++symbol) {
    fixed.lengths[symbol] = symbol < 144 ? 8 : symbol < 256 ? 9 : symbol < 280 ? 7 : 8;
  }
  const Header header = describe(dynamic, has_matches);
  std::uint64_t dynamic_bits = header.bits + extra_bits;
  std::uint64_t fixed_bits = 3 + extra_bits;
  for (std::size_t symbol = 0; symbol < 286; ++symbol) {
    const std::uint64_t match_bit = symbol > kEndOfBlock ? 1 : 0;
    dynamic_bits += frequencies[symbol] * (dynamic.lengths[symbol] + match_bit);
    fixed_bits += frequencies[symbol] * (fixed.lengths[symbol] + 5 * match_bit);
  }
  const std::uint64_t stored_bits = 8 * bytes.size() + 40 * ((bytes.size() + 65534) / 65535) + 7;
  if (stored_bits <= std::min(dynamic_bits, fixed_bits)) {
    write_stored(bytes);
  } else if (fixed_bits <= dynamic_bits) {
    put(0b010, 3);
    assign_codes(fixed.lengths, fixed.codes);
    may_have_runs ? write_tokens(fixed, 5) : write_literals(fixed, bytes);
  } else {
    assign_codes(dynamic.lengths, dynamic.codes);
    write_header(header);
    may_have_runs ? write_tokens(dynamic, header.distance_length) : write_literals(dynamic, bytes);
  }
}

void DeflateWriter::write_stored(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t count = std::min<std::size_t>(bytes.size(), 65535);
    put(0, 3);
    bit_count_ = (bit_count_ + 7) / 8 * 8;
    flush_bits();
    put(count | (~count & 0xffffU) << 16U, 32);
    flush_bits();
    out_->insert(out_->end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
    bytes = bytes.subspan(count);
  }
}

void DeflateWriter::write_header(const Header& header) {
  put(0b100, 3);
  put(header.literal_count - 257, 5);
  put(0, 5);  // one distance code
  put(header.length_count - 4, 4);
  for (unsigned i = 0; i < header.length_count; ++i) put(header.lengths[kLengthOrder[i]], 3);
  for (const std::uint16_t run : header.runs) {
    const unsigned symbol = run & 31U;
    put(header.codes[symbol], header.lengths[symbol]);
    if (symbol >= 16) put(run >> 5U, symbol == 16 ? 2 : symbol == 17 ? 3 : 7);
  }
}

template <typename Write>
void DeflateWriter::write_codes(const Code& code, std::size_t most_bytes, Write write) {
  const std::size_t at = out_->size();
  out_->resize(at + most_bytes + 16);
  BitsOut to = {out_->data() + at, bits_, bit_count_};
  write(to);
  out_->resize(static_cast<std::size_t>(to.next - out_->data()));
  bits_ = to.bits;
  bit_count_ = to.count;
  put(code.codes[kEndOfBlock], code.lengths[kEndOfBlock]);
}

void DeflateWriter::write_tokens(const Code& code, unsigned distance_bits) {
  // The distance is always 1: code 0, all zero bits. 26 bits at most a token, so 4 bytes' room each.
  write_codes(code, 4 * tokens_.size(), [&](BitsOut& to) {
    for (const std::uint16_t token : tokens_) {
      if (token < 256) {
        to.put(code.codes[token], code.lengths[token]);
      } else {
        const MatchCode& match = kMatchCodes[token - 256U];
        to.put(code.codes[match.symbol], code.lengths[match.symbol]);
        to.put(match.extra, match.extra_bits + distance_bits);
      }
      to.flush_words();
    }
  });
}

void DeflateWriter::write_literals(const Code& code, std::span<const std::byte> bytes) {
  write_codes(code, 2 * bytes.size(), [&](BitsOut& to) {
    const auto add = [&](std::byte byte) {
      const auto symbol = std::to_integer<std::size_t>(byte);
      to.put(code.codes[symbol], code.lengths[symbol]);
    };
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
      add(bytes[i]);
      if (i + 1 < bytes.size()) add(bytes[i + 1]);
      to.flush_words();  // 31 + 2·15 bits fit
    }
  });
}

}  // namespace isohf
