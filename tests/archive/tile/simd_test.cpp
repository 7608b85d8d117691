/// Kernels of base/simd.h compiled for AVX2 and for the base set: the same bits.

#include "isohf/base/simd.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "archive/tile/tiles.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/tile_codes.h"

namespace isohf {
namespace {

/// Plain twins while it lives.
class PlainTwins {
 public:
  PlainTwins() { set_simd(false); }
  ~PlainTwins() { set_simd(true); }
  PlainTwins(const PlainTwins&) = delete;
  PlainTwins& operator=(const PlainTwins&) = delete;
};

class Simd : public testing::Test {
 protected:
  void SetUp() override {
    if (!machine_has_simd()) GTEST_SKIP() << "this machine, or this build, has nothing but the plain twins";
  }
};

TEST_F(Simd, EncodesTilesToTheSameBytes) {
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(52, 67, 4), TileShape::make(212, 243, 4)}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
      for (const test::Kind kind : test::kAllKinds) {
        const TileCodes tile = test::make_tile(shape, type, kind, 7);
        const EncodedTile wide = encode_tile(shape, tile);
        const PlainTwins plain_twins;
        const EncodedTile plain = encode_tile(shape, tile);
        EXPECT_EQ(wide.deflated, plain.deflated) << to_string(type) << ", kind " << static_cast<int>(kind);
        EXPECT_EQ(wide.content_digest, plain.content_digest);
      }
    }
  }
}

TEST_F(Simd, DecodesTilesToTheSameSamples) {
  const TileShape shape = TileShape::make(52, 67, 4);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    for (const test::Kind kind : test::kAllKinds) {
      const EncodedTile encoded = encode_tile(shape, test::make_tile(shape, type, kind, 9));
      if (encoded.is_empty) continue;
      const std::vector<std::byte> payload = test::payload_of(encoded);
      const TileCodes wide = decode_tile(shape, type, payload);
      const PlainTwins plain_twins;
      EXPECT_TRUE(test::same_samples(wide, decode_tile(shape, type, payload)));
    }
  }
}

TEST_F(Simd, QuantisesToTheSameCodes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> height(-50.0F, 700.0F);
  for (const std::size_t count : {std::size_t{1}, std::size_t{31}, std::size_t{4099}}) {
    std::vector<float> heights(count);
    for (float& value : heights) value = random() % 17 == 0 ? std::numeric_limits<float>::quiet_NaN() : height(random);
    const Quantisation quantisation{CodeType::kU16, 0.0, 0.01};
    TileCodes wide;
    const QuantiserCounts wide_counts = quantise(quantisation, 12.5, heights, wide);
    const PlainTwins plain_twins;
    TileCodes plain;
    const QuantiserCounts plain_counts = quantise(quantisation, 12.5, heights, plain);
    EXPECT_EQ(wide.codes, plain.codes);
    EXPECT_EQ(wide_counts.below, plain_counts.below);
    EXPECT_EQ(wide_counts.above, plain_counts.above);
    EXPECT_EQ(wide_counts.worst_rounding, plain_counts.worst_rounding);
  }
}

TEST_F(Simd, RaisesFloatsToTheSameBits) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> height(-9000.0F, 9000.0F);
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{31}, std::size_t{4099}}) {
    TileCodes heights;
    heights.type = CodeType::kF32;
    for (std::size_t i = 0; i < count; ++i) {
      heights.heights.push_back(random() % 17 == 0 ? std::numeric_limits<float>::quiet_NaN() : height(random));
    }
    for (const double datum : {0.0, 0.1, -123456.789}) {
      float worst = 0.0F;  // by definition
      TileCodes expected;
      expected.type = CodeType::kF32;
      for (const float value : heights.heights) {
        expected.heights.push_back(static_cast<float>(double{value} + datum));
        const auto off = static_cast<float>(std::abs(double{expected.heights.back()} - (double{value} + datum)));
        worst = off > worst ? off : worst;
      }
      TileCodes wide;
      EXPECT_EQ(quantise({CodeType::kF32, 0.0, 1.0}, datum, heights.heights, wide).worst_rounding, double{worst});
      EXPECT_TRUE(test::same_samples(wide, expected));
      const PlainTwins plain_twins;
      TileCodes plain;
      EXPECT_EQ(quantise({CodeType::kF32, 0.0, 1.0}, datum, heights.heights, plain).worst_rounding, double{worst});
      EXPECT_TRUE(test::same_samples(plain, expected));
    }
  }
}

}  // namespace
}  // namespace isohf
