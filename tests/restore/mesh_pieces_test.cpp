#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/mesh.h"
#include "isohf/restore/mesh/level_error.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

/// An archive of 5 x 3 tiles with overviews, with a lake of nodata or without.
class MeshPieces : public testing::Test {
 protected:
  [[nodiscard]] std::string make(bool has_lake) const {
    test::MemorySource<float> source(SampleType::kFloat32, 240, 150, [has_lake](std::int64_t c, std::int64_t r) {
      const auto x = static_cast<double>(c);
      const auto z = static_cast<double>(r);
      if (has_lake && std::hypot(x - 100.0, z - 70.0) < 20.0) return std::numeric_limits<double>::quiet_NaN();
      const double roughness = std::pow(x / 240.0, 2.0);  // grows from West to East
      return 300.0 + 40.0 * roughness * std::sin(x * 0.3) * std::cos(z * 0.25);
    });
    source.mutable_info().georeference.spacing_x = source.mutable_info().georeference.spacing_y = 10.0;
    ConvertOptions options;
    options.plan.shape = {52, 51};
    options.plan.levels = 4;
    options.plan.fit = true;
    options.overwrite = true;
    std::string path = folder / (has_lake ? "lake.isohf" : "land.isohf");
    (void)convert(source, path, options);
    return path;
  }

  const test::TemporaryFolder folder;
};

/// A place on the ground in whole lattice steps of plane 0: pieces have floats relative to corners of their own.
using Place = std::pair<std::int64_t, std::int64_t>;

struct Joined {
  std::map<std::pair<Place, Place>, int> edges;  ///< of triangles with an area, by direction
  std::map<Place, float> heights;
  std::int64_t triangles = 0;
  double area = 0.0;  ///< of the ground
};

Joined join(const ArchiveReader& archive, const MeshPlan& plan) {
  Joined joined;
  const TileGrid& grid = archive.grid();
  read_mesh(archive, plan, [&](const MeshPiece& piece) {
    const auto place = [&](std::uint32_t vertex) {
      const auto& at = piece.vertices[vertex].position;
      const double x = plan.corner.x + piece.corner.x + static_cast<double>(at[0]);
      const double z = plan.corner.z + piece.corner.z + static_cast<double>(at[2]);
      const Place found{std::llround(x / grid.sigma_x()), std::llround(z / grid.sigma_z())};
      EXPECT_NEAR(static_cast<double>(found.first) * grid.sigma_x(), x, 1e-3);
      EXPECT_EQ(joined.heights.try_emplace(found, at[1]).first->second, at[1]);
      return found;
    };
    ASSERT_EQ(piece.indices.size() % 3, 0U);
    for (std::size_t i = 0; i < piece.indices.size(); i += 3) {
      const Place corners[] = {place(piece.indices[i]), place(piece.indices[i + 1]), place(piece.indices[i + 2])};
      for (std::size_t k = 0; k < 3; ++k) ++joined.edges[{corners[k], corners[(k + 1) % 3]}];
      const auto& [a, b, c] = corners;
      joined.area += 0.5 * static_cast<double>((b.second - a.second) * (c.first - a.first) -
                                               (b.first - a.first) * (c.second - a.second));
      ++joined.triangles;
    }
  });
  return joined;
}

/// Edges with a triangle on one side alone.
std::vector<std::pair<Place, Place>> open_edges(const Joined& joined) {
  std::vector<std::pair<Place, Place>> open;
  for (const auto& [edge, count] : joined.edges) {
    const auto other = joined.edges.find({edge.second, edge.first});
    if (other == joined.edges.end() || other->second != count) open.push_back(edge);
  }
  return open;
}

void expect_no_crack(const ArchiveReader& archive, const MeshPlan& plan) {
  const Joined joined = join(archive, plan);
  const TileGrid& grid = archive.grid();
  const std::int64_t width = 2 * grid.shape().cell_columns() * grid.tile_columns();
  const std::int64_t height = grid.shape().cell_rows() * grid.tile_rows();
  EXPECT_EQ(joined.area, static_cast<double>(width * height));
  EXPECT_LE(joined.triangles, plan.triangles);
  for (const auto& [from, to] : open_edges(joined)) {
    const bool is_border = (from.first == to.first && (from.first == 0 || from.first == width)) ||
                           (from.second == to.second && (from.second == 0 || from.second == height));
    ASSERT_TRUE(is_border) << from.first << "," << from.second << " to " << to.first << "," << to.second;
  }
}

