#include "isohf/archive/tile/residuals/pair_coding.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <random>

#include "archive/tile/tiles.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/archive/tile/tile_payload.h"

namespace isohf {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

std::vector<std::byte> unpair(const std::vector<std::byte>& bytes, std::size_t count) {
  std::vector<std::byte> symbols(count);
  ByteReader reader(bytes);
  unpair_symbols(reader, symbols);
  EXPECT_EQ(reader.remaining(), 0U);
  return symbols;
}

/// Symbols of which `zeros` in a thousand are 0, and the others below `limit`.
std::vector<std::byte> symbols_with_zeros(std::size_t count, unsigned zeros, unsigned limit) {
  std::mt19937 random(static_cast<unsigned>(count) + zeros);
  std::vector<std::byte> symbols(count);
  for (std::byte& symbol : symbols) {
    symbol = static_cast<std::byte>(random() % 1000 < zeros ? 0U : static_cast<unsigned>(random()) % limit);
  }
  return symbols;
}

TEST(PairCoding, IsWhatThePageSays) {
  EXPECT_EQ(pair_symbols(bytes_of({0, 0, 14, 14, 1, 2})), bytes_of({0, 224, 17}));
  EXPECT_EQ(pair_symbols(bytes_of({15, 0, 0, 239, 3})), bytes_of({225, 15, 0, 225, 0, 239, 45}));
  EXPECT_TRUE(pair_symbols({}).empty());
}

TEST(PairCoding, BringsBackEverySymbolForAnyCount) {
  for (std::size_t count = 0; count < 40; ++count) {
    for (const unsigned limit : {1U, 15U, 16U, 240U}) {
      const std::vector<std::byte> symbols = symbols_with_zeros(count, 300, limit);
      EXPECT_EQ(unpair(pair_symbols(symbols), count), symbols) << count << " below " << limit;
    }
  }
}

TEST(PairCoding, RefusesWhatItWouldNotWrite) {
  const auto refused = [](std::initializer_list<int> bytes, std::size_t count) {
    const std::vector<std::byte> pairs = bytes_of(bytes);
    std::vector<std::byte> symbols(count);
    ByteReader reader(pairs);
    EXPECT_THROW(unpair_symbols(reader, symbols), Error) << *bytes.begin();
  };
  refused({226}, 2);  // no pair
  refused({255}, 2);
  refused({225, 3, 4}, 2);  // written apart without need
  refused({1}, 1);          // filled with 1
  refused({225, 15, 1}, 1);
  refused({0}, 3);  // ends early
  refused({225, 15}, 2);
  refused({225}, 2);
}

TEST(PairCoding, PaysWhereMostSymbolsAreAlike) {
  EXPECT_TRUE(pairs_pay(symbols_with_zeros(10000, 800, 4)));   // 1 bit of doubt, no less than 1.2 in single codes
  EXPECT_FALSE(pairs_pay(symbols_with_zeros(10000, 0, 100)));  // nothing to gain
  EXPECT_FALSE(pairs_pay(symbols_with_zeros(20, 900, 4)));     // too few for a table
  EXPECT_FALSE(pairs_pay({}));
}

TEST(PairCoding, MakesTilesOfLittleDoubtSmaller) {
  // A plane with a step of one here and there: residuals are 0, seldom 1 or 2.
  const TileShape shape = TileShape::make(100, 99, 1);
  std::mt19937 random(3);
  TileCodes tile{CodeType::kU16, {}, {}};
  for (std::int64_t i = 0; i < shape.stored_vertex_count(); ++i) {
    tile.codes.push_back(static_cast<std::uint16_t>(1000 + (random() % 8 == 0 ? 1 : 0)));
  }
  const EncodedTile encoded = encode_tile(shape, tile, Effort::kDefault, PayloadVersion::kFirst);
  const std::vector<std::byte> payload = test::payload_of(encoded);
  ByteReader reader(payload);
  EXPECT_NE(read_payload_header(shape, CodeType::kU16, reader).paired, 0);
  EXPECT_LT(8.0 * static_cast<double>(encoded.deflated.size()), 0.95 * static_cast<double>(tile.codes.size()));
  EXPECT_EQ(decode_tile(shape, CodeType::kU16, payload), tile);
  EXPECT_EQ(decode_tile_slowly(shape, CodeType::kU16, payload), tile);
}

}  // namespace
}  // namespace isohf
