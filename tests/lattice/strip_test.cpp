#include "isohf/lattice/strip.h"

#include <gtest/gtest.h>

#include "lattice/mesh_check.h"
#include "support/sanitizers.h"

namespace isohf {
namespace {

using namespace test;

std::string name_of(const TileShape& shape, int level) {
  return std::to_string(shape.columns()) + "x" + std::to_string(shape.rows()) + " level " + std::to_string(level);
}

/// Calls check(shape, level, triangles) for each level of every shape up to 40 x 45.
template <typename Check>
void for_every_strip(Check&& check) {
  for (const TileShape& shape : deepest_shapes(40, 45)) {
    for (int level = 0; level < shape.levels(); ++level) {
      SCOPED_TRACE(name_of(shape, level));
      check(shape, level, triangles_of_strip(strip_indices(shape, level)));
      if (testing::Test::HasFailure()) return;
    }
  }
}

// Triangles that all wind one way, and whose edges cancel but for the square's border, have winding number 1 at every
// point of the square and 0 outside: each point is covered exactly once.
TEST(Strip, CoversTheSquareExactlyOnceForEveryShapeUpTo40x45) {
  for_every_strip([](const TileShape& shape, int level, const std::vector<Triangle>& triangles) {
    EdgeChain chain;
    std::int64_t doubled = 0;
    for (const Triangle& t : triangles) {
      if (repeats_a_vertex(t)) continue;
      const std::int64_t area = doubled_area(shape, t);
      ASSERT_GT(area, 0) << "winds clockwise or has no area";
      doubled += area;
      chain.add(t);
    }
    ASSERT_EQ(doubled, std::int64_t{2} * 2 * shape.cell_columns() * shape.cell_rows());
    ASSERT_EQ(chain.remaining(), coarse_border(shape, level));
  });
}

TEST(Strip, DegenerateTrianglesRepeatAVertexAndOnlyAtTurns) {
  for_every_strip([](const TileShape& shape, int level, const std::vector<Triangle>& triangles) {
    std::int64_t without_area = 0;
    for (const Triangle& t : triangles) {
      ASSERT_EQ(doubled_area(shape, t) == 0, repeats_a_vertex(t));
      if (repeats_a_vertex(t)) ++without_area;
    }
    // For each pair of rows three at the West end, and five on the way to the next pair.
    const std::int64_t pairs = shape.cell_rows() / (2 << level);
    ASSERT_EQ(without_area, 3 * pairs + 5 * (pairs - 1));
    ASSERT_EQ(without_area, shape.strip_index_count(level) - 2 - shape.strip_triangle_count(level));
  });
}

TEST(Strip, CountsEqualEqs3And4) {
  for_every_strip([](const TileShape& shape, int level, const std::vector<Triangle>& triangles) {
    const std::int64_t c = shape.columns();
    const std::int64_t r = shape.rows();
    const std::int64_t s = std::int64_t{1} << level;
    // Eq. 3 and Eq. 4, multiplied out so that nothing is rounded.
    ASSERT_EQ(2 * s * s * (static_cast<std::int64_t>(triangles.size()) + 2 + 3), (r - 3) * (4 * (c - 4) + 10 * s));
    const auto seen =
        std::count_if(triangles.begin(), triangles.end(), [](const Triangle& t) { return !repeats_a_vertex(t); });
    ASSERT_EQ(s * s * seen, (2 * (c - 4) + s) * (r - 3));
    ASSERT_EQ(static_cast<std::int64_t>(triangles.size()) + 2, shape.strip_index_count(level));
    ASSERT_EQ(seen, shape.strip_triangle_count(level));
  });
}

TEST(Strip, NamesOnlyVisibleVerticesAtLevel0AllOfThemAboveItNoSlidOne) {
  for (const TileShape& shape : deepest_shapes(40, 45)) {
    for (int level = 0; level < shape.levels(); ++level) {
      std::vector<std::uint32_t> strip = strip_indices(shape, level);
      for (const std::uint32_t index : strip) {
        ASSERT_TRUE(is_visible(shape, vertex_of(shape, index)));
        ASSERT_TRUE(level == 0 || vertex_of(shape, index).row % 2 == 1);
      }
      std::sort(strip.begin(), strip.end());
      strip.erase(std::unique(strip.begin(), strip.end()), strip.end());
      if (level == 0) {
        ASSERT_EQ(static_cast<std::int64_t>(strip.size()), shape.visible_vertex_count());
      }
    }
  }
}

// The paper says that the strip starts at (C-2, 1). That vertex is never drawn; the listing starts one row below it.
TEST(Strip, StartsAtTheEastEndOfTheSecondVisibleRow) {
  for (const TileShape& shape : deepest_shapes(20, 21)) {
    EXPECT_EQ(vertex_of(shape, strip_indices(shape, 0).front()), (GridVertex{shape.columns() - 2, 2}));
    EXPECT_FALSE(is_visible(shape, {shape.columns() - 2, 1}));
  }
}

TEST(Strip, TheSmallestTileIsDrawnAsInFigure4) {
  const TileShape shape = TileShape::make(5, 5, 1);
  const std::uint32_t row1 = 5, row2 = 10, row3 = 15;
  const std::vector<std::uint32_t> expected = {row2 + 3, row1 + 2, row2 + 2, row1 + 1, row2 + 1,  // red
                                               row2 + 1, row2 + 1, row3 + 1, row2 + 2, row3 + 2, row2 + 3};
  EXPECT_EQ(strip_indices(shape, 0), expected);
}

/// Signed random numbers in place of sorted edges: a chain that is not the border's passes with a chance of 2^-64.
std::uint64_t edge_hash(std::uint32_t a, std::uint32_t b) {
  if (a == b) return 0;
  std::uint64_t h = (std::uint64_t{std::min(a, b)} << 32 | std::max(a, b)) + 0x9e3779b97f4a7c15U;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9U;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebU;
  h ^= h >> 31;
  return a < b ? h : 0 - h;
}

TEST(Strip, CoversTheSquareExactlyOnceForEveryShapeOfTable1) {
  int shapes = 0;
  for (const Table1Row& row : table1()) {
    if (!row.valid || (kSanitized && shapes++ % 4 != 0)) continue;
    const TileShape shape = TileShape::make(row.columns, row.rows, row.levels);
    for (int level = 0; level < shape.levels(); ++level) {
      SCOPED_TRACE(name_of(shape, level));
      const std::vector<std::uint32_t> strip = strip_indices(shape, level);
      ASSERT_EQ(static_cast<std::int64_t>(strip.size()), shape.strip_index_count(level));
      std::vector<std::array<int, 2>> place(static_cast<std::size_t>(shape.stored_vertex_count()));
      for (std::size_t i = 0; i < place.size(); ++i) {
        const ObjectVertex object = place_of(shape, static_cast<std::uint32_t>(i));
        place[i] = {object.x, object.z};
      }
      std::uint64_t chain = 0;
      std::int64_t doubled = 0;
      std::int64_t seen = 0;
      for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
        const Triangle t{strip[i + i % 2], strip[i + 1 - i % 2], strip[i + 2]};
        if (repeats_a_vertex(t)) continue;
        const auto [ax, az] = place[t[0]];
        const auto [bx, bz] = place[t[1]];
        const auto [cx, cz] = place[t[2]];
        const std::int64_t area = std::int64_t{bz - az} * (cx - ax) - std::int64_t{bx - ax} * (cz - az);
        ASSERT_GT(area, 0);
        doubled += area;
        ++seen;
        chain += edge_hash(t[0], t[1]) + edge_hash(t[1], t[2]) + edge_hash(t[2], t[0]);
      }
      for (const auto& [from, to] : coarse_border(shape, level)) chain -= edge_hash(from, to);
      EXPECT_EQ(chain, 0U);
      EXPECT_EQ(doubled, std::int64_t{2} * 2 * shape.cell_columns() * shape.cell_rows());
      EXPECT_EQ(seen, shape.strip_triangle_count(level));
    }
  }
}

}  // namespace
}  // namespace isohf
