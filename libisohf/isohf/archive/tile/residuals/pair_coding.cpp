#include "isohf/archive/tile/residuals/pair_coding.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/deflate/huffman_code.h"
#include "isohf/archive/tile/residuals/code_cost.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kFewSymbols = 256;         // below, a larger table eats the gain
constexpr std::uint64_t kBitsPerPairSymbol = 4;  // of a code length in a block header
constexpr unsigned kCodeLimit = 15;

/// What a Huffman code of these takes, table included.
std::uint64_t huffman_bits(const ByteCounts& counts) {
  std::array<std::uint8_t, 256> lengths{};
  build_code_lengths(counts, kCodeLimit, lengths);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    bits += std::uint64_t{counts[i]} * lengths[i] + (counts[i] != 0 ? kBitsPerPairSymbol : 0);
  }
  return bits;
}

/// A bound from below of the same: fast, and close for codes of many symbols.
std::uint64_t entropy_bits(const ByteCounts& counts) {
  std::uint64_t total = 0;
  std::uint64_t parts = 0;
  std::uint64_t used = 0;
  for (const std::uint32_t count : counts) {
    total += count;
    parts += n_log_n(count);
    used += count != 0 ? 1 : 0;
  }
  return ((n_log_n(total) - parts) >> 16U) + kBitsPerPairSymbol * used;
}

/// The bytes that a pair becomes, one or three.
template <typename Put>
void encode_pair(unsigned first, unsigned second, const Put& put) {
  if (first < kPairBase && second < kPairBase) return put(first * kPairBase + second);
  put(kPairEscape);
  put(first);
  put(second);
}

template <typename Put>
void encode_pairs(std::span<const std::byte> symbols, const Put& put) {
  const auto symbol = [&](std::size_t i) { return std::to_integer<unsigned>(symbols[i]); };
  std::size_t i = 0;
  for (; i + 2 <= symbols.size(); i += 2) encode_pair(symbol(i), symbol(i + 1), put);
  if (i < symbols.size()) encode_pair(symbol(i), 0, put);
}

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, "tile payload: " + why);
}

}  // namespace

bool pairs_pay(std::span<const std::byte> symbols) {
  if (symbols.size() < kFewSymbols) return false;
  const ByteCounts single = count_bytes(symbols);
  // Codes of many likely symbols waste little; so most contexts are done with here.
  if (*std::max_element(single.begin(), single.end()) < symbols.size() / 5) return false;
  // Two tables in turn, for the reason that count_bytes has four.
  std::array<ByteCounts, 2> paired{};
  std::size_t turn = 0;
  encode_pairs(symbols, [&](unsigned byte) {
    ++paired[turn][byte];
    turn ^= 1U;
  });
  for (std::size_t byte = 0; byte < paired[0].size(); ++byte) paired[0][byte] += paired[1][byte];
  const std::uint64_t bits = entropy_bits(paired[0]);
  return bits + bits / 64 < huffman_bits(single);
}

std::vector<std::byte> pair_symbols(std::span<const std::byte> symbols) {
  std::vector<std::byte> bytes;
  bytes.reserve(symbols.size());
  encode_pairs(symbols, [&](unsigned byte) { bytes.push_back(static_cast<std::byte>(byte)); });
  return bytes;
}

void unpair_symbols(ByteReader& reader, std::span<std::byte> symbols) {
  const std::span<const std::byte> bytes = reader.rest();
  std::size_t at = 0;
  for (std::size_t i = 0; i < symbols.size(); i += 2) {
    if (at == bytes.size()) refuse("its pairs of symbols end early");
    const auto byte = std::to_integer<unsigned>(bytes[at++]);
    unsigned first = byte / kPairBase;
    unsigned second = byte % kPairBase;
    if (byte >= kPairEscape) {
      if (byte > kPairEscape) refuse(fmt::format("a pair of symbols is {}, the last is {}", byte, kPairEscape));
      if (bytes.size() - at < 2) refuse("its pairs of symbols end early");
      first = std::to_integer<unsigned>(bytes[at]);
      second = std::to_integer<unsigned>(bytes[at + 1]);
      at += 2;
      if (first < kPairBase && second < kPairBase) {
        refuse(fmt::format("symbols {} and {} are written apart, they make a pair", first, second));
      }
    }
    symbols[i] = static_cast<std::byte>(first);
    if (i + 1 < symbols.size()) {
      symbols[i + 1] = static_cast<std::byte>(second);
    } else if (second != 0) {
      refuse(fmt::format("its last pair of symbols is filled with {}, must be 0", second));
    }
  }
  static_cast<void>(reader.read_bytes(at));
}

}  // namespace isohf
