#include "isohf/lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "isohf/error.h"
#include "lattice/mesh_check.h"
#include "support/error_of.h"

namespace isohf {
namespace {

using testing::HasSubstr;

constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

TEST(TileShape, IsValidExactlyWhereEveryConstraintHolds) {
  for (int columns = -2; columns <= 70; ++columns) {
    for (int rows = -2; rows <= 70; ++rows) {
      for (int levels = -1; levels <= 7; ++levels) {
        bool valid = columns >= 5 && rows >= 5 && levels >= 1 && rows % 2 == 1;
        for (int k = 1; valid && k < levels; ++k) {
          valid = (columns - 4) % (1 << k) == 0 && (rows - 3) / 2 % (1 << k) == 0;
        }
        const std::string why = TileShape::why_invalid(columns, rows, levels);
        ASSERT_EQ(why.empty(), valid) << columns << "x" << rows << ", " << levels << ": " << why;
      }
    }
  }
}

TEST(TileShape, ErrorsNameTheBrokenConstraintAndTheNearestShape) {
  const struct {
    int columns, rows, levels;
    const char* constraint;
    const char* remedy;
  } cases[] = {
      {4, 5, 1, "columns is 4, must be at least 5", "5x5 with 1 levels"},
      {5, 3, 1, "rows is 3, must be at least 5", "5x5 with 1 levels"},
      {5, 6, 1, "rows is 6, must be odd", "5x7 with 1 levels"},
      {211, 243, 4, "columns-4 is 207, must be a multiple of 8 for 4 levels", "212x243 with 4 levels"},
      {212, 241, 4, "(rows-3)/2 is 119, must be a multiple of 8 for 4 levels", "212x243 with 4 levels"},
      {16385, 5, 1, "columns is 16385, must be at most 16384", "16384x5 with 1 levels"},
      {5, 32769, 1, "rows is 32769, must be at most 32767", "5x32767 with 1 levels"},
      {5, 5, 0, "levels is 0, must lie in 1..14", "5x5 with 1 levels"},
      {5, 5, 15, "levels is 15, must lie in 1..14", "8196x16387 with 14 levels"},
  };
  for (const auto& c : cases) {
    const Error error = test::error_of([&] { (void)TileShape::make(c.columns, c.rows, c.levels); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << c.columns << "x" << c.rows;
    EXPECT_THAT(error.what(), HasSubstr(c.constraint));
    EXPECT_THAT(error.what(), HasSubstr(c.remedy));
  }
}

TEST(TileShape, NearestIsValidAndNoOtherIsNearer) {
  for (int levels = 1; levels <= 5; ++levels) {
    const int stride = 1 << (levels - 1);
    for (int asked = -3; asked <= 90; ++asked) {
      const TileShape shape = TileShape::nearest(asked, asked, levels);
      ASSERT_EQ(TileShape::why_invalid(shape.columns(), shape.rows(), levels), "");
      ASSERT_EQ(shape.levels(), levels);
      const int off_columns = std::abs(shape.columns() - asked);
      const int off_rows = std::abs(shape.rows() - asked);
      for (int k = 1; k <= 90; ++k) {
        ASSERT_LE(off_columns, std::abs(4 + k * stride - asked)) << asked;
        ASSERT_LE(off_rows, std::abs(3 + 2 * k * stride - asked)) << asked;
      }
    }
  }
  constexpr int kLeast = std::numeric_limits<int>::min();
  constexpr int kMost = std::numeric_limits<int>::max();
  EXPECT_EQ(TileShape::nearest(kLeast, kLeast, kLeast), TileShape::make(5, 5, 1));
  EXPECT_EQ(TileShape::nearest(kMost, kMost, 1), TileShape::make(kMaxTileColumns, kMaxTileRows, 1));
  EXPECT_EQ(TileShape::nearest(kMost, kMost, kMost), TileShape::make(8196, 16387, kMaxTileLevels));
}

TEST(TileShape, CountsAreWhatIsVisible) {
  for (const TileShape& shape : test::deepest_shapes(24, 35)) {
    std::int64_t visible = 0;
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) visible += is_visible(shape, {c, r}) ? 1 : 0;
    }
    ASSERT_EQ(shape.visible_vertex_count(), visible);
    ASSERT_EQ(shape.stored_vertex_count(), std::int64_t{shape.columns()} * shape.rows());
    ASSERT_EQ(shape.triangle_count(), std::int64_t{2 * shape.columns() - 7} * (shape.rows() - 3));
    // Euler: vertices - edges + triangles = 1, with 3 edges a triangle of which the border's count once.
    const std::int64_t border = 2 * (shape.cell_columns() + shape.cell_rows());
    ASSERT_EQ(2 * visible, shape.triangle_count() + border + 2);
  }
}

TEST(Table1, AspectsAreReproducedByThePrintedMetricToThreeDecimals) {
  for (const Table1Row& row : table1()) {
    const double printed = row.rows * kSin60 / row.columns;
    EXPECT_EQ(std::round(printed * 1000.0), std::round(row.printed_aspect * 1000.0)) << row.columns << "x" << row.rows;
    if (row.valid) {
      EXPECT_DOUBLE_EQ(TileShape::make(row.columns, row.rows, row.levels).printed_aspect(), printed);
    }
  }
}

TEST(Table1, TriangleCountsAreThePrintedOnes) {
  // As printed: 6, 1k, 5k, 136, 1k, 5k, 6k, 10k, 50k, 100k, 15M, to the digits that the table gives.
  const std::vector<std::int64_t> counts = {6, 1066, 4914, 136, 984, 4628, 6208, 10320, 53680, 100080, 15731712};
  ASSERT_EQ(table1().size(), counts.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Table1Row& row = table1()[i];
    EXPECT_EQ(std::int64_t{2 * row.columns - 7} * (row.rows - 3), counts[i]);
    if (row.valid) {
      EXPECT_EQ(TileShape::make(row.columns, row.rows, row.levels).triangle_count(), counts[i]);
    }
  }
}

TEST(Table1, TheBestRowByTrueAspectIs212x243) {
  const Table1Row* best = nullptr;
  double least = 1e9;
  for (const Table1Row& row : table1()) {
    if (!row.valid) continue;
    const double off = std::abs(TileShape::make(row.columns, row.rows, row.levels).aspect() - 1.0);
    if (off < least) {
      least = off;
      best = &row;
    }
  }
  ASSERT_NE(best, nullptr);
  EXPECT_EQ(best->columns, 212);
  EXPECT_EQ(best->rows, 243);
  EXPECT_NEAR(least, 0.0007, 0.00005);
}

/// All of find_shapes by trying every shape.
std::vector<TileShape> all_found(int levels, const ShapeBudget& budget, double tolerance, int most_columns,
                                 int most_rows) {
  const auto count = [&](const TileShape& shape) {
    return budget.kind == ShapeBudget::Kind::kTriangles ? shape.triangle_count() : shape.stored_vertex_count();
  };
  const auto off = [](const TileShape& shape) { return std::abs(shape.aspect() - 1.0); };
  const auto wanted = static_cast<double>(budget.count);
  std::vector<TileShape> found;
  for (int columns = 5; columns <= most_columns; ++columns) {
    std::vector<TileShape> of_columns;
    if ((columns - 4) % (1 << (levels - 1)) != 0) continue;
    for (int rows = 5; rows <= most_rows; rows += 2) {
      if ((rows - 3) / 2 % (1 << (levels - 1)) != 0) continue;
      const TileShape shape = TileShape::make(columns, rows, levels);
      const auto held = static_cast<double>(count(shape));
      if (held > wanted * (1.0 + tolerance)) break;
      if (held >= wanted * (1.0 - tolerance) && held <= wanted * (1.0 + tolerance)) of_columns.push_back(shape);
    }
    std::stable_sort(of_columns.begin(), of_columns.end(),
                     [&](const TileShape& a, const TileShape& b) { return off(a) < off(b); });
    for (std::size_t i = 0; i < std::min<std::size_t>(2, of_columns.size()); ++i) found.push_back(of_columns[i]);
  }
  std::sort(found.begin(), found.end(), [&](const TileShape& a, const TileShape& b) {
    const auto key = [&](const TileShape& shape) {
      return std::tuple(off(shape), std::abs(static_cast<double>(count(shape) - budget.count)), shape.columns());
    };
    return key(a) < key(b);
  });
  return found;
}

TEST(FindShapes, EqualsTryingEveryShape) {
  for (int levels = 1; levels <= 5; ++levels) {
    for (const auto kind : {ShapeBudget::Kind::kTriangles, ShapeBudget::Kind::kVertices}) {
      for (const std::int64_t count : {1, 6, 25, 100, 136, 1000, 6208}) {
        for (const double tolerance : {0.0, 0.02, 0.3}) {
          const ShapeBudget budget{kind, count};
          // A column more costs at least 5 vertices or 4 triangles, a row more as many.
          const int most = static_cast<int>(static_cast<double>(count) * (1.0 + tolerance) / 2.0) + 8;
          const std::vector<TileShape> expected = all_found(levels, budget, tolerance, most, most);
          ASSERT_EQ(find_shapes(levels, budget, tolerance, -1), expected) << levels << " levels, " << count;
          const std::vector<TileShape> few = find_shapes(levels, budget, tolerance, 3);
          ASSERT_EQ(few.size(), std::min<std::size_t>(3, expected.size()));
          ASSERT_TRUE(std::equal(few.begin(), few.end(), expected.begin()));
        }
      }
    }
  }
}

TEST(FindShapes, FindsTable1sLargeShapesAndTheLargestOfAll) {
  const std::vector<TileShape> near_100k = find_shapes(4, {ShapeBudget::Kind::kTriangles, 100080}, 0.01, 1);
  ASSERT_EQ(near_100k.size(), 1U);
  EXPECT_EQ(near_100k[0], TileShape::make(212, 243, 4));
  const std::vector<TileShape> deepest = find_shapes(14, {ShapeBudget::Kind::kVertices, 8196LL * 16387}, 0.0, -1);
  ASSERT_EQ(deepest.size(), 1U);
  EXPECT_EQ(deepest[0], TileShape::make(8196, 16387, 14));
  EXPECT_TRUE(
      find_shapes(1, {ShapeBudget::Kind::kVertices, std::numeric_limits<std::int64_t>::max()}, 0.5, -1).empty());
}

TEST(FindShapes, RefusesWhatIsOutOfRange) {
  EXPECT_THROW((void)find_shapes(0, {}, 0.1, 5), Error);
  EXPECT_THROW((void)find_shapes(15, {}, 0.1, 5), Error);
  EXPECT_THROW((void)find_shapes(1, {ShapeBudget::Kind::kTriangles, 0}, 0.1, 5), Error);
  EXPECT_THROW((void)find_shapes(1, {}, -0.1, 5), Error);
  EXPECT_THROW((void)find_shapes(1, {}, std::numeric_limits<double>::quiet_NaN(), 5), Error);
}

}  // namespace
}  // namespace isohf
