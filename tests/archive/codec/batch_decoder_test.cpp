#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/archive/codec/tile_decoder.h"
#include "isohf/archive/codec/tile_encoder.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <random>

#include "archive/codec/tiles.h"
#include "isohf/archive/codec/predict/predictors.h"
#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using test::Kind;

std::vector<std::byte> payload_of(const EncodedTile& tile) {
  std::vector<std::byte> payload(tile.payload_bytes);
  inflate_exactly(tile.deflated, payload);
  return payload;
}

std::vector<std::byte> payload_of(const TileShape& shape, CodeType type, Kind kind, std::uint32_t seed) {
  return payload_of(
      encode_tile(shape, test::make_tile(shape, type, kind, seed), kDefaultLevel, PayloadVersion::kFirst));
}

/// What the plain decoder says: the tile, or nothing where it refuses.
std::optional<TileCodes> decode_plainly(const TileShape& shape, CodeType type, std::span<const std::byte> payload) {
  try {
    return decode_tile_slowly(shape, type, payload);
  } catch (const Error&) {
    return std::nullopt;
  }
}

struct Decoded {
  std::array<TileCodes, kBatchLanes> tiles;
  std::array<bool, kBatchLanes> decoded{};
};

Decoded decode(const TileShape& shape, CodeType type, const std::vector<std::vector<std::byte>>& payloads) {
  std::array<std::span<const std::byte>, kBatchLanes> spans;
  std::copy(payloads.begin(), payloads.end(), spans.begin());
  Decoded out;
  decode_batch(shape, type, std::span(spans).first(payloads.size()), std::span(out.tiles).first(payloads.size()),
               std::span(out.decoded).first(payloads.size()));
  return out;
}

TEST(BatchDecoder, GivesWhatThePlainDecoderGivesForAnyNumberOfLanes) {
  const Kind kinds[] = {Kind::kPlane,     Kind::kTerrain,    Kind::kNoise,    Kind::kExtremes,
                        Kind::kTwoLevels, Kind::kVoidIsland, Kind::kVoidNoise};
  std::uint32_t seed = 1;
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(6, 5, 1), TileShape::make(24, 29, 1),
                                 TileShape::make(52, 67, 4), TileShape::make(300, 9, 1)}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
      for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{5}, kBatchLanes}) {
        for (const Kind first : kinds) {
          std::vector<std::vector<std::byte>> payloads;
          for (std::size_t i = 0; i < count; ++i) {
            const auto kind = kinds[(static_cast<std::size_t>(first) + i) % std::size(kinds)];
            payloads.push_back(payload_of(shape, type, kind, ++seed));
          }
          const Decoded fast = decode(shape, type, payloads);
          for (std::size_t i = 0; i < count; ++i) {
            const auto plain = decode_plainly(shape, type, payloads[i]);
            ASSERT_TRUE(plain.has_value());
            ASSERT_TRUE(fast.decoded[i]) << shape.columns() << "x" << shape.rows() << ", lane " << i;
            ASSERT_TRUE(test::same_samples(fast.tiles[i], *plain)) << "kind " << static_cast<int>(first);
          }
        }
      }
    }
  }
}

TEST(BatchDecoder, GivesWhatThePlainDecoderGivesForPredictorsOfEveryKind) {
  const TileShape shape = TileShape::make(68, 67, 1);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const TileCodes tile = test::make_halves(shape, type);
    std::vector<std::vector<std::byte>> payloads;
    for (const auto& [count, is_wide] : {std::pair<std::size_t, bool>{1, false}, {3, false}, {kMaxPredictors, true}}) {
      payloads.push_back(payload_of(encode_tile_with(shape, tile, test::make_predictors(shape, count, is_wide))));
      EXPECT_EQ(std::to_integer<std::size_t>(payloads.back()[28]), count);
    }
    payloads.push_back(payload_of(shape, type, Kind::kVoidNoise, 1));
    for (std::size_t begin = 0; begin < payloads.size(); ++begin) {  // with and without the others beside it
      const Decoded fast = decode(shape, type, {payloads.begin() + static_cast<std::ptrdiff_t>(begin), payloads.end()});
      for (std::size_t i = begin; i < 3; ++i) {
        ASSERT_TRUE(fast.decoded[i - begin]);
        EXPECT_EQ(fast.tiles[i - begin], tile);
        EXPECT_EQ(decode_plainly(shape, type, payloads[i]), tile);
      }
    }
  }
}

TEST(BatchDecoder, LeavesEqualSamplesToThePlainDecoder) {
  const TileShape shape = TileShape::make(24, 29, 1);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const Decoded fast =
        decode(shape, type,
               {payload_of(shape, type, Kind::kVoidIsland, 1), payload_of(shape, type, Kind::kTerrain, 2),
                payload_of(shape, type, Kind::kConstant, 3)});
    EXPECT_EQ(fast.decoded, (std::array<bool, kBatchLanes>{true, true, false}));
    EXPECT_TRUE(test::same_samples(fast.tiles[0], test::make_tile(shape, type, Kind::kVoidIsland, 1)));
    EXPECT_TRUE(test::same_samples(fast.tiles[1], test::make_tile(shape, type, Kind::kTerrain, 2)));
  }
}

