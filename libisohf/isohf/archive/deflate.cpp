#include "isohf/archive/deflate.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <memory>

#include "isohf/archive/literal_inflater.h"
#include "isohf/base/error.h"

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

bool zlib_inflates_to(std::span<const std::byte> deflated, std::span<const std::byte> expected) {
  std::vector<std::byte> out(expected.size() + 1);  // one to spare, so that a longer stream shows
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw Error(ErrorCode::kOutOfMemory, "no memory for zlib");
  // Tiles and members are far below 4 GiB; zlib reads through a pointer that it does not declare constant.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(deflated.data()));
  stream.avail_in = static_cast<uInt>(deflated.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int result = inflate(&stream, Z_FINISH);
  const bool whole = result == Z_STREAM_END && stream.avail_in == 0 && stream.total_out == expected.size();
  inflateEnd(&stream);
  return whole && std::equal(expected.begin(), expected.end(), out.begin());
}

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t seed) {
  if (bytes.empty()) return seed;  // libdeflate takes a null pointer for a wish to start anew
  return libdeflate_crc32(seed, bytes.data(), bytes.size());
}

}  // namespace isohf
