#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Deflate (RFC 1951) as the archive needs it: a writer of Huffman blocks for tile payloads, ordinary compression for
/// other members, and exact inflation.

namespace isohf {

/// Writes a raw Deflate stream block by block, each block with the cheapest of its own Huffman table, the fixed one and
/// none. The only matches it looks for are runs of one byte: residuals hold no others worth their bits.
///
/// One block ends where the caller says so, so that each context stream of a tile gets a table of its own.
class DeflateWriter {
 public:
  explicit DeflateWriter(std::vector<std::byte>& out) : out_(&out) {}

  /// Appends bytes as one or more blocks. O(bytes).
  void add(std::span<const std::byte> bytes);

  /// Ends the stream: an empty final block, and the last byte filled up with zero bits. Call once.
  void finish();

 private:
  /// Canonical Huffman code: lengths and bit-reversed codes by symbol.
  struct Code {
    std::array<std::uint8_t, 288> lengths{};
    std::array<std::uint16_t, 288> codes{};
  };
  /// How a dynamic block describes its code.
  struct Header;

  static Header describe(const Code& code, bool has_matches);
  void put(std::uint64_t bits, unsigned count);
  void flush_bits();
  void write_block(std::span<const std::byte> bytes);
  void write_stored(std::span<const std::byte> bytes);
  void write_header(const Header& header);
  void write_literals(const Code& code, std::span<const std::byte> bytes);
  void write_tokens(const Code& code, unsigned distance_bits);

  std::vector<std::byte>* out_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
  std::vector<std::uint16_t> tokens_;  ///< below 256 a byte, from 256 on a repetition of the last byte by token-256
};

/// Shortest prefix code with no code longer than `limit` bits (nearly shortest where the limit bites); lengths are 0
/// for symbols of frequency 0. A single symbol gets length 1.
void build_code_lengths(std::span<const std::uint32_t> frequencies, unsigned limit, std::span<std::uint8_t> lengths);

/// Raw Deflate of any bytes, at one of libdeflate's levels, 1 to 12.
[[nodiscard]] std::vector<std::byte> deflate_bytes(std::span<const std::byte> bytes, int level = 9);

/// Inflates a raw Deflate stream that must fill `out` exactly and use up `deflated` exactly. Throws Error{kCorrupt}.
/// Thread-safe.
void inflate_exactly(std::span<const std::byte> deflated, std::span<std::byte> out);

/// Inflates with zlib, the reference that every archive must satisfy: true where it makes exactly `expected`.
/// libdeflate is laxer about code tables that zlib calls invalid.
[[nodiscard]] bool zlib_inflates_to(std::span<const std::byte> deflated, std::span<const std::byte> expected);

/// CRC-32 as ZIP has it; `seed` continues an earlier one.
[[nodiscard]] std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t seed = 0);

}  // namespace isohf
