#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "archive/deflate/zlib_inflate.h"
#include "archive/tile/tiles.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

using test::Kind;
using test::payload_of;

constexpr CodeType kAllTypes[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};

std::vector<TileShape> shapes() {
  return {TileShape::make(5, 5, 1),   TileShape::make(6, 5, 1),   TileShape::make(5, 7, 1),  TileShape::make(12, 11, 3),
          TileShape::make(24, 29, 1), TileShape::make(52, 67, 4), TileShape::make(300, 9, 1)};
}

TEST(TileCodec, BringsBackEverySampleOfEveryKindOfTile) {
  for (const TileShape& shape : shapes()) {
    for (const CodeType type : kAllTypes) {
      for (const Kind kind : test::kAllKinds) {
        for (std::uint32_t seed = 1; seed <= 3; ++seed) {
          SCOPED_TRACE(::testing::Message() << shape.columns() << "x" << shape.rows() << " " << to_string(type)
                                            << " kind " << static_cast<int>(kind) << " seed " << seed);
          const TileCodes tile = test::make_tile(shape, type, kind, seed);
          const EncodedTile encoded = encode_tile(shape, tile);
          EXPECT_EQ(encoded.content_digest, tile_content_digest(tile));
          ASSERT_EQ(encoded.is_empty, kind == Kind::kAllVoid);
          if (encoded.is_empty) continue;
          const std::vector<std::byte> payload = payload_of(encoded);
          EXPECT_EQ(payload, test::inflate_with_zlib(encoded.deflated, encoded.payload_bytes));
          EXPECT_EQ(crc32(payload), encoded.payload_crc32);
          EXPECT_LE(payload.size(), max_payload_bytes(shape, type));
          ASSERT_TRUE(test::same_samples(decode_tile(shape, type, payload), tile));
        }
      }
    }
  }
}

void expect_error(const TileShape& shape, CodeType type, const std::vector<std::byte>& payload, ErrorCode code) {
  EXPECT_EQ(test::error_of([&] { (void)decode_tile(shape, type, payload); }).code(), code);
}

TEST(TileCodec, BringsBackALargeTile) {
  const TileShape shape = TileShape::make(516, 515, 1);
  for (const Kind kind : {Kind::kTerrain, Kind::kNoise, Kind::kVoidNoise}) {
    const TileCodes tile = test::make_tile(shape, CodeType::kU16, kind, 5);
    EXPECT_EQ(decode_tile(shape, CodeType::kU16, payload_of(encode_tile(shape, tile))), tile);
  }
}

TEST(TileCodec, GivesTheSameBytesForTheSameTile) {
  const TileShape shape = TileShape::make(52, 67, 4);
  const TileCodes tile = test::make_tile(shape, CodeType::kU16, Kind::kVoidIsland, 9);
  EXPECT_EQ(encode_tile(shape, tile).deflated, encode_tile(shape, tile).deflated);
}

TEST(TileCodec, StatesTheRangeOfTheSamples) {
  const TileShape shape = TileShape::make(5, 5, 1);
  TileCodes tile{CodeType::kU16, std::vector<std::uint16_t>(25, 500), {}};
  tile.codes[3] = 65535;
  tile.codes[7] = 65534;
  tile.codes[9] = 2;
  const EncodedTile encoded = encode_tile(shape, tile);
  EXPECT_EQ(encoded.code_min, 2U);
  EXPECT_EQ(encoded.code_max, 65534U);
  EXPECT_TRUE(encoded.has_voids);
}

TEST(TileCodec, KeepsAConstantTileTiny) {
  const TileShape shape = TileShape::make(212, 243, 4);
  const EncodedTile encoded = encode_tile(shape, test::make_tile(shape, CodeType::kU16, Kind::kConstant, 1));
  EXPECT_LE(encoded.deflated.size(), 24U);
}

TEST(TileCodec, CountsEveryNaNAsTheSameVoid) {
  const TileShape shape = TileShape::make(5, 5, 1);
  TileCodes quiet{CodeType::kF32, {}, std::vector<float>(25, 1.0F)};
  TileCodes odd = quiet;
  quiet.heights[4] = std::bit_cast<float>(0x7fc00000U);
  odd.heights[4] = std::bit_cast<float>(0xffc12345U);
  EXPECT_EQ(encode_tile(shape, quiet).content_digest, encode_tile(shape, odd).content_digest);
  EXPECT_EQ(encode_tile(shape, quiet).deflated, encode_tile(shape, odd).deflated);
}

TEST(TileCodec, KeepsFloatsToTheLastBit) {
  const TileShape shape = TileShape::make(5, 5, 1);
  const std::uint32_t bits[] = {0x80000000U, 0U,          1U,          0x80000001U, 0x007fffffU,
                                0x00800000U, 0x7f7fffffU, 0xff7fffffU, 0x7f800000U, 0xff800000U,
                                0x3f800000U, 0x3f800001U, 0xbf800000U};
  TileCodes tile{CodeType::kF32, {}, {}};
  for (std::size_t i = 0; i < 25; ++i) tile.heights.push_back(std::bit_cast<float>(bits[i % std::size(bits)]));
  EXPECT_TRUE(test::same_samples(decode_tile(shape, CodeType::kF32, payload_of(encode_tile(shape, tile))), tile));
}

