#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "isohf/error.h"

namespace isohf {

static_assert(std::endian::native == std::endian::little, "numbers in files have the lowest byte first, as in memory");

/// The number whose bytes stand at a place, lowest first, aligned or not.
template <typename T>
[[nodiscard]] T load_little(const void* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

/// Puts the bytes of a number, lowest first; of more than there is room for the first `count`.
template <typename T>
void store_little(void* at, T value, std::size_t count = sizeof(T)) {
  std::memcpy(at, &value, count);
}

/// Reads little-endian fields from a byte span; a read past the end throws Error{kCorrupt} naming the byte offset.
class ByteReader {
 public:
  /// `base_offset_bytes` is where the span starts in its file; it only appears in messages.
  explicit ByteReader(std::span<const std::byte> bytes, std::uint64_t base_offset_bytes = 0)
      : bytes_(bytes), base_(base_offset_bytes) {}

  template <typename T>
  [[nodiscard]] T read() {
    static_assert(std::is_arithmetic_v<T>);
    require(sizeof(T));
    const T value = load_little<T>(bytes_.data() + position_);
    position_ += sizeof(T);
    return value;
  }

  [[nodiscard]] std::span<const std::byte> read_bytes(std::size_t count) {
    require(count);
    auto part = bytes_.subspan(position_, count);
    position_ += count;
    return part;
  }

  /// What has not been read yet.
  [[nodiscard]] std::span<const std::byte> rest() const { return bytes_.subspan(position_); }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

 private:
  void require(std::size_t count) const {
    if (count > remaining()) {
      throw Error(ErrorCode::kCorrupt, "ends early: " + std::to_string(count) + " bytes wanted at byte " +
                                           std::to_string(base_ + position_) + ", " + std::to_string(remaining()) +
                                           " left");
    }
  }

  std::span<const std::byte> bytes_;
  std::uint64_t base_;
  std::size_t position_ = 0;
};

/// Appends little-endian fields to a byte vector.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& out) : out_(&out) {}

  template <typename T>
  void write(T value) {
    static_assert(std::is_arithmetic_v<T>);
    const std::size_t at = out_->size();
    out_->resize(at + sizeof(T));
    store_little(out_->data() + at, value);
  }

  void write_bytes(std::span<const std::byte> bytes) { out_->insert(out_->end(), bytes.begin(), bytes.end()); }

 private:
  std::vector<std::byte>* out_;
};

}  // namespace isohf
