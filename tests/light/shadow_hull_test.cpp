#include "isohf/light/shadow_hull.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isohf/light/shadow_sweep.h"
#include "light/shadow_world.h"

namespace isohf {
namespace {

using Terrain = ShadowWorld::Terrain;

/// What enters each tile of a row, carried from tile to tile.
std::vector<CasterRows> carry(const ShadowWorld& world, LightTravel travel, double fall_min) {
  const TileShape& shape = world.shape();
  std::vector<CasterRows> entering(static_cast<std::size_t>(world.grid.tile_columns()));
  CasterRows handed = no_casters(shape);
  for (std::int64_t i = 0; i < world.grid.tile_columns(); ++i) {
    const std::int64_t tile = travel == LightTravel::kEastward ? i : world.grid.tile_columns() - 1 - i;
    const std::vector<std::uint16_t> codes = world.tile_codes(tile);
    entering[static_cast<std::size_t>(tile)] = beyond_padding(handed);
    const View2D<const std::uint16_t> view(codes.data(), shape.columns(), shape.rows());
    const TileCasters own = tile_casters(shape, view, ShadowWorld::kVoid, fall_min);
    handed = pass_on_casters(shape, handed, travel == LightTravel::kEastward ? own.eastward : own.westward, fall_min);
  }
  return entering;
}

/// What casts the shadow on the edge where light enters a tile, from its seeds and the vertex before that edge.
ShadowCaster caster_at_edge(const ShadowWorld& world, const CasterRows& entering, std::int64_t tile, int row,
                            LightTravel travel, double fall) {
  std::vector<ShadowCaster> casters(entering.row(row).begin(), entering.row(row).end());
  const bool east = travel == LightTravel::kEastward;
  const std::int64_t before = east ? tile - 1 : tile + 1;
  if (before >= 0 && before < world.grid.tile_columns()) {
    const std::uint16_t code = world.code(before, east ? last_visible_column(world.shape(), row) - 1 : 2, row);
    if (code != ShadowWorld::kVoid) casters.push_back({padding_distance(row), static_cast<double>(code)});
  }
  ShadowCaster highest{0, -HUGE_VAL};
  for (const ShadowCaster& caster : casters) {
    const auto at_edge = [fall](const ShadowCaster& c) { return c.height - static_cast<double>(c.distance) * fall; };
    if (at_edge(caster) > at_edge(highest)) highest = caster;
  }
  return highest;
}

/// The same from all vertices before the edge.
ShadowCaster caster_by_definition(const ShadowWorld& world, std::int64_t tile, int row, LightTravel travel,
                                  double fall) {
  const bool east = travel == LightTravel::kEastward;
  const int across = half_steps_across(world.shape());
  ShadowCaster highest{0, -HUGE_VAL};
  for (std::int64_t other = tile; other >= 0 && other < world.grid.tile_columns(); other += east ? -1 : 1) {
    for (int c = 1; c <= last_visible_column(world.shape(), row); ++c) {
      const int x = object_x(world.shape().columns(), c, row);
      const std::int64_t distance = std::abs(other - tile) * across - (east ? x : across - x);
      const std::uint16_t code = world.code(other, c, row);
      if (distance <= 0 || code == ShadowWorld::kVoid) continue;
      const double height = code - static_cast<double>(distance) * fall;
      if (height > highest.height - static_cast<double>(highest.distance) * fall) {
        highest = {distance, static_cast<double>(code)};
      }
    }
  }
  return highest;
}

void expect_seeds_equal_definition(const ShadowWorld& world, double fall_min) {
  for (const LightTravel travel : kBothTravels) {
    const std::vector<CasterRows> entering = carry(world, travel, fall_min);
    for (std::int64_t tile = 0; tile < world.grid.tile_columns(); ++tile) {
      for (int row = 1; row <= visible_rows(world.shape()); ++row) {
        for (double fall = fall_min; fall < 1e6; fall = std::max(2.03 * fall, 0.1)) {
          const ShadowCaster wanted = caster_by_definition(world, tile, row, travel, fall);
          const ShadowCaster found =
              caster_at_edge(world, entering[static_cast<std::size_t>(tile)], tile, row, travel, fall);
          // Of two that cast as high either may be listed, but where the sun is the lowest the nearer one is.
          ASSERT_EQ(found.height - static_cast<double>(found.distance) * fall,
                    wanted.height - static_cast<double>(wanted.distance) * fall)
              << "tile " << tile << " row " << row << " fall " << fall;
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

/// Hidden parts of a row of tiles as floats' bits, swept at once or each tile by itself from its seeds.
class SeededSweep : public testing::Test {
 protected:
  /// Heights with their padding, NaN where void.
  static std::vector<float> heights(const ShadowWorld& world, std::int64_t tile, double scale) {
    const TileShape& shape = world.shape();
    std::vector<float> out(static_cast<std::size_t>(shape.stored_vertex_count()), NAN);
    const auto set = [&](int row, int column, std::uint16_t code) {
      if (code == ShadowWorld::kVoid) return;
      out[static_cast<std::size_t>(row * shape.columns() + column)] = static_cast<float>(scale * code);
    };
    for (int row = 1; row <= visible_rows(shape); ++row) {
      const int last = last_visible_column(shape, row);
      for (int c = 1; c <= last; ++c) set(row, c, world.code(tile, c, row));
      // Beyond all tiles it is anything.
      set(row, 0, tile > 0 ? world.code(tile - 1, last - 1, row) : 65000);
      set(row, last + 1, tile + 1 < world.grid.tile_columns() ? world.code(tile + 1, 2, row) : 65000);
    }
    return out;
  }

  /// scale    of codes to heights that need not be whole
  /// covered  share of the world that casts shadows
  static void expect_equal(const ShadowWorld& world, double elevation_deg, double scale, double covered,
                           std::int64_t& hidden) {
    const TileGrid& grid = world.grid;
    const WorldBounds ground{0.0, 0.0, covered * grid.world_width(), covered * grid.world_height()};
    ShadowWorld casting = world;
    for (std::size_t r = 0; r < casting.codes.size(); ++r) {
      for (std::size_t x = 0; x < casting.codes[r].size(); ++x) {
        const bool casts = static_cast<std::int64_t>(x) <= last_casting_step(ground.x1, grid.sigma_x()) &&
                           static_cast<std::int64_t>(r) <= last_casting_step(ground.z1, grid.sigma_z());
        if (!casts) casting.codes[r][x] = ShadowWorld::kVoid;
      }
    }
    TileRowValues row_heights(grid, std::nullopt);
    for (std::int64_t tile = 0; tile < grid.tile_columns(); ++tile) {
      row_heights.write_tile(tile, heights(world, tile, scale));
    }
    for (const LightTravel travel : kBothTravels) {
      const double azimuth = travel == LightTravel::kEastward ? 270.0 : 90.0;
      const SweptSun sun = swept_sun(azimuth, elevation_deg, sun_radius_deg("Earth"), 1.0, 40.0 * scale);
      ShadowSweep whole(grid, ground, sun);
      TileRowValues want(grid, std::nullopt);
      ASSERT_EQ(whole.travel(), travel);
      (void)whole.pass(0, {}, row_heights, &want);
      const std::vector<CasterRows> seeds = carry(casting, travel, sun.lower_fall / scale * grid.sigma_x());
      for (std::int64_t tile = 0; tile < grid.tile_columns(); ++tile) {
        const TileGrid own = TileGrid::make(grid.shape(), 1, 1, grid.extent_x(), grid.extent_z());
        const double x = static_cast<double>(tile) * grid.extent_x();
        ShadowSweep sweep(own, {ground.x0 - x, ground.z0, ground.x1 - x, ground.z1}, sun);
        sweep.begin_behind(tile, grid.tile_columns() - 1 - tile, 0);
        const std::vector<float> read = heights(world, tile, scale);
        CasterRows casters = seeds[static_cast<std::size_t>(tile)];
        for (ShadowCaster& caster : casters.casters) caster.height *= scale;
        TileRowValues tile_heights(own, std::nullopt);
        TileRowValues found(own, std::nullopt);
        tile_heights.write_tile(0, read);
        (void)sweep.pass(0, sweep.entering(0, casters, read), tile_heights, &found);
        const std::vector<float> got = found.tile(0);
        const std::vector<float> wanted = want.tile(tile);
        for (int row = 1; row <= visible_rows(grid.shape()); ++row) {
          for (int c = 1; c <= last_visible_column(grid.shape(), row); ++c) {
            const auto i = static_cast<std::size_t>(row * grid.shape().columns() + c);
            ASSERT_EQ(got[i], wanted[i]) << "tile " << tile << " row " << row << " column " << c << " from " << azimuth
                                         << " at " << elevation_deg;
            hidden += wanted[i] > 0.0F ? 1 : 0;
          }
        }
      }
    }
  }
};

TEST_F(SeededSweep, EqualsThatOfAllTilesBitForBit) {
  std::int64_t hidden = 0;
  unsigned seed = 400;
  for (const auto& [columns, rows] : {std::pair{5, 5}, {6, 7}, {12, 11}, {21, 23}, {60, 11}}) {
    const TileShape shape = TileShape::make(columns, rows, 1);
    for (const Terrain terrain : kAllTerrains) {
      for (const double elevation_deg : {0.3, 2.0, 5.0, 15.0, 45.0, 75.0}) {
        for (const double scale : {1.0, 0.0137}) {
          SCOPED_TRACE(testing::Message() << columns << "x" << rows << " seed " << seed);
          const ShadowWorld world(shape, 7, 1000.0, terrain, ++seed);
          ASSERT_NO_FATAL_FAILURE(expect_equal(world, elevation_deg, scale, 1.0, hidden));
          ASSERT_NO_FATAL_FAILURE(expect_equal(world, elevation_deg, scale, 0.63, hidden));
        }
      }
    }
  }
  EXPECT_GT(hidden, 100000);
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
