#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "isohf/light/normals.h"
#include "isohf/mesh.h"
#include "isohf/metadata.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double height_at(LatticeVertex at) {
  return 40.0 * std::sin(0.31 * static_cast<double>(at.x)) * std::cos(0.57 * static_cast<double>(at.z));
}

/// The elevations of a tile of a plane: every 4^plane-th vertex of the hills.
std::vector<double> elevations_of(const TileGrid& grid, TileIndex tile, int scale = 1) {
  std::vector<double> elevations;
  for (int row = 0; row < grid.shape().rows(); ++row) {
    for (int column = 0; column < grid.shape().columns(); ++column) {
      const LatticeVertex at = grid.lattice_vertex(tile, {column, row});
      elevations.push_back(height_at({at.x * scale, at.z * scale}));
    }
  }
  return elevations;
}

TEST(TileVertices, AreThoseOfTheWorldAndOfNormals) {
  const Metadata metadata(TileGrid::make(TileShape::make(12, 11, 2), 3, 2, 640.0, 600.0));
  const TileShape& shape = metadata.grid.shape();
  const TileIndex tile{2, 1};
  const std::vector<double> elevations = elevations_of(metadata.grid, tile);
  const auto vertices = tile_vertices(metadata, tile, elevations, {{1000.0, 500.0}, 2.0});
  std::vector<float> heights;
  for (const double elevation : elevations) heights.push_back(static_cast<float>(2.0 * elevation));
  ASSERT_EQ(vertices.size(), elevations.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const GridVertex at{static_cast<int>(i) % shape.columns(), static_cast<int>(i) / shape.columns()};
    const WorldPoint world = metadata.grid.world_from_lattice(metadata.grid.lattice_vertex(tile, at));
    EXPECT_EQ(vertices[i].position[0], static_cast<float>(world.x - 1000.0));
    EXPECT_EQ(vertices[i].position[1], heights[i]);
    EXPECT_EQ(vertices[i].position[2], static_cast<float>(world.z - 500.0));
    if (!is_visible(shape, at)) continue;
    const Normal normal = vertex_normal(metadata.grid, {heights.data(), shape.columns(), shape.rows()}, at);
    EXPECT_EQ(vertices[i].normal, (std::array{normal.x, normal.y, normal.z}));
  }
}

TEST(TileVertices, SharedByTilesAreTheSameBits) {
  const Metadata metadata(TileGrid::make(TileShape::make(12, 11, 2), 3, 2, 640.0 / 3.0, 600.0 / 7.0));
  const TileShape& shape = metadata.grid.shape();
  std::map<std::pair<std::int64_t, std::int64_t>, MeshVertex> known;
  int shared = 0;
  for (std::int64_t flat = 0; flat < metadata.grid.tile_count(); ++flat) {
    const TileIndex tile = metadata.grid.tile_at(flat);
    const auto vertices = tile_vertices(metadata, tile, elevations_of(metadata.grid, tile), {{123.4, -5.6}, 1.0});
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const GridVertex at{static_cast<int>(i) % shape.columns(), static_cast<int>(i) / shape.columns()};
      if (!is_visible(shape, at)) continue;
      const LatticeVertex lattice = metadata.grid.lattice_vertex(tile, at);
      const auto [found, is_new] = known.try_emplace({lattice.x, lattice.z}, vertices[i]);
      if (is_new) continue;
      ++shared;
      EXPECT_EQ(found->second.position, vertices[i].position);
      EXPECT_EQ(found->second.normal, vertices[i].normal);
    }
  }
  EXPECT_GT(shared, 50);
}

TEST(TileVertices, OfOverviewsLieWhereThoseOfTilesLieAndEndWithThem) {
  Metadata metadata(TileGrid::make(TileShape::make(12, 11, 2), 5, 3, 640.0, 600.0));
  metadata.planes = {4, 2};
  const TileGrid plane = metadata.plane_grid(1);
  ASSERT_EQ(plane.tile_columns(), 2);
  const auto vertices = tile_vertices(metadata, {1, 0}, elevations_of(plane, {1, 0}, 4), {}, 1);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const GridVertex at{static_cast<int>(i) % 12, static_cast<int>(i) / 12};
    if (!is_visible(plane.shape(), at)) continue;
    const WorldPoint world = plane.world_from_object(
        {1, 0}, {static_cast<double>(object_from_grid(plane.shape(), at).x), static_cast<double>(at.row - 1)});
    EXPECT_FLOAT_EQ(vertices[i].position[0], static_cast<float>(std::min(world.x, 5 * 640.0)));
    EXPECT_FLOAT_EQ(vertices[i].position[2], static_cast<float>(std::min(world.z, 3 * 600.0)));
  }
}

TEST(TileVertices, AtAndBesideNodataPointUp) {
  const Metadata metadata(TileGrid::make(TileShape::make(12, 11, 2), 1, 1, 640.0, 600.0));
  std::vector<double> elevations = elevations_of(metadata.grid, {0, 0});
  constexpr std::size_t kNodataVertex = 5 + 5 * 12;
  elevations[kNodataVertex] = kNan;
  const auto vertices = tile_vertices(metadata, {0, 0}, elevations);
  EXPECT_TRUE(std::isnan(vertices[kNodataVertex].position[1]));
  for (const std::size_t i : {kNodataVertex, kNodataVertex + 1, kNodataVertex - 12}) {
    EXPECT_EQ(vertices[i].normal, (std::array{0.0F, 1.0F, 0.0F}));
  }
  EXPECT_NE(vertices[kNodataVertex + 2].normal, (std::array{0.0F, 1.0F, 0.0F}));
}

TEST(TileVertices, OfNoTileAreRefused) {
  const Metadata metadata(TileGrid::make(TileShape::make(12, 11, 2), 2, 1, 640.0, 600.0));
  const std::vector<double> elevations(132, 1.0);
  const auto refusal = [&](TileIndex tile, std::span<const double> given, int plane) -> std::string {
    try {
      (void)tile_vertices(metadata, tile, given, {}, plane);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.what();
    }
    return "done";
  };
  EXPECT_EQ(refusal({1, 0}, elevations, 0), "done");
  EXPECT_THAT(refusal({2, 0}, elevations, 0), HasSubstr("no tile (2,0)"));
  EXPECT_THAT(refusal({0, -1}, elevations, 0), HasSubstr("no tile (0,-1)"));
  EXPECT_THAT(refusal({0, 0}, std::span(elevations).first(131), 0), HasSubstr("131 elevations"));
  EXPECT_THAT(refusal({0, 0}, elevations, 1), HasSubstr("plane 1"));
}

}  // namespace
}  // namespace isohf