TEST(BatchDecoder, RefusesWhatThePlainDecoderRefusesWithoutHarmToOtherLanes) {
  const TileShape shape = TileShape::make(12, 11, 3);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const std::vector<std::byte> good = payload_of(shape, type, Kind::kTerrain, 1);
    const TileCodes tile = test::make_tile(shape, type, Kind::kTerrain, 1);
    std::vector<std::byte> broken = payload_of(shape, type, Kind::kNoise, 2);
    for (std::size_t bit = 0; bit < 8 * broken.size(); ++bit) {
      broken[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      const auto plain = decode_plainly(shape, type, broken);
      const Decoded fast = decode(shape, type, {good, broken, good});
      ASSERT_TRUE(fast.decoded[0] && fast.decoded[2]) << bit;
      ASSERT_EQ(fast.tiles[0], tile);
      ASSERT_EQ(fast.tiles[2], tile);
      if (fast.decoded[1]) {
        ASSERT_TRUE(plain.has_value()) << "bit " << bit;
        ASSERT_TRUE(test::same_samples(fast.tiles[1], *plain)) << "bit " << bit;
      }
      broken[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    }
  }
}

TEST(BatchDecoder, RefusesEveryTruncation) {
  const TileShape shape = TileShape::make(12, 11, 3);
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    std::vector<std::byte> payload = payload_of(shape, type, Kind::kNoise, 3);
    while (!payload.empty()) {
      payload.pop_back();
      ASSERT_FALSE(decode(shape, type, {payload}).decoded[0]) << payload.size();
    }
  }
}

TEST(BatchDecoder, SurvivesNoiseBehindAValidHeader) {
  const TileShape shape = TileShape::make(24, 29, 1);
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    std::mt19937 random(1);
    const std::vector<std::byte> good = payload_of(shape, type, Kind::kTerrain, 2);
    for (int round = 0; round < 2000; ++round) {
      std::vector<std::byte> payload = good;
      for (std::size_t i = random() % payload.size(); i < payload.size(); ++i) {
        payload[i] = static_cast<std::byte>(random());
      }
      const Decoded fast = decode(shape, type, {payload, good});
      ASSERT_TRUE(fast.decoded[1]);
      if (!fast.decoded[0]) continue;
      const auto plain = decode_plainly(shape, type, payload);
      ASSERT_TRUE(plain.has_value() && test::same_samples(fast.tiles[0], *plain));
    }
  }
}

/// A payload of floats of all sizes whose weights were replaced: one has all the weight that a header may hold.
std::vector<std::byte> payload_of_greatest_sums(const TileShape& shape, std::mt19937& random) {
  TileCodes tile;
  tile.type = CodeType::kF32;
  const float ends[] = {-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
  for (int i = 0; i < shape.stored_vertex_count(); ++i) {
    const auto any = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    tile.heights.push_back(i < 2 || std::isnan(any) ? ends[i % 2] : any);
  }
  std::vector<std::byte> payload = payload_of(encode_tile(shape, tile));
  const auto weights = std::to_integer<std::size_t>(payload[29]);  // they stand behind 30 bytes of header
  std::fill_n(payload.begin() + 30, 2 * weights, std::byte{0});
  const auto great = static_cast<std::int16_t>(kWeightSumLimit - 1);
  const std::int16_t weight = random() % 2 == 0 ? great : static_cast<std::int16_t>(-great);
  std::memcpy(payload.data() + 30 + 2 * (random() % weights), &weight, sizeof(weight));
  return payload;
}

TEST(BatchDecoder, AddsUpTheGreatestSumsOfFloatsExactly) {
  const TileShape shape = TileShape::make(5, 5, 1);  // few samples: the first that is restored out of range ends it
  std::mt19937 random(5);
  int decoded = 0;
  for (int round = 0; round < 100; ++round) {
    std::vector<std::vector<std::byte>> payloads;
    for (std::size_t lane = 0; lane < kBatchLanes; ++lane) payloads.push_back(payload_of_greatest_sums(shape, random));
    const Decoded fast = decode(shape, CodeType::kF32, payloads);
    for (std::size_t lane = 0; lane < kBatchLanes; ++lane) {
      const auto plain = decode_plainly(shape, CodeType::kF32, payloads[lane]);
      ASSERT_EQ(fast.decoded[lane], plain.has_value());
      if (!plain) continue;
      ++decoded;
      ASSERT_TRUE(test::same_samples(fast.tiles[lane], *plain));
    }
  }
  EXPECT_GT(decoded, 200);
}

}  // namespace
}  // namespace isohf
