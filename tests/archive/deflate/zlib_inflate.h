#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstddef>
#include <vector>

namespace isohf::test {

/// What zlib, which knows nothing of us, makes of a raw Deflate stream of `size` bytes, all of which it has to take.
inline std::vector<std::byte> inflate_with_zlib(const std::vector<std::byte>& deflated, std::size_t size) {
  std::vector<std::byte> out(size + 1);
  z_stream stream{};
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(deflated.data()));
  stream.avail_in = static_cast<uInt>(deflated.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflateInit2(&stream, -MAX_WBITS), Z_OK);
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END) << (stream.msg == nullptr ? "" : stream.msg);
  EXPECT_EQ(stream.avail_in, 0U);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

}  // namespace isohf::test
