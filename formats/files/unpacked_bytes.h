#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>

namespace isohf {

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
