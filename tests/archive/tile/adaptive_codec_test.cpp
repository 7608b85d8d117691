#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/adaptive/adaptive_decoder.h"
#include "isohf/archive/tile/adaptive/adaptive_payload.h"
#include "isohf/archive/tile/adaptive/symbol_model.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"
#include "tiles.h"

namespace isohf {
namespace {

using test::decoded_by;
using test::Kind;

std::vector<std::byte> adaptive_payload(const TileShape& shape, const TileCodes& tile,
                                        Effort effort = Effort::kDefault) {
  return test::payload_of(encode_tile(shape, tile, effort, PayloadVersion::kAdaptive));
}

TEST(AdaptiveCodec, BringsBackEveryTileByBothDecodersWithAndWithoutSimd) {
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(6, 7, 1), TileShape::make(12, 11, 3),
                                 TileShape::make(24, 29, 1), TileShape::make(300, 9, 1), TileShape::make(52, 67, 4)}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8}) {
      for (const Kind kind : test::kAllKinds) {
        if (kind == Kind::kConstant || kind == Kind::kAllVoid) continue;
        for (const Effort effort : {Effort::kFast, Effort::kDefault, Effort::kBest}) {
          const TileCodes tile = test::make_tile(shape, type, kind, 7);
          const std::vector<std::byte> payload = adaptive_payload(shape, tile, effort);
          EXPECT_LE(payload.size(), max_payload_bytes(shape, type));
          if (!is_adaptive(payload)) continue;
          ASSERT_EQ(decode_adaptive(shape, type, payload), tile) << shape.columns() << " " << static_cast<int>(kind);
          ASSERT_EQ(decode_tile(shape, type, payload), tile) << shape.columns() << " " << static_cast<int>(kind);
          set_simd(false);
          EXPECT_EQ(decode_tile(shape, type, payload), tile);
          EXPECT_EQ(adaptive_payload(shape, tile, effort), payload);
          set_simd(true);
        }
      }
    }
  }
}

/// Waves and noise of some codes, in steps of 2^shift: what `--max-rounding` makes of one ground.
TileCodes ground_in_steps(const TileShape& shape, CodeType type, unsigned shift) {
  std::mt19937 random(7);
  TileCodes tile;
  tile.type = type;
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      const double waves = 20000 + 6000 * std::sin(0.05 * c + 0.02 * r) + 3000 * std::sin(0.11 * r - 0.03 * c);
      const auto code = static_cast<std::uint32_t>(waves) + random() % 64;
      tile.codes.push_back(static_cast<std::uint16_t>(code >> shift));
    }
  }
  return tile;
}

std::size_t bytes_of(const TileShape& shape, const TileCodes& tile, PayloadVersion version) {
  return encode_tile(shape, tile, Effort::kDefault, version).deflated.size();
}

TEST(AdaptiveCodec, IsTakenWhereCodesAreCoarseAndPaysThere) {
  const TileShape shape = TileShape::make(100, 99, 1);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8}) {
    for (const unsigned shift : {8U, 9U, 10U, 11U}) {
      const TileCodes tile = ground_in_steps(shape, type, shift);
      const std::size_t bytes = bytes_of(shape, tile, PayloadVersion::kBest);
      EXPECT_EQ(bytes, bytes_of(shape, tile, PayloadVersion::kAdaptive)) << shift;
      EXPECT_LT(bytes, bytes_of(shape, tile, PayloadVersion::kFirst) * 95 / 100) << shift;
    }
  }
}

TEST(AdaptiveCodec, IsLeftToTilesOfCoarseCodes) {
  const TileShape shape = TileShape::make(100, 99, 1);
  for (const unsigned shift : {0U, 2U, 4U, 5U}) {
    const TileCodes tile = ground_in_steps(shape, CodeType::kU16, shift);
    const std::size_t bytes = bytes_of(shape, tile, PayloadVersion::kBest);
    EXPECT_EQ(bytes, bytes_of(shape, tile, PayloadVersion::kFirst)) << shift;
    EXPECT_LT(bytes, bytes_of(shape, tile, PayloadVersion::kAdaptive) * 105 / 100) << shift;
  }
}

