#include "isohf/archive/shadow_seeds/shadow_seeds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

constexpr CodeType kAllTypes[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};

TileCodes random_tile(const TileShape& shape, CodeType type, std::mt19937& random) {
  TileCodes tile;
  tile.type = type;
  const auto n = static_cast<std::size_t>(shape.stored_vertex_count());
  for (std::size_t i = 0; i < n; ++i) {
    const bool is_void = random() % 10 == 0;
    if (type == CodeType::kF32) {
      tile.heights.push_back(is_void ? NAN : static_cast<float>(static_cast<double>(random()) / 1e6 - 2000.0));
    } else {
      const std::uint32_t limit = type == CodeType::kU8 ? 255 : 65535;
      tile.codes.push_back(static_cast<std::uint16_t>(is_void ? limit : random() % limit));
    }
  }
  return tile;
}

/// Any casters that a tile with `vertices` before it could have; their hull need not be one.
CasterRows random_casters(const TileShape& shape, CodeType type, std::int64_t vertices, std::size_t most,
                          std::mt19937& random) {
  CasterRows rows;
  rows.starts.push_back(0);
  for (int row = 1; row <= visible_rows(shape); ++row) {
    std::int64_t place = 1;  // the padding's
    for (std::size_t left = vertices == 0 ? 0 : random() % (most + 1); left > 0; --left) {
      place += 1 + static_cast<std::int64_t>(random()) % (random() % 3 == 0 ? 40 : 3);
      if (place > vertices) break;
      const double height = type == CodeType::kF32
                                ? double{static_cast<float>(random() % 5 == 0 ? -1e38 : std::ldexp(random(), -20))}
                                : static_cast<double>(random() % (type == CodeType::kU8 ? 255 : 65535));
      rows.casters.push_back({distance_from_ordinal(shape, row, place), height});
    }
    rows.starts.push_back(static_cast<std::uint32_t>(rows.casters.size()));
  }
  return rows;
}

std::vector<std::byte> inflate(const EncodedSeeds& seeds) {
  std::vector<std::byte> payload(seeds.payload_bytes);
  inflate_exactly(seeds.deflated, payload);
  EXPECT_EQ(crc32(payload), seeds.payload_crc32);
  return payload;
}

struct Case {
  TileGrid grid;
  TileIndex index;
  TileCodes tile;
  HullSeeds seeds;
  TileEdges edges;
};

Case random_case(CodeType type, unsigned seed) {
  std::mt19937 random(seed);
  const int cells = 1 + static_cast<int>(random() % 9);
  const TileShape shape = TileShape::make(cells + 4, 5 + 2 * static_cast<int>(random() % 6), 1);
  const TileGrid grid = TileGrid::make(shape, 6, 2, 100.0, 100.0);
  Case out{grid, {static_cast<std::int64_t>(random() % 6), 1}, random_tile(shape, type, random), {}, {}};
  out.edges = tile_edges(shape, out.tile);
  const std::size_t most = random() % 12;
  out.seeds.eastward = random_casters(shape, type, out.index.column * shape.cell_columns(), most, random);
  out.seeds.westward = random_casters(shape, type, (5 - out.index.column) * shape.cell_columns(), most, random);
  return out;
}

TEST(ShadowSeeds, HullsComeBackForAllTypesAndShapes) {
  for (const CodeType type : kAllTypes) {
    for (unsigned seed = 0; seed < 300; ++seed) {
      const Case c = random_case(type, seed);
      const HullSeeds found =
          decode_hull_seeds(c.grid, c.index, c.edges, inflate(encode_seeds(c.grid, c.edges, c.seeds)));
      ASSERT_EQ(found.eastward, c.seeds.eastward) << to_string(type) << " seed " << seed;
      ASSERT_EQ(found.westward, c.seeds.westward) << to_string(type) << " seed " << seed;
    }
  }
}

TEST(ShadowSeeds, EveryTruncationAndEveryByteTooManyIsRefused) {
  const Case c = random_case(CodeType::kU16, 17);
  ASSERT_FALSE(c.seeds.empty());
  std::vector<std::byte> payload = inflate(encode_seeds(c.grid, c.edges, c.seeds));
  for (std::size_t n = 0; n < payload.size(); ++n) {
    EXPECT_THROW((void)decode_hull_seeds(c.grid, c.index, c.edges, std::span(payload).first(n)), Error) << n;
  }
  payload.push_back({});
  EXPECT_THROW((void)decode_hull_seeds(c.grid, c.index, c.edges, payload), Error);
}

/// Whatever it decodes to must be possible in that place.
void expect_refused_or_sane(const Case& c, std::span<const std::byte> payload) {
  HullSeeds seeds;
  try {
    seeds = decode_hull_seeds(c.grid, c.index, c.edges, payload);
  } catch (const Error&) {
    return;
  }
  const std::int64_t across = half_steps_across(c.grid.shape());
  for (const auto& [rows, tiles] :
       {std::pair(&seeds.eastward, c.index.column), {&seeds.westward, 5 - c.index.column}}) {
    for (const ShadowCaster& caster : rows->casters) {
      EXPECT_GT(caster.distance, 0);
      EXPECT_LE(caster.distance, (tiles + 1) * across * 2);
      EXPECT_TRUE(std::abs(caster.height) <= 3.5e38);
    }
  }
}

