#include "isohf/archive/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <random>

#include "isohf/archive/void_mask.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

std::vector<std::byte> inflate_with_zlib(const std::vector<std::byte>& deflated, std::size_t size) {
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
        ASSERT_EQ(inflate_with_zlib(deflated, size), bytes);
        std::vector<std::byte> back(size);
        inflate_exactly(deflated, back);
        ASSERT_EQ(back, bytes);
        EXPECT_LE(deflated.size(), size + size / 4096 + 32);  // never much more than stored
      }
    }
  }
}

TEST(CodeLengths, AreACompletePrefixCodeWithinTheLimit) {
  std::mt19937 random(3);
  for (const unsigned limit : {7U, 15U}) {
    for (std::size_t symbols = 2; symbols <= (limit == 7 ? 19U : 286U); symbols += 3) {
      std::vector<std::uint32_t> frequencies(symbols);
      std::uint64_t a = 1, b = 1;
      for (std::uint32_t& frequency : frequencies) {  // Fibonacci numbers make the deepest trees
        frequency = symbols % 2 == 0 ? static_cast<std::uint32_t>(std::min<std::uint64_t>(a, 1U << 30U))
                                     : static_cast<std::uint32_t>(random() % 1000 + 1);
        b = std::min<std::uint64_t>(a + b, 1U << 30U);
        std::swap(a, b);
      }
      std::vector<std::uint8_t> lengths(symbols);
      build_code_lengths(frequencies, limit, lengths);
      std::uint64_t filled = 0;
      for (const std::uint8_t length : lengths) {
        ASSERT_GE(length, 1);
        ASSERT_LE(length, limit);
        filled += std::uint64_t{1} << (limit - length);
      }
      EXPECT_EQ(filled, std::uint64_t{1} << limit) << symbols;
      for (std::size_t i = 0; i < symbols; ++i) {
        for (std::size_t j = 0; j < symbols; ++j) {
          if (frequencies[i] > frequencies[j]) {
            ASSERT_LE(lengths[i], lengths[j]);
          }
        }
      }
    }
  }
}

TEST(CodeLengths, GiveALoneSymbolOneBit) {
  const std::vector<std::uint32_t> frequencies = {0, 0, 9};
  std::vector<std::uint8_t> lengths(3, 5);
  build_code_lengths(frequencies, 15, lengths);
  EXPECT_EQ(lengths, (std::vector<std::uint8_t>{0, 0, 1}));
}

TEST(Inflate, WantsExactlyTheStatedSizes) {
  const std::vector<std::byte> bytes = make_bytes(1000, 40, 3, 1);
  std::vector<std::byte> deflated = deflate_bytes(bytes);
  std::vector<std::byte> out(1000);
  inflate_exactly(deflated, out);
  EXPECT_EQ(out, bytes);
  out.resize(999);
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
  out.resize(1001);
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
  out.resize(1000);
  for (std::size_t size = 0; size < deflated.size(); ++size) {
    EXPECT_THROW(inflate_exactly(std::span<const std::byte>(deflated).first(size), out), Error);
  }
  deflated.push_back(std::byte{0});
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
}

TEST(VoidMask, BringsBackEveryMaskOfTenSamples) {
  for (unsigned mask = 0; mask < 1024; ++mask) {
    std::vector<std::uint8_t> is_void;
    for (unsigned i = 0; i < 10; ++i) is_void.push_back(static_cast<std::uint8_t>(mask >> i & 1U));
    EXPECT_EQ(unpack_void_mask(pack_void_mask(is_void), 10), is_void);
  }
}

TEST(VoidMask, BringsBackLongRuns) {
  std::vector<std::uint8_t> is_void(100000);
  std::fill(is_void.begin() + 127, is_void.begin() + 60000, std::uint8_t{1});
  EXPECT_EQ(unpack_void_mask(pack_void_mask(is_void), is_void.size()), is_void);
}

TEST(VoidMask, RefusesRunsThatDoNotAddUp) {
  const auto refuses = [](std::vector<int> runs, std::size_t samples) {
    std::vector<std::byte> packed;
    for (const int run : runs) packed.push_back(static_cast<std::byte>(run));
    EXPECT_THROW(static_cast<void>(unpack_void_mask(packed, samples)), Error);
  };
  refuses({}, 10);
  refuses({9}, 10);
  refuses({11}, 10);
  refuses({5, 6}, 10);
  refuses({5, 0, 5}, 10);      // an empty run inside
  refuses({5, 128 + 5}, 10);   // cut off
  refuses({128 + 10, 0}, 10);  // not the shortest form
  refuses({255, 255, 255, 255, 255, 255, 1}, 10);
  refuses({255, 255, 255, 255, 15}, 10);
}

}  // namespace
}  // namespace isohf