TEST(TileCodec, RefusesEveryTruncationAndAnyExtraByte) {
  const TileShape shape = TileShape::make(12, 11, 3);
  for (const CodeType type : kAllTypes) {
    for (const Kind kind : test::kAllKinds) {
      if (kind == Kind::kAllVoid) continue;
      std::vector<std::byte> payload = payload_of(encode_tile(shape, test::make_tile(shape, type, kind, 2)));
      for (std::size_t size = 0; size < payload.size(); ++size) {
        expect_error(shape, type, {payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(size)},
                     ErrorCode::kCorrupt);
      }
      payload.push_back(std::byte{0});
      expect_error(shape, type, payload, ErrorCode::kCorrupt);
    }
  }
}

TEST(TileCodec, SurvivesEveryFlippedBit) {
  const TileShape shape = TileShape::make(12, 11, 3);
  for (const CodeType type : kAllTypes) {
    for (const Kind kind : {Kind::kConstant, Kind::kTerrain, Kind::kVoidNoise}) {
      std::vector<std::byte> payload = payload_of(encode_tile(shape, test::make_tile(shape, type, kind, 2)));
      for (std::size_t bit = 0; bit < 8 * payload.size(); ++bit) {
        payload[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
        try {
          const TileCodes tile = decode_tile(shape, type, payload);
          // Whatever comes out is a tile: codes stay in the range that the type allows.
          for (const std::uint16_t code : tile.codes) ASSERT_LE(code, type == CodeType::kU8 ? 255 : 65535);
        } catch (const Error& error) {
          EXPECT_NE(error.code(), ErrorCode::kIo);
        }
        payload[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      }
    }
  }
}

TEST(TileCodec, RefusesEveryWrongHeaderField) {
  const TileShape shape = TileShape::make(12, 11, 3);
  const std::vector<std::byte> good =
      payload_of(encode_tile(shape, test::make_tile(shape, CodeType::kU16, Kind::kTerrain, 2)));
  const auto with = [&](std::size_t at, std::initializer_list<int> bytes) {
    std::vector<std::byte> payload = good;
    std::size_t i = at;
    for (const int byte : bytes) payload[i++] = static_cast<std::byte>(byte);
    return payload;
  };
  const CodeType type = CodeType::kU16;
  expect_error(shape, type, with(0, {0}), ErrorCode::kCorrupt);  // version
  expect_error(shape, type, with(0, {2}), ErrorCode::kCorrupt);  // one of version 1, read as version 2
  expect_error(shape, type, with(0, {3}), ErrorCode::kUnsupported);
  expect_error(shape, type, with(0, {255}), ErrorCode::kUnsupported);
  expect_error(shape, type, with(1, {1}), ErrorCode::kCorrupt);  // sample type
  expect_error(shape, type, with(1, {9}), ErrorCode::kCorrupt);
  expect_error(shape, type, with(2, {1}), ErrorCode::kCorrupt);                    // flags: voids without mask
  expect_error(shape, type, with(2, {2}), ErrorCode::kCorrupt);                    // constant with a range
  expect_error(shape, type, with(2, {4}), ErrorCode::kCorrupt);                    // reserved
  expect_error(shape, type, with(3, {1}), ErrorCode::kCorrupt);                    // dropped bits
  expect_error(shape, type, with(4, {255, 255, 0, 0}), ErrorCode::kCorrupt);       // low above high
  expect_error(shape, type, with(4, {0, 0, 0, 128}), ErrorCode::kCorrupt);         // negative
  expect_error(shape, type, with(8, {255, 255, 0, 0}), ErrorCode::kCorrupt);       // high is the void code
  expect_error(shape, type, with(12, {1}), ErrorCode::kCorrupt);                   // mask bytes
  expect_error(shape, type, with(16, {0, 0, 1, 0}), ErrorCode::kCorrupt);          // base
  expect_error(shape, type, with(20, {255, 255, 255, 255}), ErrorCode::kCorrupt);  // extra bytes
  expect_error(shape, type, with(24, {32}), ErrorCode::kCorrupt);                  // energy shift
  expect_error(shape, type, with(25, {0}), ErrorCode::kCorrupt);                   // contexts
  expect_error(shape, type, with(25, {17}), ErrorCode::kCorrupt);
  expect_error(shape, type, with(26, {0, 128}), ErrorCode::kCorrupt);  // pairs in a context that is not
  expect_error(shape, type, with(28, {0}), ErrorCode::kCorrupt);       // predictors
  expect_error(shape, type, with(28, {2}), ErrorCode::kCorrupt);
  expect_error(shape, type, with(29, {13}), ErrorCode::kCorrupt);                  // weights
  expect_error(shape, type, with(30, {255, 127, 255, 127}), ErrorCode::kCorrupt);  // weights too large
  const auto behind_weights = static_cast<std::size_t>(30 + 2 * std::to_integer<int>(good[29]));
  expect_error(shape, type, with(behind_weights, {255, 255, 255, 255}), ErrorCode::kCorrupt);  // threshold or count
}

TEST(TileCodec, RefusesThePayloadOfAnotherShape) {
  const TileShape shape = TileShape::make(12, 11, 3);
  const std::vector<std::byte> payload =
      payload_of(encode_tile(shape, test::make_tile(shape, CodeType::kU16, Kind::kTerrain, 2)));
  expect_error(TileShape::make(12, 13, 1), CodeType::kU16, payload, ErrorCode::kCorrupt);
  expect_error(TileShape::make(5, 5, 1), CodeType::kU16, payload, ErrorCode::kCorrupt);
}

}  // namespace
}  // namespace isohf