TEST_F(MeshPieces, OfOneLevelMeetWithoutStitches) {
  const ArchiveReader archive(make(false));
  for (int level = 0; level < 4 + 2 * archive.metadata().planes.count; ++level) {
    const MeshPlan plan = plan_mesh(archive, {.level = level});
    EXPECT_TRUE(plan.levels.empty());
    expect_no_crack(archive, plan);
  }
}

TEST_F(MeshPieces, OfManyLevelsMeetToo) {
  const ArchiveReader archive(make(false));
  const MeshPlan plan = plan_mesh(archive, {.max_error = 1.0});
  EXPECT_EQ(static_cast<std::int64_t>(plan.levels.size()), archive.grid().tile_count());
  EXPECT_GT(*std::max_element(plan.levels.begin(), plan.levels.end()), 1);
  EXPECT_EQ(*std::min_element(plan.levels.begin(), plan.levels.end()), 0);
  expect_no_crack(archive, plan);
  for (std::int64_t flat = 0; flat < archive.grid().tile_count(); ++flat) {
    const TileIndex tile = archive.grid().tile_at(flat);
    const std::vector<double> elevations = archive.read_elevations(tile);
    const int level = plan.level_of(tile);
    EXPECT_LE(level_error(archive.grid().shape(), level, elevations), 1.0);
    if (level == 3) continue;
    EXPECT_GT(level_error(archive.grid().shape(), level + 1, elevations), 1.0);
  }
}

TEST_F(MeshPieces, HaveNoMoreTrianglesThanAreAskedFor) {
  const ArchiveReader archive(make(false));
  const std::int64_t all = plan_mesh(archive, {}).triangles;
  EXPECT_EQ(all, archive.grid().tile_count() * archive.grid().shape().triangle_count());
  for (const std::int64_t most : {all, all - 1, all / 4, all / 60}) {
    const MeshPlan plan = plan_mesh(archive, {.max_triangles = most});
    EXPECT_LE(plan.triangles, most);
    EXPECT_GT(plan.triangles * 5, most);  // four times as many are the next level
    expect_no_crack(archive, plan);
  }
}

TEST_F(MeshPieces, LeaveOutNodata) {
  const ArchiveReader archive(make(true));
  const Joined joined = join(archive, plan_mesh(archive, {}));
  for (const auto& [place, height] : joined.heights) EXPECT_TRUE(std::isfinite(height));
  const TileGrid& grid = archive.grid();
  const double lake = (grid.world_width() * grid.world_height() / (grid.sigma_x() * grid.sigma_z()) - joined.area) *
                      grid.sigma_x() * grid.sigma_z();
  EXPECT_NEAR(lake, M_PI * 200.0 * 200.0, 0.12 * M_PI * 200.0 * 200.0);  // its shore is a sample wide
}

TEST_F(MeshPieces, OfSomeTilesBeginAtTheirCorner) {
  const ArchiveReader archive(make(false));
  const MeshPlan plan = plan_mesh(archive, {.tiles = TileRange{{1, 1}, {3, 2}}, .elevation_scale = 2.0});
  EXPECT_EQ(plan.size.x, 2.0 * archive.grid().extent_x());
  EXPECT_EQ(plan.corner.x, archive.grid().extent_x());
  EXPECT_EQ(plan.corner.z, archive.grid().extent_z());
  std::vector<TileIndex> tiles;
  read_mesh(archive, plan, [&](const MeshPiece& piece) {
    tiles.push_back(piece.tile);
    EXPECT_EQ(piece.corner.x, static_cast<double>(piece.tile.column - 1) * archive.grid().extent_x());
    EXPECT_EQ(piece.vertices.size(), piece.texture_places.size());
    const std::vector<double> elevations = archive.read_elevations(piece.tile);
    for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
      const auto& [position, normal] = piece.vertices[i];
      const double x = (piece.corner.x + static_cast<double>(position[0])) / plan.size.x;
      EXPECT_NEAR(x, piece.texture_places[i][0], 1e-6);
      EXPECT_NEAR(position[2] / archive.grid().extent_z(), piece.texture_places[i][1], 1e-6);
      EXPECT_GT(position[1], 2.0F * 250.0F);
      EXPECT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1.0, 1e-6);
    }
  });
  EXPECT_THAT(tiles, testing::ElementsAre(TileIndex{1, 1}, TileIndex{2, 1}));
}

