#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/base/bytes.h"

/// Numbers as symbols in several streams and some bits more (docs/archive_format.md, "Shadow seeds").

namespace isohf {

/// Collects numbers; small ones cost a symbol alone.
class SymbolWriter {
 public:
  explicit SymbolWriter(std::size_t streams) : streams_(streams) {}

  void put(std::size_t stream, std::uint32_t value);

  /// Appends symbol counts, symbols and bits to the header, and compresses: each stream gets a Huffman table of its
  /// own.
  [[nodiscard]] EncodedSeeds finish(std::vector<std::byte> header);

 private:
  std::vector<std::vector<std::byte>> streams_;
  std::vector<std::byte> extra_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
};

/// Reads them back; everything throws Error{kCorrupt}.
class SymbolReader {
 public:
  /// Takes counts, symbols and bits, which must be all that is left.
  SymbolReader(ByteReader& reader, std::size_t streams);

  [[nodiscard]] std::uint32_t get(std::size_t stream);
  /// Symbols that the stream still has.
  [[nodiscard]] std::uint64_t left(std::size_t stream) const { return streams_[stream].size() - next_[stream]; }
  /// Everything must have been read.
  void finish() const;

 private:
  std::vector<std::span<const std::byte>> streams_;
  std::vector<std::size_t> next_;
  std::span<const std::byte> extra_;
  std::size_t extra_next_ = 0;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
};

}  // namespace isohf
