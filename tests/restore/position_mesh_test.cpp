#include "isohf/restore/position_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "isohf/error.h"
#include "isohf/restore/lossless.h"

namespace isohf {
namespace {

WorldPoint cubic(double column, double row) {
  return {2.0 * column + 1e-3 * column * column - 1e-6 * row * row * row, 3.0 * row - 1e-4 * column * row};
}

TEST(PositionMesh, HoldsCubicsForRastersOfAnySize) {
  for (const std::int64_t columns : {1, 2, 3, 4, 31, 32, 33, 97, 500}) {
    for (const std::int64_t rows : {1, 2, 5, 64, 130}) {
      const PositionMesh mesh(columns, rows, cubic);
      EXPECT_EQ(mesh.values().size(), PositionMesh::value_count(columns, rows));
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

TEST(PositionMesh, IsTheSameFromItsBytesAndSmallForLargeRasters) {
  const PositionMesh mesh(100, 70, cubic);
  const std::vector<std::byte> bytes = bytes_of(mesh);
  const PositionMesh again = positions_from_bytes(100, 70, bytes);
  EXPECT_TRUE(std::equal(mesh.values().begin(), mesh.values().end(), again.values().begin(), again.values().end()));
  for (const std::size_t wrong : {std::size_t{0}, bytes.size() - 1, bytes.size() - 8}) {
    EXPECT_THROW((void)positions_from_bytes(100, 70, std::span(bytes).first(wrong)), Error);
  }
  EXPECT_EQ(PositionMesh::step(10000, 10000), 32);
  for (const std::int64_t side : {100000, 1000000, 1000000000}) {
    EXPECT_LE(PositionMesh::value_count(side, side), std::size_t{3} << 20U);
  }
}

}  // namespace
}  // namespace isohf
