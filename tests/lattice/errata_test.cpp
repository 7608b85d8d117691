#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "isohf/error.h"
#include "isohf/lattice.h"
#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"
#include "support/error_of.h"

/// Errata of the paper that concern the tile's shape; the others stand beside what they concern (docs/paper.md).

namespace isohf {
namespace {

constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

TEST(Errata, E01Table1sShape48x55With3LevelsIsInvalid) {
  EXPECT_EQ(TileShape::why_invalid(48, 55, 3), "(rows-3)/2 is 26, must be a multiple of 4 for 3 levels");
  EXPECT_EQ(TileShape::why_invalid(48, 55, 2), "");
  EXPECT_EQ(TileShape::why_invalid(52, 59, 3), "");
  EXPECT_THAT(test::error_of([] { (void)TileShape::make(48, 55, 3); }).what(),
              testing::HasSubstr("the nearest valid shape is 48x59 with 3 levels"));
  int invalid = 0;
  for (const Table1Row& row : table1()) {
    EXPECT_EQ(TileShape::why_invalid(row.columns, row.rows, row.levels).empty(), row.valid);
    invalid += row.valid ? 0 : 1;
  }
  EXPECT_EQ(invalid, 1);
}

// What goes wrong with (48, 55): a pair of coarse rows of the third level takes 8 rows, and 52 is no multiple of 8.
TEST(Errata, E01TheThirdLevelsPairsOfRowsDontFill52Rows) {
  const int pair_of_rows = 2 * (1 << 2);
  EXPECT_NE((55 - 3) % pair_of_rows, 0);
  const TileShape valid = TileShape::make(52, 59, 3);
  std::int64_t doubled = 0;
  for (const test::Triangle& t : test::triangles_of_strip(strip_indices(valid, 2))) {
    doubled += test::doubled_area(valid, t);
  }
  EXPECT_EQ(doubled, 2 * 2 * valid.cell_columns() * valid.cell_rows());
}

TEST(Errata, E02RowsStepByTwiceTheCoarsestStride) {
  for (int levels = 1; levels <= 8; ++levels) {
    const int columns = 4 + (1 << (levels - 1));
    for (int i = 1; i <= 20; ++i) {
      EXPECT_EQ(TileShape::why_invalid(columns, (i << levels) + 3, levels), "");
      const int printed = (i << (levels - 1)) + 3;
      EXPECT_EQ(TileShape::why_invalid(columns, printed, levels).empty(), i % 2 == 0) << printed;
    }
  }
  for (const TileShape& shape : find_shapes(3, {ShapeBudget::Kind::kTriangles, 5000}, 0.2, -1)) {
    EXPECT_EQ((shape.rows() - 3) % 8, 0);
  }
}

TEST(Errata, E03AspectIsThatOfTheDrawnTriangles) {
  for (const Table1Row& row : table1()) {
    if (!row.valid) continue;
    const TileShape shape = TileShape::make(row.columns, row.rows, row.levels);
    // The sides of a triangle of a square tile: a base of two σx and a height of σz.
    const TileGrid grid = TileGrid::make(shape, 1, 1, 1000.0, 1000.0);
    const double base = 2.0 * grid.sigma_x();
    EXPECT_NEAR(shape.aspect(), base * kSin60 / grid.sigma_z(), 1e-12);
  }
  EXPECT_NEAR(TileShape::make(5, 5, 1).aspect(), 1.732, 0.0005);
  EXPECT_NEAR(TileShape::make(5, 5, 1).printed_aspect(), 0.866, 0.0005);
  EXPECT_NEAR(TileShape::make(52, 67, 4).aspect(), 1.155, 0.0005);
  EXPECT_NEAR(TileShape::make(212, 243, 4).aspect(), 0.9993, 0.00005);
}

TEST(Errata, E04ColumnsAreBoundedBySixteenBits) {
  const auto fits = [](int x) {
    return x >= std::numeric_limits<std::int16_t>::min() && x <= std::numeric_limits<std::int16_t>::max();
  };
  EXPECT_EQ(kMaxTileColumns, 1 << 14);
  const TileShape widest = TileShape::make(kMaxTileColumns, kMaxTileRows, 1);
  for (const int c : {0, 1, widest.columns() - 2, widest.columns() - 1}) {
    for (const int r : {0, 1, 2, widest.rows() - 2, widest.rows() - 1}) {
      EXPECT_TRUE(fits(object_from_grid(widest, GridVertex{c, r}).x));
      EXPECT_TRUE(fits(object_from_grid(widest, GridVertex{c, r}).z));
    }
  }
  const int printed_bound = static_cast<int>(16384.0 * std::numbers::sqrt3);
  EXPECT_FALSE(fits(object_x(printed_bound, printed_bound - 1, 1)));
  EXPECT_NE(TileShape::why_invalid(printed_bound, 5, 1), "");
}

// The slid vertices' half of this erratum is pure geometry; that they are sampled where they lie is the tile cutter's.
TEST(Errata, E06SlidVerticesLieOffTheInfiniteLatticeAtOnePlaceForBothTiles) {
  const TileShape shape = TileShape::make(12, 11, 3);
  const TileGrid grid = TileGrid::make(shape, 2, 1, 1.0, 1.0);
  for (int r = 0; r < shape.rows(); r += 2) {
    const LatticeVertex from_west = grid.lattice_vertex({0, 0}, {shape.columns() - 2, r});
    const LatticeVertex from_east = grid.lattice_vertex({1, 0}, {1, r});
    EXPECT_EQ(from_west, from_east);
    EXPECT_NE((from_west.x + from_west.z) % 2, 0);  // ordinary vertices have an even sum
  }
}

}  // namespace
}  // namespace isohf
