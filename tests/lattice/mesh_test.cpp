#include "isohf/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "isohf/error.h"
#include "mesh_check.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "done";
}

TEST(TileMesh, TrianglesAreThoseOfStripAndStitchListWithoutRepeatedVertices) {
  for (const TileShape& shape : test::deepest_shapes(20, 23)) {
    const TileMesh mesh(shape);
    ASSERT_EQ(mesh.levels(), shape.levels());
    for (int level = 0; level < mesh.levels(); ++level) {
      const std::vector<test::Triangle> triangles = test::triangles_of_list(mesh.triangles(level));
      EXPECT_EQ(static_cast<std::int64_t>(triangles.size()),
                shape.strip_triangle_count(level) + shape.stitch_triangle_count(level));
      test::EdgeChain chain;
      std::int64_t doubled_area = 0;
      for (const test::Triangle& triangle : triangles) {
        EXPECT_FALSE(test::repeats_a_vertex(triangle));
        EXPECT_GE(test::doubled_area(shape, triangle), 0);
        doubled_area += test::doubled_area(shape, triangle);
        chain.add(triangle);
      }
      EXPECT_EQ(doubled_area, std::int64_t{4} * shape.cell_columns() * shape.cell_rows());
      EXPECT_EQ(chain.remaining(), test::full_detail_border(shape)) << shape.columns() << "x" << shape.rows();
    }
  }
}

TEST(TileMesh, KeepsAllArraysInOneBuffer) {
  const TileMesh mesh(TileShape::make(12, 11, 2), 4);
  EXPECT_EQ(mesh.levels(), 3);  // what overviews of every fourth vertex need
  EXPECT_EQ(mesh.shape(), TileShape::make(12, 11, 3));
  std::set<const std::uint32_t*> used;
  const auto use = [&](std::span<const std::uint32_t> part) {
    for (const std::uint32_t& index : part) used.insert(&index);
  };
  for (int level = 0; level < mesh.levels(); ++level) use(mesh.strip(level));
  EXPECT_TRUE(mesh.stitch(0).empty());
  EXPECT_EQ(mesh.stitch(1).data(), mesh.stitch(2).data());
  use(mesh.stitch(2));
  for (const TileSide side : {TileSide::kWest, TileSide::kEast, TileSide::kNorth, TileSide::kSouth}) {
    EXPECT_EQ(mesh.side_stitch(side).size(), 18U);
    use(mesh.side_stitch(side));
  }
  EXPECT_EQ(used.size(), mesh.indices().size());
  EXPECT_EQ(*used.begin(), mesh.indices().data());
  EXPECT_TRUE(TileMesh(mesh.shape()).side_stitch(TileSide::kWest).empty());
}

TEST(TileMesh, LeavesOutTheTrianglesAroundNodata) {
  const TileMesh mesh(TileShape::make(12, 11, 2));
  std::vector<double> elevations(12 * 11, 100.0);
  const std::vector<std::uint32_t> all = mesh.triangles(1, elevations);
  EXPECT_EQ(all, mesh.triangles(1));
  constexpr std::uint32_t kNodataVertex = 5 + 5 * 12;
  elevations[kNodataVertex] = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::uint32_t> expected;
  for (const test::Triangle& triangle : test::triangles_of_list(all)) {
    if (std::find(triangle.begin(), triangle.end(), kNodataVertex) != triangle.end()) continue;
    expected.insert(expected.end(), triangle.begin(), triangle.end());
  }
  EXPECT_EQ(mesh.triangles(1, elevations), expected);
  EXPECT_EQ(all.size() - expected.size(), 6U * 3U);
}

TEST(TileMesh, RefusesLevelsStridesAndElevationsThatDoNotFit) {
  const TileShape shape = TileShape::make(12, 11, 2);
  for (const int stride : {1, 3, 8, -4}) {
    EXPECT_THAT(refusal([&] { TileMesh(shape, stride); }), HasSubstr("overview stride")) << stride;
  }
  const TileMesh mesh(shape);
  for (const int level : {-1, 2}) {
    EXPECT_THAT(refusal([&] { (void)mesh.strip(level); }), HasSubstr("not a level"));
    EXPECT_THAT(refusal([&] { (void)mesh.stitch(level); }), HasSubstr("not a level"));
    EXPECT_THAT(refusal([&] { (void)mesh.triangles(level); }), HasSubstr("not a level"));
  }
  EXPECT_THAT(refusal([&] { (void)mesh.triangles(0, std::vector<double>(131)); }), HasSubstr("131 elevations"));
}

TEST(TileMesh, ObjectPositionsAreThoseOfEquation1) {
  const TileShape shape = TileShape::make(12, 11, 2);
  const auto positions = object_positions(shape);
  ASSERT_EQ(positions.size(), 132U);
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    EXPECT_EQ(ObjectVertex(positions[i][0], positions[i][1]), test::place_of(shape, i));
  }
}

/// A list of indices as docs/archive_format.md prints it.
std::string printed(std::span<const std::uint32_t> indices) {
  std::string text;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    text += (i % 16 == 0 ? "\n    " : " ") + std::to_string(indices[i]);
  }
  return text + "\n";
}

TEST(TileMesh, PrintsTheExampleOfTheFormatPage) {
  std::ifstream file(ISOHF_SOURCE_DIR "/docs/archive_format.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  const TileMesh mesh(TileShape::make(12, 11, 3));
  const std::size_t first = mesh.stitch(1).size();
  EXPECT_THAT(page, HasSubstr("The strip of level 2:\n" + printed(mesh.strip(2))));
  EXPECT_THAT(page, HasSubstr("The strip of level 1:\n" + printed(mesh.strip(1))));
  EXPECT_THAT(page, HasSubstr("Stitch list 1:\n" + printed(mesh.stitch(1))));
  EXPECT_THAT(page, HasSubstr("Stitch list 2:\n" + printed(mesh.stitch(2).subspan(first))));
}

}  // namespace
}  // namespace isohf
