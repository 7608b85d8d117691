#include "formats/files/unpacked_bytes.h"

#include <libdeflate.h>

#include <algorithm>

#include "isohf/base/bytes.h"

namespace isohf {
namespace {

/// Where a gzip member ends with its size.
constexpr std::size_t kSizeBytes = 4;
constexpr std::size_t kLeastRoomBytes = std::size_t{1} << 16U;
/// Deflate packs no better than this: a size that says more is no size.
constexpr std::uint64_t kMostRatio = 1032;

using Decompressor = std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>;

Decompressor make_decompressor() {
  return {libdeflate_alloc_decompressor(), &libdeflate_free_decompressor};
}

/// Zero bytes behind the last member are padding.
std::span<const std::byte> without_padding(std::span<const std::byte> stored) {
  const auto first = std::find_if(stored.begin(), stored.end(), [](std::byte byte) { return byte != std::byte{0}; });
  return stored.subspan(static_cast<std::size_t>(first - stored.begin()));
}

}  // namespace

bool UnpackedBytes::make_room(std::size_t bytes) {
  auto* const larger = static_cast<std::byte*>(std::realloc(room_.get(), bytes));
  if (larger == nullptr) return false;
  (void)room_.release();
  room_.reset(larger);
  room_bytes_ = bytes;
  return true;
}

std::optional<UnpackedBytes> UnpackedBytes::from_gzip(std::span<const std::byte> stored, std::uint64_t most_bytes) {
  const Decompressor decompressor = make_decompressor();
  if (!decompressor || stored.size() < kSizeBytes) return std::nullopt;
  // What the last member says of its size, modulo 2^32, is right for a file of one member, which nearly all are.
  const std::uint64_t said = ByteReader(stored.last(kSizeBytes)).read<std::uint32_t>();
  if (said > most_bytes || said > stored.size() * kMostRatio) return std::nullopt;
  UnpackedBytes unpacked;
  if (!unpacked.make_room(std::max<std::size_t>(static_cast<std::size_t>(said), 1))) return std::nullopt;
  do {
    std::size_t used = 0;
    std::size_t made = 0;
    const libdeflate_result result = libdeflate_gzip_decompress_ex(decompressor.get(), stored.data(), stored.size(),
                                                                   unpacked.room_.get() + unpacked.size_,
                                                                   unpacked.room_bytes_ - unpacked.size_, &used, &made);
    if (result == LIBDEFLATE_INSUFFICIENT_SPACE && unpacked.room_bytes_ < most_bytes) {
      const std::uint64_t more = std::max<std::uint64_t>(2 * std::uint64_t{unpacked.room_bytes_}, kLeastRoomBytes);
      if (!unpacked.make_room(static_cast<std::size_t>(std::min(more, most_bytes)))) return std::nullopt;
      continue;
    }
    if (result != LIBDEFLATE_SUCCESS) return std::nullopt;
    unpacked.size_ += made;
    stored = without_padding(stored.subspan(used));
  } while (!stored.empty());
  if (unpacked.size_ < unpacked.room_bytes_ && !unpacked.make_room(std::max<std::size_t>(unpacked.size_, 1))) {
    return std::nullopt;
  }
  return unpacked;
}

std::optional<UnpackedBytes> UnpackedBytes::from_deflated(std::span<const std::byte> stored, std::uint64_t size_bytes,
                                                          std::uint32_t crc32) {
  const Decompressor decompressor = make_decompressor();
  if (!decompressor || size_bytes > stored.size() * kMostRatio) return std::nullopt;
  UnpackedBytes unpacked;
  if (!unpacked.make_room(std::max<std::size_t>(static_cast<std::size_t>(size_bytes), 1))) return std::nullopt;
  unpacked.size_ = static_cast<std::size_t>(size_bytes);
  // Without a place for the number of bytes made, fewer than the room are an error.
  if (libdeflate_deflate_decompress_ex(decompressor.get(), stored.data(), stored.size(), unpacked.room_.get(),
                                       unpacked.size_, nullptr, nullptr) != LIBDEFLATE_SUCCESS ||
      libdeflate_crc32(0, unpacked.room_.get(), unpacked.size_) != crc32) {
    return std::nullopt;
  }
  return unpacked;
}

}  // namespace isohf
