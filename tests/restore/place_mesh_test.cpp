#include "isohf/restore/place_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "isohf/error.h"
#include "isohf/restore/lossless.h"
#include "isohf/restore/scattered_surface.h"

namespace isohf {
namespace {

WorldPoint cubic(double column, double row) {
  return {2.0 * column + 1e-3 * column * column - 1e-6 * row * row * row, 3.0 * row - 1e-4 * column * row};
}

TEST(PlaceMesh, HoldsCubicsForRastersOfAnySize) {
  for (const std::int64_t columns : {1, 2, 3, 4, 31, 32, 33, 97, 500}) {
    for (const std::int64_t rows : {1, 2, 5, 64, 130}) {
      const PlaceMesh mesh(columns, rows, cubic);
      EXPECT_EQ(mesh.values().size(), PlaceMesh::value_count(columns, rows));
      std::vector<WorldPoint> line(static_cast<std::size_t>(columns));
      for (std::int64_t row = 0; row < rows; ++row) {
        mesh.row(row, line);
        for (std::int64_t column = 0; column < columns; ++column) {
          const WorldPoint exact = cubic(static_cast<double>(column), static_cast<double>(row));
          const WorldPoint& found = line[static_cast<std::size_t>(column)];
          // A few dozen roundings of numbers up to 1500.
          ASSERT_NEAR(found.x, exact.x, 1e-10) << columns << "x" << rows << ": " << column << "," << row;
          ASSERT_NEAR(found.z, exact.z, 1e-10);
        }
      }
    }
  }
}

TEST(PlaceMesh, IsTheSameFromItsBytesAndSmallForLargeRasters) {
  const PlaceMesh mesh(100, 70, cubic);
  const std::vector<std::byte> bytes = bytes_of(mesh);
  const PlaceMesh again = places_from_bytes(100, 70, bytes);
  EXPECT_TRUE(std::equal(mesh.values().begin(), mesh.values().end(), again.values().begin(), again.values().end()));
  for (const std::size_t wrong : {std::size_t{0}, bytes.size() - 1, bytes.size() - 8}) {
    EXPECT_THROW((void)places_from_bytes(100, 70, std::span(bytes).first(wrong)), Error);
  }
  EXPECT_EQ(PlaceMesh::step(10000, 10000), 32);
  for (const std::int64_t side : {100000, 1000000, 1000000000}) {
    EXPECT_LE(PlaceMesh::value_count(side, side), std::size_t{3} << 20U);
  }
}

TEST(ScatteredSurface, IsTheTrianglesAtAnyPlaceInAnyOrder) {
  const TileGrid grid = TileGrid::make(TileShape::make(20, 19, 4), 3, 2, 16.0, 16.0 * std::sqrt(0.75));
  const auto plane = [](double x, double z) { return 3.0 * x - 2.0 * z + 100.0; };
  ScatteredSurface surface(grid, {CodeType::kF32, 0.0, 1.0}, [&](TileIndex tile) {
    TileCodes codes;
    codes.type = CodeType::kF32;
    for (int r = 0; r < grid.shape().rows(); ++r) {
      for (int c = 0; c < grid.shape().columns(); ++c) {
        const WorldPoint at = grid.world_from_lattice(grid.lattice_vertex(tile, {c, r}));
        codes.heights.push_back(static_cast<float>(plane(at.x, at.z)));
      }
    }
    return codes;
  });
  std::vector<WorldPoint> places;
  for (int i = 0; i < 500; ++i) places.push_back({std::fmod(i * 17.31, 47.9), std::fmod(i * 5.77, 27.6)});
  places.push_back({-0.1, 3.0});
  places.push_back({std::numeric_limits<double>::quiet_NaN(), 3.0});
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<double> found(places.size());
    surface.read(places, found);
    for (std::size_t i = 0; i < 500; ++i) EXPECT_NEAR(found[i], plane(places[i].x, places[i].z), 1e-4) << i;
    EXPECT_TRUE(std::isnan(found[500]) && std::isnan(found[501]));
  }
}

}  // namespace
}  // namespace isohf
