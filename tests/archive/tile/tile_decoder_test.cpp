#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <gtest/gtest.h>

#include <random>

#include "archive/tile/tiles.h"

namespace isohf {
namespace {

using test::decoded_by;
using test::Kind;

std::vector<std::byte> payload_of(const TileShape& shape, CodeType type, Kind kind, std::uint32_t seed) {
  return test::payload_of(
      encode_tile(shape, test::make_tile(shape, type, kind, seed), Effort::kDefault, PayloadVersion::kFirst));
}

TEST(TileDecoder, GivesWhatThePlainDecoderGives) {
  std::uint32_t seed = 1;
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(6, 5, 1), TileShape::make(24, 29, 1),
                                 TileShape::make(52, 67, 4), TileShape::make(300, 9, 1)}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
      for (const Kind kind : test::kAllKinds) {
        if (kind == Kind::kAllVoid) continue;
        for (int round = 0; round < 10; ++round) {
          const std::vector<std::byte> payload = payload_of(shape, type, kind, ++seed);
          ASSERT_TRUE(test::same_samples(decode_tile(shape, type, payload), decode_tile_slowly(shape, type, payload)))
              << shape.columns() << "x" << shape.rows() << ", kind " << static_cast<int>(kind) << ", seed " << seed;
        }
      }
    }
  }
}

TEST(TileDecoder, RefusesWhatThePlainDecoderRefuses) {
  const TileShape shape = TileShape::make(12, 11, 3);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8}) {
    for (const Kind kind : {Kind::kNoise, Kind::kVoidNoise}) {
      std::vector<std::byte> broken = payload_of(shape, type, kind, 2);
      for (std::size_t bit = 0; bit < 8 * broken.size(); ++bit) {
        broken[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
        ASSERT_EQ(decoded_by(decode_tile, shape, type, broken), decoded_by(decode_tile_slowly, shape, type, broken))
            << "bit " << bit;
        broken[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      }
      while (!broken.empty()) {
        broken.pop_back();
        ASSERT_FALSE(decoded_by(decode_tile, shape, type, broken).has_value()) << broken.size();
      }
    }
  }
}

TEST(TileDecoder, SurvivesNoiseBehindAValidHeader) {
  const TileShape shape = TileShape::make(24, 29, 1);
  std::mt19937 random(1);
  const std::vector<std::byte> good = payload_of(shape, CodeType::kU16, Kind::kTerrain, 2);
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::byte> payload = good;
    for (std::size_t i = random() % payload.size(); i < payload.size(); ++i) {
      payload[i] = static_cast<std::byte>(random());
    }
    ASSERT_EQ(decoded_by(decode_tile, shape, CodeType::kU16, payload),
              decoded_by(decode_tile_slowly, shape, CodeType::kU16, payload));
  }
}

}  // namespace
}  // namespace isohf
