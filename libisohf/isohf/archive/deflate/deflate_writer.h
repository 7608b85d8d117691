#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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
  struct BitsOut;

  static Header describe(const Code& code, bool has_matches);
  void put(std::uint64_t bits, unsigned count);
  void flush_bits();
  void write_block(std::span<const std::byte> bytes);
  void write_stored(std::span<const std::byte> bytes);
  void write_header(const Header& header);
  /// What write(BitsOut&) puts, most_bytes at most, and the end of the block.
  template <typename Write>
  void write_codes(const Code& code, std::size_t most_bytes, Write write);
  void write_literals(const Code& code, std::span<const std::byte> bytes);
  void write_tokens(const Code& code, unsigned distance_bits);

  std::vector<std::byte>* out_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
  std::vector<std::uint16_t> tokens_;  ///< below 256 a byte, from 256 on a repetition of the last byte by token-256
};

}  // namespace isohf