TEST(AdaptiveCodec, IsTakenByTheBestEffortWhereItIsShorter) {
  const TileShape shape = TileShape::make(100, 99, 1);
  std::size_t taken = 0;
  for (const unsigned shift : {0U, 2U, 4U, 5U}) {
    const TileCodes tile = ground_in_steps(shape, CodeType::kU16, shift);
    const std::size_t first = encode_tile(shape, tile, Effort::kBest, PayloadVersion::kFirst).deflated.size();
    const std::size_t adaptive = encode_tile(shape, tile, Effort::kBest, PayloadVersion::kAdaptive).deflated.size();
    EXPECT_EQ(encode_tile(shape, tile, Effort::kBest).deflated.size(), std::min(first, adaptive)) << shift;
    taken += adaptive < first ? 1 : 0;
  }
  EXPECT_GT(taken, 0U);
}

TEST(AdaptiveCodec, RefusesByTheFastDecoderWhatThePlainOneRefuses) {
  const TileShape shape = TileShape::make(12, 19, 1);
  for (const Kind kind : {Kind::kTerrain, Kind::kTwoLevels, Kind::kVoidNoise}) {
    std::vector<std::byte> payload = adaptive_payload(shape, test::make_tile(shape, CodeType::kU16, kind, 2));
    ASSERT_TRUE(is_adaptive(payload));
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * payload.size(); ++bit) {
      payload[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      const auto fast = decoded_by(decode_tile, shape, CodeType::kU16, payload);
      ASSERT_EQ(fast, decoded_by(decode_tile_slowly, shape, CodeType::kU16, payload)) << bit;
      refused += fast ? 0 : 1;
      payload[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    }
    EXPECT_GT(refused, 2 * payload.size()) << "states that must end where they began tell of most changes";
    for (std::size_t size = 0; size < payload.size(); ++size) {
      EXPECT_FALSE(decoded_by(decode_tile, shape, CodeType::kU16, std::span(payload).first(size))) << size;
    }
    payload.push_back(std::byte{0});
    EXPECT_FALSE(decoded_by(decode_tile, shape, CodeType::kU16, payload));
  }
}

TEST(AdaptiveCodec, SurvivesNoiseBehindAValidHeader) {
  const TileShape shape = TileShape::make(24, 29, 1);
  std::mt19937 random(1);
  const std::vector<std::byte> good =
      adaptive_payload(shape, test::make_tile(shape, CodeType::kU16, Kind::kTerrain, 2));
  for (int round = 0; round < 1000; ++round) {
    std::vector<std::byte> payload = good;
    for (std::size_t i = 9 + random() % (payload.size() - 9); i < payload.size(); ++i) {
      payload[i] = static_cast<std::byte>(random());
    }
    ASSERT_EQ(decoded_by(decode_tile, shape, CodeType::kU16, payload),
              decoded_by(decode_tile_slowly, shape, CodeType::kU16, payload));
  }
}

TEST(SymbolModel, GivesAllSlotsToSymbolsWhateverWasCounted) {
  std::mt19937 engine(4);
  const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
  SymbolModel model;
  for (int band = 0; band < 40; ++band) {
    for (int i = 0; i < 3000; ++i) {
      model.count(random() % 8 == 0 ? random() % kAllContexts : random() % 100,
                  random() % 3 == 0 ? random() % std::uint32_t{kModelSymbols} : 4 + random() % 2);
    }
    model.end_band();
    for (std::uint32_t context = 0; context < kAllContexts; ++context) {
      const SymbolTable& table = model.table(context);
      std::uint32_t start = 0;
      for (std::uint32_t s = 0; s < kModelSymbols; ++s) {
        ASSERT_EQ(table.starts[s], start);
        start += table.frequency(s);
      }
      ASSERT_EQ(start, kFrequencySum);
      ASSERT_GT(table.frequency(kEscape), 0U);
    }
  }
}

TEST(SymbolModel, LearnsFromBandsThatAreDone) {
  SymbolModel model;
  const std::uint32_t context = context_of(3, 1, kLevelPattern);
  const SymbolTable before = model.table(context);
  for (int i = 0; i < 1000; ++i) model.count(context, 2);
  EXPECT_EQ(model.table(context).starts, before.starts);
  model.end_band();
  EXPECT_GT(model.table(context).frequency(2), kFrequencySum * 9 / 10);
  EXPECT_GT(model.table(context_of(3, 1, 0)).frequency(2), kFrequencySum * 9 / 10) << "its parent's";
  EXPECT_EQ(model.table(context_of(3, 2, kLevelPattern)).starts, before.starts);
}

TEST(SymbolModel, CountsMoreThanSixteenBitsHold) {
  for (const std::uint32_t count : {65535U, 65536U, 65537U, 131072U, 200000U}) {
    SymbolModel model;
    const std::uint32_t context = context_of(3, 1, 0);
    const std::uint32_t inverse = ((1U << 31U) - (1U << 19U)) / (count + 8);
    const std::uint32_t of_plain =
        ((count * inverse) >> 17U) + ((model.table(context).frequency(2) * (inverse >> 12U)) >> 16U) + 1;
    for (std::uint32_t i = 0; i < count; ++i) model.count(context, 2);
    model.end_band();
    EXPECT_EQ(model.table(context_of(3, 1, 5)).frequency(2), of_plain) << count << ": its parent's";
    EXPECT_EQ(model.table(context).frequency(2),
              ((count * inverse) >> 17U) + ((of_plain * (inverse >> 12U)) >> 16U) + 1)
        << count;
  }
}

TEST(AdaptiveCodec, BringsBackRowsOfMoreSamplesThanSixteenBitsCount) {
  const TileShape shape = TileShape::make(kMaxTileColumns, 19, 1);
  TileCodes tile;
  tile.type = CodeType::kU16;
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c)
      tile.codes.push_back(static_cast<std::uint16_t>(c % 5000 == 17 * r ? 9 : 7));
  }
  const std::vector<std::byte> payload = adaptive_payload(shape, tile);
  ASSERT_TRUE(is_adaptive(payload));
  EXPECT_EQ(decode_adaptive(shape, CodeType::kU16, payload), tile);
  EXPECT_EQ(decode_tile(shape, CodeType::kU16, payload), tile);
}

TEST(TileCodec, TakesNoMoreBytesWithMoreEffort) {
  const TileShape shape = TileShape::make(100, 99, 1);
  for (const unsigned shift : {0U, 3U, 5U, 6U, 7U, 8U, 10U, 12U, 14U}) {
    const TileCodes waves = ground_in_steps(shape, CodeType::kU16, shift);
    TileCodes other = test::make_tile(shape, CodeType::kU16, shift % 2 == 0 ? Kind::kTerrain : Kind::kVoidIsland, 3);
    for (std::uint16_t& code : other.codes) {
      code = code == 65535 ? code : static_cast<std::uint16_t>(code >> std::min(shift, 8U));
    }
    for (const PayloadVersion version : {PayloadVersion::kBest, PayloadVersion::kAdaptive}) {
      for (const TileCodes& tile : {waves, other}) {
        std::size_t before = std::numeric_limits<std::size_t>::max();
        for (const Effort effort : {Effort::kFast, Effort::kDefault, Effort::kBest}) {
          const std::size_t bytes = encode_tile(shape, tile, effort, version).deflated.size();
          EXPECT_LE(bytes, before) << level_of(effort) << " " << shift << " " << static_cast<int>(version);
          before = bytes;
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
