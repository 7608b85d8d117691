#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isohf/base/bytes.h"
#include "isohf/base/memory/scratch.h"

/// Numbers of some bits each, the lowest bit of a byte first.

namespace isohf {

/// A LEB128 number: 7 bits a byte, low ones first, bit 7 set on all but the last.
inline void append_leb128(std::size_t value, std::vector<std::byte>& out) {
  for (; value >= 128; value >>= 7U) out.push_back(static_cast<std::byte>(128 | (value & 127)));
  out.push_back(static_cast<std::byte>(value));
}

/// Takes such a number of five bytes at most from the front; nullopt when it is cut off, longer, or not in shortest form.
inline std::optional<std::size_t> take_leb128(std::span<const std::byte>& bytes) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(bytes.size(), 5); ++i) {
    const auto byte = std::to_integer<unsigned>(bytes[i]);
    value |= std::size_t{byte & 127U} << (7 * i);
    if (byte >= 128) continue;
    bytes = bytes.subspan(i + 1);
    return byte == 0 && i > 0 ? std::nullopt : std::optional(value);
  }
  return std::nullopt;
}

/// Bits from a span, the lowest of a byte first; zeros past its end.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes.begin(), bytes.end()), end_(8 * bytes.size()) {
    bytes_.resize(bytes.size() + sizeof(std::uint64_t));
  }

  /// Up to 32 bits.
  std::uint32_t take(unsigned count) {
    const std::uint64_t bits = rest();
    position_ += count;
    return static_cast<std::uint32_t>(bits & ((std::uint64_t{1} << count) - 1));
  }

  [[nodiscard]] bool ran_out() const { return position_ > end_; }
  /// True where all bytes were used and the bits left over in the last one are zero.
  [[nodiscard]] bool is_used_up() const { return end_ - position_ < 8 && rest() == 0; }

 private:
  [[nodiscard]] std::uint64_t rest() const {
    std::uint64_t bits = 0;
    if (position_ < end_) bits = load_little<std::uint64_t>(bytes_.data() + position_ / 8);
    return bits >> position_ % 8;
  }

  std::vector<std::byte> bytes_;
  std::uint64_t end_;
  std::uint64_t position_ = 0;
};

/// Bits one after the other, the lowest of a byte first.
class BitPacker {
 public:
  /// `most_bytes` is the most that will come.
  explicit BitPacker(std::size_t most_bytes) : room_(most_bytes + 8), to_(room_.data()) {}

  void put(std::uint32_t bits, unsigned count) {
    bits_ |= std::uint64_t{bits} << bit_count_;
    bit_count_ += count;
    if (bit_count_ < 32) return;
    store_little(to_, bits_, 4);
    to_ += 4;
    bits_ >>= 32U;
    bit_count_ -= 32;
  }
  /// As many as 56 bits; where all are put so.
  void put_many(std::uint64_t bits, unsigned count) {
    bits_ |= bits << bit_count_;
    store_little(to_, bits_);
    bit_count_ += count;
    to_ += bit_count_ / 8;
    bits_ >>= bit_count_ / 8 * 8;
    bit_count_ %= 8;
  }
  [[nodiscard]] std::vector<std::byte> finish() {
    store_little(to_, bits_);
    return {room_.data(), to_ + (bit_count_ + 7) / 8};
  }

 private:
  Scratch<std::byte> room_;
  std::byte* to_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
};

}  // namespace isohf
