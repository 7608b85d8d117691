#include "isohf/light/shadow_hull.h"

#include <gtest/gtest.h>

#include <cmath>

#include "light/shadow_world.h"

namespace isohf {
namespace {

using Terrain = ShadowWorld::Terrain;

/// What enters each tile of a row, carried from tile to tile.
std::vector<CasterRows> carry(const ShadowWorld& world, LightTravel travel, double fall_min, double lowest = 0.0) {
  const TileShape& shape = world.shape();
  std::vector<CasterRows> entering(static_cast<std::size_t>(world.grid.tile_columns()));
  CasterRows handed = no_casters(shape);
  for (std::int64_t i = 0; i < world.grid.tile_columns(); ++i) {
    const std::int64_t tile = travel == LightTravel::kEastward ? i : world.grid.tile_columns() - 1 - i;
    const std::vector<std::uint16_t> codes = world.tile_codes(tile);
    entering[static_cast<std::size_t>(tile)] = handed;
    const View2D<const std::uint16_t> view(codes.data(), shape.columns(), shape.rows());
    const TileCasters own = tile_casters(shape, view, ShadowWorld::kVoid, fall_min);
    handed = pass_on_casters(shape, handed, travel == LightTravel::kEastward ? own.eastward : own.westward, fall_min,
                             lowest);
  }
  return entering;
}

/// S at the edge where light enters a tile, from the seeds and the tile's own vertex there.
double shadow_at_edge(const ShadowWorld& world, const CasterRows& entering, std::int64_t tile, int row,
                      LightTravel travel, double fall) {
  const int column = travel == LightTravel::kEastward ? 1 : last_visible_column(world.shape(), row);
  const std::uint16_t own = world.code(tile, column, row);
  const double seed = shadow_height_from(entering.row(row), fall);
  return own == ShadowWorld::kVoid ? seed : std::max<double>(own, seed);
}

void expect_seeds_equal_definition(const ShadowWorld& world, double fall_min) {
  for (const LightTravel travel : kBothTravels) {
    const std::vector<CasterRows> entering = carry(world, travel, fall_min);
    for (std::int64_t tile = 0; tile < world.grid.tile_columns(); ++tile) {
      for (int row = 1; row <= visible_rows(world.shape()); ++row) {
        const int column = travel == LightTravel::kEastward ? 1 : last_visible_column(world.shape(), row);
        for (double fall = fall_min; fall < 1e6; fall = std::max(2.0 * fall, 0.1)) {
          const double wanted = world.shadow(tile, column, row, travel, fall);
          const double found = shadow_at_edge(world, entering[static_cast<std::size_t>(tile)], tile, row, travel, fall);
          if (wanted <= 0.0) {
            ASSERT_LE(found, 0.0);  // under the lowest elevation seeds may be dropped
          } else {
            ASSERT_EQ(found, wanted) << "tile " << tile << " row " << row << " fall " << fall;  // the same expression
          }
        }
      }
    }
  }
}

TEST(ShadowHull, SeedsEqualTheDefinitionForAllTerrainsShapesAndAngles) {
  unsigned seed = 100;
  for (const auto& [columns, rows] : {std::pair{5, 5}, {6, 7}, {12, 11}, {21, 23}, {60, 11}, {101, 5}}) {
    const TileShape shape = TileShape::make(columns, rows, 1);
    for (const std::int64_t tiles : {2, 3, 7}) {
      for (const Terrain terrain : kAllTerrains) {
        for (const double fall_min : {0.0, 1.0, 40.0, 3000.0}) {
          SCOPED_TRACE(testing::Message() << columns << "x" << rows << " seed " << seed << " from " << fall_min);
          expect_seeds_equal_definition(ShadowWorld(shape, tiles, 1000.0, terrain, ++seed), fall_min);
        }
      }
    }
  }
}

TEST(ShadowHull, SeedsEqualTheDefinitionOverFiftyTiles) {
  for (const Terrain terrain : {Terrain::kRidges, Terrain::kHoles}) {
    expect_seeds_equal_definition(ShadowWorld(TileShape::make(12, 7, 1), 50, 1000.0, terrain, 77), 5.0);
  }
}

TEST(ShadowHull, EveryCasterListedMatters) {
  const ShadowWorld world(TileShape::make(21, 23, 1), 6, 17.0, Terrain::kRidges, 21);
  const double fall_min = 2.0;
  std::size_t casters = 0;
  for (const LightTravel travel : kBothTravels) {
    for (const CasterRows& rows : carry(world, travel, fall_min)) {
      for (int row = 1; row <= visible_rows(world.shape()); ++row) {
        const auto hull = rows.row(row);
        casters += hull.size();
        double slope_before = HUGE_VAL;
        for (std::size_t i = 0; i + 1 < hull.size(); ++i) {
          const double slope =
              (hull[i + 1].height - hull[i].height) / static_cast<double>(hull[i + 1].distance - hull[i].distance);
          ASSERT_GT(slope, fall_min);
          ASSERT_LT(slope, slope_before);
          slope_before = slope;
        }
      }
    }
  }
  EXPECT_GT(casters, 100U);
}

TEST(ShadowHull, FlatLandHandsNothingOn) {
  const ShadowWorld world(TileShape::make(12, 11, 1), 3, 17.0, Terrain::kFlat, 1);
  for (const CasterRows& rows : carry(world, LightTravel::kEastward, 0.0)) EXPECT_TRUE(rows.casters.empty());
}

TEST(ShadowHull, ShadowsThatHaveSunkUnderTheLowestElevationAreDropped) {
  const TileShape shape = TileShape::make(5, 5, 1);
  CasterRows entering = no_casters(shape);
  entering.starts = {0, 2, 2, 2};
  entering.casters = {{3, 10.0}, {7, 12.0}};
  const CasterRows own = no_casters(shape);  // a void tile
  EXPECT_EQ(pass_on_casters(shape, entering, own, 0.1, 11.0).casters.size(), 2U);
  EXPECT_EQ(pass_on_casters(shape, entering, own, 0.1, 11.2).casters.size(), 0U);
}

TEST(ShadowHull, FloatsAndCodesGiveTheSameCasters) {
  const ShadowWorld world(TileShape::make(12, 11, 1), 1, 17.0, Terrain::kHoles, 5);
  const TileShape& shape = world.shape();
  const auto codes = world.tile_codes(0);
  const auto heights = world.tile_heights(0);
  const TileCasters by_code = tile_casters(shape, View2D<const std::uint16_t>(codes.data(), 12, 11), 65535, 1.0);
  const TileCasters by_height = tile_casters(shape, View2D<const float>(heights.data(), 12, 11), 1.0);
  EXPECT_EQ(by_code.eastward, by_height.eastward);
  EXPECT_EQ(by_code.westward, by_height.westward);
}

TEST(ShadowPath, OrdinalsAndDistancesAreInverse) {
  for (const int columns : {5, 6, 9, 12}) {
    const TileShape shape = TileShape::make(columns, 7, 1);
    for (const int row : {1, 2}) {
      std::int64_t vertices = 0;
      for (std::int64_t distance = 0; distance < 5 * half_steps_across(shape); ++distance) {
        // A vertex stands there in one of the tiles beyond the edge.
        const auto place = static_cast<int>(distance % half_steps_across(shape));
        bool found = false;
        for (int c = 1; c <= last_visible_column(shape, row); ++c) found |= object_x(columns, c, row) == place;
        const std::int64_t ordinal = ordinal_from_distance(shape, row, distance);
        ASSERT_EQ(ordinal, found ? vertices : -1);
        if (found) {
          ASSERT_EQ(distance_from_ordinal(shape, row, vertices++), distance);
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
