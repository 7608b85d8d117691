#include "isohf/archive/deflate/deflate.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>

#include "isohf/archive/deflate/literal_inflater.h"
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
  if (inflate_literals(deflated, out)) return;
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

bool zlib_inflates(std::span<const std::byte> deflated, const std::function<bool(std::span<const std::byte>)>& take) {
  const auto bit = [&](std::uint64_t at) { return std::to_integer<unsigned>(deflated[at / 8]) >> (at % 8) & 1U; };
  const auto is_zero_to_next_byte = [&](std::uint64_t at) {
    return at % 8 == 0 || std::to_integer<unsigned>(deflated[at / 8]) >> (at % 8) == 0;
  };
  std::vector<std::byte> piece(std::size_t{1} << 16U);
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw Error(ErrorCode::kOutOfMemory, "no memory for zlib");
  // zlib reads through a pointer that it does not declare constant.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(deflated.data()));
  std::size_t given = 0;
  // Block by block, each from its three bits of header on.
  constexpr int kAtBlockEnd = 128;
  constexpr int kWasLast = 64;
  std::uint64_t begin = 0;
  bool is_whole = false;
  bool is_taken = true;
  while (begin + 3 <= 8 * deflated.size()) {
    if (bit(begin + 1) == 0 && bit(begin + 2) == 0 && !is_zero_to_next_byte(begin + 3)) break;
    int result = Z_OK;
    do {
      if (stream.avail_in == 0) {
        stream.avail_in = static_cast<uInt>(std::min<std::size_t>(deflated.size() - given, 1U << 30U));
        given += stream.avail_in;
      }
      stream.next_out = reinterpret_cast<Bytef*>(piece.data());
      stream.avail_out = static_cast<uInt>(piece.size());
      result = inflate(&stream, Z_BLOCK);
      is_taken = take(std::span(piece).first(piece.size() - stream.avail_out));
    } while (is_taken && result == Z_OK && (stream.data_type & kAtBlockEnd) == 0 &&
             (stream.avail_out == 0 || given < deflated.size()));
    if (!is_taken || result != Z_OK || (stream.data_type & kAtBlockEnd) == 0) break;
    begin = 8 * (given - stream.avail_in) - static_cast<std::uint64_t>(stream.data_type & 7);
    if ((stream.data_type & kWasLast) == 0) continue;
    is_whole = given == deflated.size() && stream.avail_in == 0 && is_zero_to_next_byte(begin);
    break;
  }
  inflateEnd(&stream);
  return is_whole;
}

bool zlib_inflates_to(std::span<const std::byte> deflated, std::span<const std::byte> expected) {
  auto rest = expected;
  const bool is_same = zlib_inflates(deflated, [&](std::span<const std::byte> piece) {
    if (piece.size() > rest.size() || !std::equal(piece.begin(), piece.end(), rest.begin())) return false;
    rest = rest.subspan(piece.size());
    return true;
  });
  return is_same && rest.empty();
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
