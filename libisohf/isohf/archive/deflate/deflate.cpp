#include "isohf/archive/deflate/deflate.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>

#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {

std::vector<std::byte> deflate_bytes(std::span<const std::byte> bytes, int level) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), &libdeflate_free_compressor);
  if (compressor == nullptr) throw Error(ErrorCode::kOutOfMemory, "no memory for a compressor");
  std::vector<std::byte> out(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()));
  out.resize(libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

void inflate_exactly(std::span<const std::byte> deflated, std::span<std::byte> out) {
  thread_local const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  if (decompressor == nullptr) throw Error(ErrorCode::kOutOfMemory, "no memory for a decompressor");
  std::size_t used = 0;
  std::size_t made = 0;
  std::byte nothing{};  // libdeflate wants a place to write to, even for no bytes
  const libdeflate_result result =
      libdeflate_deflate_decompress_ex(decompressor.get(), deflated.data(), deflated.size(),
                                       out.empty() ? &nothing : out.data(), out.size(), &used, &made);
  if (result == LIBDEFLATE_INSUFFICIENT_SPACE) {
    throw Error(ErrorCode::kCorrupt, fmt::format("inflates to more than the {} bytes that are stated", out.size()));
  }
  if (result != LIBDEFLATE_SUCCESS) throw Error(ErrorCode::kCorrupt, "is no valid Deflate stream");
  if (made != out.size()) {
    throw Error(ErrorCode::kCorrupt, fmt::format("inflates to {} bytes where {} are stated", made, out.size()));
  }
  if (used != deflated.size()) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("its Deflate stream ends after {} of {} bytes", used, deflated.size()));
  }
}

bool inflate_in_pieces(std::span<const std::byte> deflated,
                       const std::function<bool(std::span<const std::byte>)>& take) {
  std::vector<std::byte> piece(std::size_t{1} << 16U);
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw Error(ErrorCode::kOutOfMemory, "no memory for zlib");
  // zlib reads through a pointer that it does not declare constant.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(deflated.data()));
  std::size_t given = 0;
  int result = Z_OK;
  bool is_taken = true;
  while (is_taken && result == Z_OK) {
    if (stream.avail_in == 0) {
      stream.avail_in = static_cast<uInt>(std::min<std::size_t>(deflated.size() - given, 1U << 30U));
      given += stream.avail_in;
    }
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    result = inflate(&stream, Z_NO_FLUSH);  // Z_BUF_ERROR at an early end
    is_taken = take(std::span(piece).first(piece.size() - stream.avail_out));
  }
  const bool is_whole = is_taken && result == Z_STREAM_END && given == deflated.size() && stream.avail_in == 0;
  inflateEnd(&stream);
  return is_whole;
}

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t seed) {
  if (bytes.empty()) return seed;  // libdeflate takes a null pointer for a wish to start anew
  return libdeflate_crc32(seed, bytes.data(), bytes.size());
}

std::uint32_t crc32_of_crc32(std::uint32_t crc, std::uint32_t seed) {
  std::array<std::byte, sizeof crc> bytes;
  store_little(bytes.data(), crc);
  return libdeflate_crc32(seed, bytes.data(), bytes.size());
}

}  // namespace isohf
