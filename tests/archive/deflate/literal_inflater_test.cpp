#include "isohf/archive/deflate/literal_inflater.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>

#include "archive/tile/tiles.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/archive/tile/tile_codes.h"

namespace isohf {
namespace {

using Bytes = std::vector<std::byte>;

/// What libdeflate makes of a stream; nothing where it refuses it or does not use it up.
std::optional<Bytes> reference(const Bytes& deflated, std::size_t size) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  Bytes out(size + 1);
  std::size_t used = 0;
  const auto result = libdeflate_deflate_decompress_ex(decompressor.get(), deflated.data(), deflated.size(), out.data(),
                                                       size, &used, nullptr);
  if (result != LIBDEFLATE_SUCCESS || used != deflated.size()) return std::nullopt;
  out.resize(size);
  return out;
}

Bytes deflate(const std::vector<Bytes>& blocks) {
  Bytes out;
  DeflateWriter writer(out);
  for (const Bytes& block : blocks) writer.add(block);
  writer.finish();
  return out;
}

/// Bytes of a geometric distribution: `doubt` of 256 say how likely the next value is.
Bytes skewed(std::size_t count, unsigned doubt, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes bytes(count);
  for (std::byte& byte : bytes) {
    unsigned value = 0;
    while (value < 255 && (random() & 255U) < doubt) ++value;
    byte = static_cast<std::byte>(value);
  }
  return bytes;
}

TEST(LiteralInflater, TakesWhatTheWriterMakes) {
  for (const unsigned doubt : {0U, 1U, 20U, 128U, 200U, 240U, 253U, 255U}) {
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{9}, std::size_t{10},
                                    std::size_t{11}, std::size_t{300}, std::size_t{5000}, std::size_t{200000}}) {
      const Bytes first = skewed(count, doubt, 1);
      const Bytes second = skewed(777, 255 - doubt, 2);
      Bytes all = first;
      all.insert(all.end(), second.begin(), second.end());
      Bytes out(all.size());
      ASSERT_TRUE(inflate_literals(deflate({first, second}), out)) << doubt << ", " << count;
      ASSERT_EQ(out, all);
    }
  }
}

TEST(LiteralInflater, TakesNoiseThatIsStoredAndCodesLongerThanItsTable) {
  std::mt19937 random(3);
  Bytes noise(70000);
  for (std::byte& byte : noise) byte = static_cast<std::byte>(random());
  Bytes steep;  // frequencies double from symbol to symbol: codes of up to 15 bits
  for (unsigned symbol = 0; symbol < 17; ++symbol)
    steep.insert(steep.end(), std::size_t{1} << symbol, std::byte(symbol));
  std::shuffle(steep.begin(), steep.end(), random);
  for (const Bytes& bytes : {noise, steep}) {
    Bytes out(bytes.size());
    ASSERT_TRUE(inflate_literals(deflate({bytes}), out));
    ASSERT_EQ(out, bytes);
  }
}

TEST(LiteralInflater, TakesTheTilesOfEveryEffort) {
  const TileShape shape = TileShape::make(68, 67, 1);
  for (const Effort effort : {Effort::kFast, Effort::kDefault, Effort::kBest}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
      for (const test::Kind kind : test::kAllKinds) {
        const EncodedTile tile = encode_tile(shape, test::make_tile(shape, type, kind, 5), effort);
        if (tile.is_empty) continue;
        Bytes out(tile.payload_bytes);
        ASSERT_TRUE(inflate_literals(tile.deflated, out)) << level_of(effort) << " " << to_string(type);
        ASSERT_EQ(out, reference(tile.deflated, out.size()));
      }
    }
  }
}

TEST(LiteralInflater, LeavesOtherStreamsToAGeneralDecoder) {
  Bytes bytes;
  for (int i = 0; i < 3000; ++i) bytes.push_back(static_cast<std::byte>((i * i) % 251));  // comes again every 251
  const Bytes deflated = deflate_bytes(bytes);
  Bytes out(bytes.size());
  EXPECT_FALSE(inflate_literals(deflated, out));
  inflate_exactly(deflated, out);
  EXPECT_EQ(out, bytes);
}

TEST(LiteralInflater, RefusesEveryTruncationAndEveryOtherSize) {
  const Bytes bytes = skewed(3000, 180, 7);
  Bytes deflated = deflate({bytes, bytes});
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, 2 * bytes.size() - 1, 2 * bytes.size() + 1}) {
    Bytes out(size);
    EXPECT_FALSE(inflate_literals(deflated, out)) << size;
  }
  Bytes out(2 * bytes.size());
  ASSERT_TRUE(inflate_literals(deflated, out));
  deflated.push_back(std::byte{0});
  EXPECT_FALSE(inflate_literals(deflated, out));
  deflated.pop_back();
  while (!deflated.empty()) {
    deflated.pop_back();
    ASSERT_FALSE(inflate_literals(deflated, out)) << deflated.size();
  }
}

/// Flipped bits and noise: whatever is taken, the reference takes as well, and makes the same of it.
TEST(LiteralInflater, TakesNothingThatTheReferenceRefuses) {
  std::mt19937 random(11);
  int taken = 0;
  for (const unsigned doubt : {60U, 180U, 250U}) {
    const Bytes good = deflate({skewed(40, doubt, 1), skewed(90, 255 - doubt, 2), skewed(3, 255, 3)});
    Bytes out(133);
    ASSERT_TRUE(inflate_literals(good, out));
    const auto check = [&](const Bytes& stream) {
      // Exactly as much memory as is stated, so that the sanitizers see every byte too many.
      const Bytes exact(stream.begin(), stream.end());
      Bytes made(133);
      if (!inflate_literals(exact, made)) return;
      ++taken;
      ASSERT_EQ(made, reference(exact, made.size()));
    };
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Bytes broken = good;
      broken[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      check(broken);
    }
    for (int round = 0; round < 20000; ++round) {
      Bytes broken = good;
      for (std::size_t i = random() % broken.size(), n = 1 + random() % 4; n > 0; --n, i = random() % broken.size()) {
        broken[i] = static_cast<std::byte>(random());
      }
      check(broken);
    }
  }
  EXPECT_GT(taken, 100);
}

}  // namespace
}  // namespace isohf
