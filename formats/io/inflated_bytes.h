#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace isohf {

/// The contents of deflated data, readable at any offset, without holding them. Opening inflates all of it once and
/// checks it. The decoder's state is kept at up to 128 places (6 MiB) where it came by; a read goes on from the last
/// one's end or from the nearest place before. One thread at a time.
class InflatedBytes {
 public:
  enum class Kind { kGzip, kRawDeflate };
  /// Reads up to bytes.size() stored bytes at an offset; returns how many there were.
  using ReadStored = std::function<std::size_t(std::uint64_t offset_bytes, std::span<std::byte> bytes)>;

  /// `name` begins the messages. Gzip's own checksums and lengths are verified here, of members that follow each other
  /// too. Throws Error{kCorrupt} where the data are damaged or cut off.
  InflatedBytes(std::string name, ReadStored read_stored, Kind kind);
  /// Of data that have been checked and give `size_bytes` bytes: opening reads nothing.
  InflatedBytes(std::string name, ReadStored read_stored, Kind kind, std::uint64_t size_bytes);
  InflatedBytes(const InflatedBytes&) = delete;
  InflatedBytes& operator=(const InflatedBytes&) = delete;
  ~InflatedBytes();

  /// What reading contents of this size takes, places and working memory.
  [[nodiscard]] static std::uint64_t memory_bytes(std::uint64_t size_bytes);

  [[nodiscard]] std::uint64_t size_bytes() const;
  /// Of kRawDeflate's contents; 0 of gzip's, which are verified, and of what had been checked before.
  [[nodiscard]] std::uint32_t crc32() const;
  /// Returns how many of the bytes there were before the end. Throws Error{kIo, kCorrupt}.
  std::size_t read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Whether these first bytes of a file are of a gzip member with deflated data (RFC 1952).
[[nodiscard]] bool looks_like_gzip(std::span<const std::byte> head);

/// Inflates the beginning of a gzip file, given its first bytes; returns how many bytes came out.
std::size_t inflate_head(std::span<const std::byte> stored, std::span<std::byte> bytes);

/// Packed contents that are held in memory, all of them.
class UnpackedBytes {
 public:
  /// The contents of a gzip file, all its members, checked; nullopt where they are more than `most_bytes`, where they
  /// are damaged, or where there is no memory: InflatedBytes says which, or does without.
  [[nodiscard]] static std::optional<UnpackedBytes> from_gzip(std::span<const std::byte> stored,
                                                              std::uint64_t most_bytes);
  /// The same of deflated data without a header, which must give `size_bytes` bytes of this CRC-32.
  [[nodiscard]] static std::optional<UnpackedBytes> from_deflated(std::span<const std::byte> stored,
                                                                  std::uint64_t size_bytes, std::uint32_t crc32);

  [[nodiscard]] std::span<const std::byte> bytes() const { return {room_.get(), size_}; }

 private:
  UnpackedBytes() = default;
  /// Whether there is room now; what is there stays.
  [[nodiscard]] bool make_room(std::size_t bytes);

  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  // realloc moves the pages of large rooms instead of their bytes.
  std::unique_ptr<std::byte, Free> room_;
  std::size_t room_bytes_ = 0;
  std::size_t size_ = 0;
};

}  // namespace isohf
