#include "isohf/lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "isohf/error.h"
#include "lattice/mesh_check.h"

namespace isohf {
namespace {

const double kInf = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(TileGrid, RefusesImpossibleSizesAndExtents) {
  const TileShape shape = TileShape::make(5, 5, 1);
  EXPECT_THROW((void)TileGrid::make(shape, 0, 1, 1.0, 1.0), Error);
  EXPECT_THROW((void)TileGrid::make(shape, 1, -1, 1.0, 1.0), Error);
  EXPECT_THROW((void)TileGrid::make(shape, kMaxTilesPerAxis + 1, 1, 1.0, 1.0), Error);
  EXPECT_THROW((void)TileGrid::make(shape, 1 << 17, 1 << 17, 1.0, 1.0), Error);
  EXPECT_NO_THROW((void)TileGrid::make(shape, 1 << 16, 1 << 16, 1.0, 1.0));
  for (const double extent : {0.0, -1.0, kNan, kInf, 1e-31, 1e31}) {
    EXPECT_THROW((void)TileGrid::make(shape, 1, 1, extent, 1.0), Error) << extent;
    EXPECT_THROW((void)TileGrid::make(shape, 1, 1, 1.0, extent), Error) << extent;
  }
}

TEST(TileGrid, Eq2SpacingsFillTheTile) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 3, 2, 80.0, 24.0);
  EXPECT_EQ(grid.sigma_x(), 80.0 / 16.0);
  EXPECT_EQ(grid.sigma_z(), 24.0 / 8.0);
  EXPECT_EQ(grid.world_width(), 240.0);
  EXPECT_EQ(grid.world_height(), 48.0);
}

TEST(TileGrid, Eq15NumbersTilesColumnBeforeRow) {
  const TileGrid grid = TileGrid::make(TileShape::make(5, 5, 1), 7, 3, 1.0, 1.0);
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) EXPECT_EQ(grid.flat_index(grid.tile_at(i)), i);
  EXPECT_EQ(grid.flat_index({2, 1}), 9);
  EXPECT_TRUE(grid.contains(TileIndex{6, 2}));
  EXPECT_FALSE(grid.contains(TileIndex{7, 2}));
  EXPECT_FALSE(grid.contains(TileIndex{0, -1}));
}

TEST(TileGrid, SharedVerticesHaveOneNameAndOnePlace) {
  for (const TileShape& shape : test::deepest_shapes(9, 11)) {
    const TileGrid grid = TileGrid::make(shape, 3, 3, 0.1, 0.7);
    std::map<std::pair<std::int64_t, std::int64_t>, int> tiles_of;
    for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
      for (int r = 0; r < shape.rows(); ++r) {
        for (int c = 0; c < shape.columns(); ++c) {
          if (!is_visible(shape, {c, r})) continue;
          const LatticeVertex v = grid.lattice_vertex(grid.tile_at(i), {c, r});
          ++tiles_of[{v.x, v.z}];
          const ObjectVertex object = object_from_grid(shape, GridVertex{c, r});
          const WorldPoint by_tile = grid.world_from_object(
              grid.tile_at(i), ObjectPoint{static_cast<double>(object.x), static_cast<double>(object.z)});
          ASSERT_EQ(by_tile.x, grid.world_from_lattice(v).x);
          ASSERT_EQ(by_tile.z, grid.world_from_lattice(v).z);
        }
      }
    }
    // Straight edges: on the lattice lines between tiles two tiles hold the vertex, at the crossings four.
    for (const auto& [at, tiles] : tiles_of) {
      const std::int64_t width = 2 * shape.cell_columns();
      const bool on_x = at.first % width == 0 && at.first != 0 && at.first != 3 * width;
      const bool on_z = at.second % shape.cell_rows() == 0 && at.second != 0 && at.second != 3 * shape.cell_rows();
      ASSERT_EQ(tiles, (on_x ? 2 : 1) * (on_z ? 2 : 1)) << at.first << "," << at.second;
    }
  }
}

