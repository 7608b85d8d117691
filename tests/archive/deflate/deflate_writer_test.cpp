#include "isohf/archive/deflate/deflate_writer.h"

#include <gtest/gtest.h>

#include <random>

#include "archive/deflate/zlib_inflate.h"
#include "isohf/archive/deflate/deflate.h"

namespace isohf {
namespace {

/// Bytes with values below `values`, each repeated up to `run` times.
std::vector<std::byte> make_bytes(std::size_t size, unsigned values, unsigned run, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes;
  while (bytes.size() < size) {
    const auto byte = static_cast<std::byte>(static_cast<unsigned>(random()) % values);
    for (unsigned i = static_cast<unsigned>(random()) % run + 1; i > 0 && bytes.size() < size; --i)
      bytes.push_back(byte);
  }
  return bytes;
}

TEST(DeflateWriter, IsReadByZlib) {
  for (const unsigned values : {1U, 2U, 3U, 17U, 256U}) {
    for (const unsigned run : {1U, 5U, 700U}) {
      for (const std::size_t size : {0, 1, 2, 3, 4, 10, 257, 258, 259, 260, 1000, 65535, 65536, 300000}) {
        SCOPED_TRACE(::testing::Message() << values << " values, runs up to " << run << ", " << size << " bytes");
        const std::vector<std::byte> bytes = make_bytes(size, values, run, 7);
        std::vector<std::byte> deflated;
        DeflateWriter writer(deflated);
        const std::span<const std::byte> all(bytes);
        writer.add(all.first(size / 3));
        writer.add(all.subspan(size / 3));
        writer.finish();
        ASSERT_EQ(test::inflate_with_zlib(deflated, size), bytes);
        std::vector<std::byte> back(size);
        inflate_exactly(deflated, back);
        ASSERT_EQ(back, bytes);
        EXPECT_LE(deflated.size(), size + size / 4096 + 32);  // never much more than stored
      }
    }
  }
}

}  // namespace
}  // namespace isohf
