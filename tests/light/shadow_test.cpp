#include "isohf/light/shadow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "light/shadow_world.h"

namespace isohf {
namespace {

using Terrain = ShadowWorld::Terrain;

/// All tiles of a row, one after the other in the light's order.
std::vector<std::vector<float>> sweep(const ShadowWorld& world, const ShadowLight& light) {
  const TileShape& shape = world.shape();
  std::vector<std::vector<float>> out(static_cast<std::size_t>(world.grid.tile_columns()));
  std::vector<double> handed(static_cast<std::size_t>(visible_rows(shape)), kNoShadow);
  for (std::int64_t i = 0; i < world.grid.tile_columns(); ++i) {
    const std::int64_t tile = light.travel == LightTravel::kEastward ? i : world.grid.tile_columns() - 1 - i;
    const std::vector<float> heights = world.tile_heights(tile);
    auto& shadow = out[static_cast<std::size_t>(tile)];
    shadow.resize(heights.size());
    tile_shadow(world.grid, {heights.data(), shape.columns(), shape.rows()}, light, handed,
                {shadow.data(), shape.columns(), shape.rows()}, handed);
  }
  return out;
}

/// Runs `check(tile, column, row, S)` over every stored vertex.
template <typename Check>
void for_each_vertex(const ShadowWorld& world, const std::vector<std::vector<float>>& shadow, Check check) {
  for (std::int64_t tile = 0; tile < world.grid.tile_columns(); ++tile) {
    for (int row = 0; row < world.shape().rows(); ++row) {
      for (int column = 0; column < world.shape().columns(); ++column) {
        check(tile, column, row,
              double{shadow[static_cast<std::size_t>(tile)]
                           [static_cast<std::size_t>(row * world.shape().columns() + column)]});
      }
    }
  }
}

void expect_equal_to_definition(const ShadowWorld& world, const ShadowLight& light) {
  const auto shadow = sweep(world, light);
  for_each_vertex(world, shadow, [&](std::int64_t tile, int column, int row, double found) {
    if (!is_visible(world.shape(), {column, row})) {
      ASSERT_EQ(found, kNoShadow);
      return;
    }
    const double wanted = world.shadow(tile, column, row, light.travel, light.fall * world.grid.sigma_x());
    if (std::isinf(wanted)) {
      ASSERT_EQ(found, wanted);
      return;
    }
    // One rounding to float, and a few in double of sums as large as the whole fall.
    const double largest = std::abs(wanted) + 65535.0 + world.grid.world_width() * light.fall * 1e-8;
    ASSERT_NEAR(found, wanted, largest * 0x1p-23) << "tile " << tile << " vertex " << column << "," << row;
  });
}

TEST(TileShadow, EqualsTheDefinitionForAllTerrainsShapesAnglesAndBothTravels) {
  unsigned seed = 1;
  for (const auto& [columns, rows] : {std::pair{5, 5}, {6, 7}, {12, 11}, {21, 39}}) {
    const TileShape shape = TileShape::make(columns, rows, 1);
    for (const std::int64_t tiles : {1, 2, 5}) {
      for (const Terrain terrain : kAllTerrains) {
        const ShadowWorld world(shape, tiles, 1000.0 * shape.cell_columns(), terrain, ++seed);
        for (const LightTravel travel : kBothTravels) {
          for (const double fall : {1e-3, 0.3, 7.0, 1e5}) {
            SCOPED_TRACE(testing::Message() << columns << "x" << rows << " seed " << seed << " fall " << fall);
            expect_equal_to_definition(world, {travel, fall});
          }
        }
      }
    }
  }
}

TEST(TileShadow, CarriesShadowsOverFiftyTilesWithoutAddingUpRoundings) {
  const ShadowWorld world(TileShape::make(12, 11, 1), 50, 8000.0, Terrain::kRidges, 7);
  for (const LightTravel travel : kBothTravels) expect_equal_to_definition(world, {travel, 0.0123});
}

TEST(TileShadow, PassesOverVoidsWhichCastNothing) {
  const TileShape shape = TileShape::make(12, 5, 1);
  const TileGrid grid = TileGrid::make(shape, 1, 1, 16.0, 16.0);
  std::vector<float> heights(60, NAN);
  heights[1 * 12 + 3] = 100.0F;  // row 1, x = 4
  heights[1 * 12 + 5] = INFINITY;
  std::vector<float> shadow(60);
  std::vector<double> leaving(3);
  tile_shadow(grid, {heights.data(), 12, 5}, {LightTravel::kEastward, 2.0}, {}, {shadow.data(), 12, 5}, leaving);
  EXPECT_EQ(shadow[1 * 12 + 2], kNoShadow);
  EXPECT_EQ(shadow[1 * 12 + 3], 100.0F);
  EXPECT_EQ(shadow[1 * 12 + 5], 92.0F);
  EXPECT_EQ(leaving[0], 100.0 - 12 * 2.0);
  EXPECT_EQ(leaving[1], kNoShadow);
}

TEST(TileShadow, LeavesOutWhatIsNotAskedFor) {
  const ShadowWorld world(TileShape::make(6, 7, 1), 1, 100.0, Terrain::kNoise, 2);
  const std::vector<float> heights = world.tile_heights(0);
  const View2D<const float> view(heights.data(), 6, 7);
  const ShadowLight light{LightTravel::kWestward, 0.5};
  std::vector<float> shadow(42);
  std::vector<double> leaving(5);
  tile_shadow(world.grid, view, light, {}, {shadow.data(), 6, 7}, leaving);
  std::vector<float> shadow_alone(42);
  tile_shadow(world.grid, view, light, {}, {shadow_alone.data(), 6, 7}, {});
  EXPECT_EQ(shadow, shadow_alone);
  std::vector<double> leaving_alone(5);
  tile_shadow(world.grid, view, light, {}, {}, leaving_alone);
  EXPECT_EQ(leaving, leaving_alone);
}

/// Eqs. 17-18 (errata E14, E15) as printed, vertex by vertex. elevations [n]  step [n-1]  entering  at the first vertex
std::vector<double> shadow_along_row(const std::vector<double>& elevations, const std::vector<double>& step,
                                     double fall, double entering) {
  std::vector<double> shadow;
  for (std::size_t i = 0; i < elevations.size(); ++i) {
    shadow.push_back(std::max(elevations[i], i == 0 ? entering : shadow.back() - step[i - 1] * fall));
  }
  return shadow;
}

TEST(SunShare, RunsFromDarkToFullOverTheSunsSize) {
  EXPECT_EQ(sun_share(0, kNoShadow, 2), 1.0);
  EXPECT_EQ(sun_share(-5, 0, 2), 0.0);
  EXPECT_EQ(sun_share(5, 0, 2), 1.0);
  EXPECT_EQ(sun_share_on_surface(3, 3, 2), 1.0);
  EXPECT_EQ(sun_share_on_surface(2.5, 3, 2), 0.5);
  EXPECT_EQ(sun_share_on_surface(2, 3, 2), 0.0);
}

// As printed a tile's first vertex has S = 0: in the shadow where the land lies below 0, and never under the mountain
// next door.
TEST(Errata, E14FirstVertexTakesWhatItsNeighbourHandsOver) {
  EXPECT_EQ(shadow_along_row({-50, -60}, {1}, 1.0, kNoShadow).front(), -50);
  EXPECT_EQ(shadow_along_row({-50, -60}, {1}, 1.0, 25), (std::vector<double>{25, 24}));

  // Two tiles: a wall in the first darkens the first vertex of the second.
  const TileShape shape = TileShape::make(5, 5, 1);
  const TileGrid grid = TileGrid::make(shape, 2, 1, 10.0, 10.0);
  std::vector<float> wall(25, -100.0F);
  wall[1 * 5 + 1] = 500.0F;
  const std::vector<float> plain(25, -100.0F);
  std::vector<double> handed(3);
  std::vector<float> shadow_there(25);
  const ShadowLight light{LightTravel::kEastward, 3.0};
  tile_shadow(grid, {wall.data(), 5, 5}, light, {}, {}, handed);
  tile_shadow(grid, {plain.data(), 5, 5}, light, handed, {shadow_there.data(), 5, 5}, {});
  EXPECT_EQ(shadow_there[1 * 5 + 1], 470.0F);
  EXPECT_EQ(shadow_there[2 * 5 + 1], -100.0F);
}

// As printed the shadow rises away from its caster, and by the same amount at every vertex.
TEST(Errata, E15ShadowFallsByTheRealSpacing) {
  const TileShape shape = TileShape::make(7, 5, 1);  // rows 1 and 3: x = 0 2 4 6; row 2: x = 0 1 3 5 6
  const TileGrid grid = TileGrid::make(shape, 1, 1, 60.0, 60.0);
  ASSERT_EQ(grid.sigma_x(), 10.0);
  std::vector<float> heights(35, 0.0F);
  for (int row = 1; row <= 3; ++row) heights[static_cast<std::size_t>(row * 7 + 1)] = 1000.0F;
  std::vector<float> shadow(35);
  const auto from = [&](int row) {
    const auto begin = shadow.begin() + row * 7 + 1;
    return std::vector<float>(begin, begin + last_visible_column(shape, row));
  };
  tile_shadow(grid, {heights.data(), 7, 5}, {LightTravel::kEastward, 2.0}, {}, {shadow.data(), 7, 5}, {});
  EXPECT_EQ(from(1), (std::vector<float>{1000, 960, 920, 880}));
  EXPECT_EQ(from(2), (std::vector<float>{1000, 980, 940, 900, 880}));
  for (int row = 1; row <= 3; ++row) {
    heights[static_cast<std::size_t>(row * 7 + 1)] = 0.0F;
    heights[static_cast<std::size_t>(row * 7 + last_visible_column(shape, row))] = 1000.0F;
  }
  tile_shadow(grid, {heights.data(), 7, 5}, {LightTravel::kWestward, 2.0}, {}, {shadow.data(), 7, 5}, {});
  EXPECT_EQ(from(2), (std::vector<float>{880, 900, 940, 980, 1000}));
  EXPECT_EQ(from(3), (std::vector<float>{880, 920, 960, 1000}));
}

// With ceiling brackets the penumbra has only the shares 0, 1/k, 2/k, ...
TEST(Errata, E16PenumbraIsContinuous) {
  for (int i = 0; i <= 100; ++i) {
    const double y = -1.0 + 0.02 * i;
    EXPECT_NEAR(sun_share(y, 0.0, 2.0), 0.01 * i, 1e-15);  // roundings of numbers about 1
  }
  EXPECT_NE(sun_share(0.3, 0.0, 2.0), std::ceil(0.3 + 1.0) / 2.0);
}

}  // namespace
}  // namespace isohf