TEST(ShadowSeeds, AnyByteMayBeWrong) {
  for (const CodeType type : kAllTypes) {
    const Case c = random_case(type, 23);
    const std::vector<std::byte> payload = inflate(encode_seeds(c.grid, c.edges, c.seeds));
    for (std::size_t i = 0; i < payload.size(); ++i) {
      for (const unsigned value : {0U, 1U, 15U, 16U, 127U, 200U, 239U, 240U, 255U}) {
        auto damaged = payload;
        damaged[i] = static_cast<std::byte>(value);
        expect_refused_or_sane(c, damaged);
      }
    }
  }
}

TEST(ShadowSeeds, EveryHeaderFieldIsChecked) {
  const Case c = random_case(CodeType::kU16, 17);
  const std::vector<std::byte> payload = inflate(encode_seeds(c.grid, c.edges, c.seeds));
  for (std::size_t i = 0; i < 8; ++i) {
    for (unsigned value = 0; value < 256; ++value) {
      if (payload[i] == static_cast<std::byte>(value)) continue;
      auto damaged = payload;
      damaged[i] = static_cast<std::byte>(value);
      EXPECT_EQ(test::error_of([&] { (void)decode_hull_seeds(c.grid, c.index, c.edges, damaged); }).code(),
                i == 0 ? ErrorCode::kUnsupported : ErrorCode::kCorrupt)
          << "byte " << i << " = " << value;
    }
  }
}

TEST(ShadowSeeds, CastersBeforeTheFirstTileAreRefused) {
  const Case c = random_case(CodeType::kU16, 3);
  const std::vector<std::byte> payload = inflate(encode_seeds(c.grid, c.edges, c.seeds));
  ASSERT_FALSE(c.seeds.eastward.casters.empty());
  EXPECT_THROW((void)decode_hull_seeds(c.grid, {0, 1}, c.edges, payload), Error);
}

TEST(ShadowSeeds, NamesAreExact) {
  EXPECT_EQ(seed_name({12, 7}), "seeds/7/12.seed");
  EXPECT_EQ(tile_from_seed_name("seeds/7/12.seed"), (TileIndex{12, 7}));
  for (const char* name : {"seeds/07/12.seed", "seeds/7/12.tile", "seeds/7/.seed", "seeds/7.seed", "seed",
                           "seeds/.seed", "seeds/-7/12.seed", "tiles/7/12.seed", "seeds/7/12/1.seed"}) {
    EXPECT_EQ(tile_from_seed_name(name), std::nullopt) << name;
  }
}

ShadowSeedInfo parsed(const std::string& json) {
  Metadata metadata(TileGrid::make(TileShape::make(5, 5, 1), 1, 1, 1.0, 1.0));
  metadata.extensions = {{kShadowSeedsName, json}};
  return *shadow_seed_info(metadata);
}

TEST(ShadowSeedInfo, ComesBackFromJson) {
  ShadowSeedInfo info;
  info.sun_min_deg = 1.5;
  info.elevation_units_per_world_unit = 3.28;
  info.members = 5;
  info.bytes = 700;
  const ShadowSeedInfo hulls = parsed(format_shadow_seed_info(info));
  EXPECT_EQ(hulls.sun_min_deg, 1.5);
  EXPECT_EQ(hulls.elevation_units_per_world_unit, 3.28);
  EXPECT_EQ(hulls.members, 5);
  EXPECT_EQ(hulls.bytes, 700U);
}

TEST(ShadowSeedInfo, RefusesWhatItIsNot) {
  const std::string rest = R"(,"elevation_units_per_world_unit":1,"members":1,"bytes":1})";
  EXPECT_NO_THROW((void)parsed(R"({"kind":"hulls","sun_min_deg":2)" + rest));
  for (const std::string& text : std::vector<std::string>{
           "", "[]", "{}", R"({"kind":"lines","sun_min_deg":2)" + rest, R"({"kind":"hulls")" + rest,
           R"({"kind":"hulls","sun_min_deg":0)" + rest, R"({"kind":"hulls","sun_min_deg":90)" + rest,
           R"({"kind":"hulls","sun_min_deg":"2")" + rest, R"({"kind":"angles","sun_deg":[5])" + rest,
           R"({"kind":"hulls","sun_min_deg":2})",
           R"({"kind":"hulls","sun_min_deg":2,"elevation_units_per_world_unit":0,"members":1,"bytes":1})",
           R"({"kind":"hulls","sun_min_deg":2,"elevation_units_per_world_unit":1,"members":-1,"bytes":1})"}) {
    EXPECT_THROW((void)parsed(text), Error) << text;
  }
}

}  // namespace
}  // namespace isohf