TEST(TileGrid, LocateUndoesWorldFromObjectAtRandomPoints) {
  constexpr unsigned kSeed = 4711;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const TileShape shape = TileShape::make(12, 11, 3);
  const TileGrid grid = TileGrid::make(shape, 5, 4, 123.456, 0.0321);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (int i = 0; i < 50000; ++i) {
    const TileIndex tile{static_cast<std::int64_t>(5 * any(random)), static_cast<std::int64_t>(4 * any(random))};
    ObjectPoint point{16.0 * any(random), 8.0 * any(random)};
    if (i % 3 == 1) point.x = any(random);         // half triangles at the West edge
    if (i % 3 == 2) point.x = 16.0 - any(random);  // and at the East edge
    const TilePoint found = grid.locate(grid.world_from_object(tile, point));
    ASSERT_EQ(found.tile, tile);
    ASSERT_NEAR(found.point.x, point.x, 1e-12);  // some roundings of coordinates below 80
    ASSERT_NEAR(found.point.z, point.z, 1e-12);
  }
}

TEST(TileGrid, LocateGivesEdgesToTheTileEastOrSouthAndBordersToTheLast) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 3, 2, 64.0, 32.0);
  EXPECT_EQ(grid.locate({64.0, 32.0}).tile, (TileIndex{1, 1}));
  EXPECT_EQ(grid.locate({64.0, 32.0}).point.x, 0.0);
  EXPECT_EQ(grid.locate({std::nextafter(64.0, 0.0), 0.0}).tile, (TileIndex{0, 0}));
  EXPECT_EQ(grid.locate({192.0, 64.0}).tile, (TileIndex{2, 1}));
  EXPECT_EQ(grid.locate({192.0, 64.0}).point.x, 16.0);
  EXPECT_EQ(grid.locate({192.0, 64.0}).point.z, 8.0);
}

TEST(TileGrid, LocateMovesPointsOutsideToTheBorder) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 3, 2, 64.0, 32.0);
  const auto expect_at = [&](WorldPoint point, TileIndex tile, ObjectPoint object) {
    EXPECT_FALSE(grid.contains(point));
    const TilePoint found = grid.locate(point);
    EXPECT_EQ(found.tile, tile);
    EXPECT_EQ(found.point.x, object.x);
    EXPECT_EQ(found.point.z, object.z);
  };
  expect_at({-1.0, -1e300}, {0, 0}, {0.0, 0.0});
  expect_at({1e300, 33.0 * 2}, {2, 1}, {16.0, 8.0});
  expect_at({kInf, -kInf}, {2, 0}, {16.0, 0.0});
  expect_at({kNan, kNan}, {0, 0}, {0.0, 0.0});
  EXPECT_TRUE(grid.contains(WorldPoint{0.0, 64.0}));
  EXPECT_TRUE(grid.contains(WorldPoint{192.0, 0.0}));
}

TEST(TileGrid, LocateIsSafeBesideEveryEdgeOfAwkwardExtents) {
  // Extents that are no binary fractions: the division may land on either side of an edge, the result may not leave
  // the tile, and must be the same place.
  for (const double extent : {0.1, 1.0 / 3.0, 1e-9, 30.87, 1e20}) {
    const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 1000, 1, extent, extent);
    for (std::int64_t tile = 0; tile <= 1000; ++tile) {
      const double edge = static_cast<double>(tile) * extent;
      for (const double x : {std::nextafter(edge, 0.0), edge, std::nextafter(edge, 2.0 * edge + extent)}) {
        const TilePoint at = grid.locate({x, 0.0});
        ASSERT_GE(at.point.x, 0.0);
        ASSERT_LE(at.point.x, 16.0);
        ASSERT_NEAR(grid.world_from_object(at.tile, at.point).x, x, 4e-16 * (x + extent) * 2);
      }
    }
  }
}

TEST(Errata, E13TheTileIsFoundByWorldLengths) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 3), 4, 4, 2.0, 2.0);
  const WorldPoint point{5.0, 3.0};
  EXPECT_EQ(grid.locate(point).tile, (TileIndex{2, 1}));
  // As printed: P' = P / sigma in object space, then divided by the extent, a world length.
  EXPECT_EQ(std::floor(point.x / grid.sigma_x() / grid.extent_x()), 20.0);
}

}  // namespace
}  // namespace isohf