TEST_F(MeshPieces, HaveTextureCoordinatesOfTheirTileOnRequest) {
  const ArchiveReader archive(make(false));
  MeshPlan plan = plan_mesh(archive, {.level = 3});
  ASSERT_EQ(plan.plane, 1);
  plan = plan_mesh(archive, {.level = 2});
  plan.texture_span = TextureSpan::kTile;
  read_mesh(archive, plan, [&](const MeshPiece& piece) {
    std::array<float, 2> most{};
    for (const auto& place : piece.texture_places) {
      most = {std::max(most[0], place[0]), std::max(most[1], place[1])};
    }
    EXPECT_NEAR(most[0], 1.0, 1e-6);
    EXPECT_NEAR(most[1], 1.0, 1e-6);
  });
}

TEST_F(MeshPieces, RefuseRequestsThatMakeNoSense) {
  const ArchiveReader archive(make(false));
  const auto refusal = [&](const MeshRequest& request) -> std::string {
    try {
      (void)plan_mesh(archive, request);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.what();
    }
    return "done";
  };
  EXPECT_THAT(refusal({.tiles = TileRange{{0, 0}, {99, 1}}}), HasSubstr("`tiles`"));
  EXPECT_THAT(refusal({.tiles = TileRange{{1, 1}, {1, 1}}}), HasSubstr("`tiles`"));
  EXPECT_THAT(refusal({.level = 99}), HasSubstr("`level`"));
  EXPECT_THAT(refusal({.level = -1}), HasSubstr("`level`"));
  EXPECT_THAT(refusal({.max_triangles = 1}), HasSubstr("`max_triangles`"));
  EXPECT_THAT(refusal({.max_error = -1.0}), HasSubstr("`max_error`"));
  EXPECT_THAT(refusal({.max_error = std::nan("")}), HasSubstr("`max_error`"));
  EXPECT_THAT(refusal({.level = 0, .max_triangles = 5}), HasSubstr("exclude"));
}

TEST(LevelError, IsZeroOnPlanesAndThatOfTheTrianglesElsewhere) {
  const TileShape shape = TileShape::make(20, 19, 4);
  const auto elevations_by = [&](const std::function<double(ObjectVertex)>& height) {
    std::vector<double> elevations;
    for (int row = 0; row < shape.rows(); ++row) {
      for (int column = 0; column < shape.columns(); ++column) {
        elevations.push_back(height(object_from_grid(shape, {column, row})));
      }
    }
    return elevations;
  };
  const auto plane = elevations_by([](ObjectVertex at) { return 3.0 * at.x - 2.0 * at.z; });
  for (int level = 0; level < 4; ++level) EXPECT_NEAR(level_error(shape, level, plane), 0.0, 1e-12);
  // One vertex that only level 0 has stands out by 7.
  auto bump = elevations_by([](ObjectVertex) { return 5.0; });
  bump[8 + 8 * 20] = 12.0;
  for (int level = 1; level < 4; ++level) EXPECT_EQ(level_error(shape, level, bump), 7.0);
  bump[8 + 8 * 20] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(level_error(shape, 0, bump), 0.0);
  EXPECT_EQ(level_error(shape, 1, bump), std::numeric_limits<double>::infinity());
  // A vertex of the coarse level stands out: the vertices halfway to its neighbours miss half of it.
  auto peak = elevations_by([](ObjectVertex) { return 5.0; });
  peak[9 + 9 * 20] = 13.0;
  EXPECT_EQ(level_error(shape, 1, peak), 4.0);
}

}  // namespace
}  // namespace isohf
