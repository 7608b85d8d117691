#include "isohf/lattice/stitch.h"

#include <gtest/gtest.h>

#include <map>

#include "isohf/lattice.h"
#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"
#include "support/sanitizers.h"

namespace isohf {
namespace {

using namespace test;

std::string name_of(const TileShape& shape) {
  return std::to_string(shape.columns()) + "x" + std::to_string(shape.rows()) + ", " + std::to_string(shape.levels());
}

std::span<const std::uint32_t> list_of_level(const TileShape& shape, const std::vector<std::uint32_t>& list,
                                             int level) {
  return std::span(list).first(static_cast<std::size_t>(shape.stitch_index_count(level)));
}

EdgeChain strip_and_stitch(const TileShape& shape, const std::vector<std::uint32_t>& list, int level) {
  EdgeChain chain;
  for (const Triangle& t : triangles_of_strip(strip_indices(shape, level))) {
    if (!repeats_a_vertex(t)) chain.add(t);
  }
  for (const Triangle& t : triangles_of_list(list_of_level(shape, list, level))) chain.add(t);
  return chain;
}

TEST(Stitch, BorderOfStripAndStitchIsTheFullDetailBorder) {
  for (const TileShape& shape : deepest_shapes(40, 45)) {
    const std::vector<std::uint32_t> list = stitch_indices(shape);
    for (int level = 0; level < shape.levels(); ++level) {
      ASSERT_EQ(strip_and_stitch(shape, list, level).remaining(), full_detail_border(shape))
          << name_of(shape) << " level " << level;
    }
  }
}

TEST(Stitch, BorderOfStripAndStitchIsTheFullDetailBorderForTable1) {
  for (const Table1Row& row : table1()) {
    if (!row.valid) continue;
    const TileShape shape = TileShape::make(row.columns, row.rows, row.levels);
    const std::vector<std::uint32_t> list = stitch_indices(shape);
    constexpr std::int64_t kMostTriangles = kSanitized ? 50000 : 1000000;  // edges are sorted
    for (int level = 0; level < shape.levels(); ++level) {
      if (shape.strip_triangle_count(level) > kMostTriangles) continue;  // Strip covers the large ones
      ASSERT_EQ(strip_and_stitch(shape, list, level).remaining(), full_detail_border(shape))
          << name_of(shape) << " level " << level;
    }
  }
}

TEST(Stitch, TrianglesLieOnTheBorderAndHaveNoAreaSeenFromAbove) {
  for (const TileShape& shape : deepest_shapes(40, 45)) {
    const std::vector<std::uint32_t> list = stitch_indices(shape);
    for (const Triangle& t : triangles_of_list(list)) {
      ASSERT_FALSE(repeats_a_vertex(t)) << name_of(shape);
      ASSERT_EQ(doubled_area(shape, t), 0) << name_of(shape);
      for (const std::uint32_t index : t) {
        const ObjectVertex p = place_of(shape, index);
        ASSERT_TRUE(is_visible(shape, vertex_of(shape, index)));
        ASSERT_TRUE(p.x == 0 || p.x == 2 * shape.cell_columns() || p.z == 0 || p.z == shape.cell_rows());
      }
    }
  }
}

TEST(Stitch, EachLevelJoinsEveryRemovedBorderVertexOnce) {
  for (const TileShape& shape : deepest_shapes(24, 35)) {
    const std::vector<std::uint32_t> list = stitch_indices(shape);
    for (int level = 1; level < shape.levels(); ++level) {
      const std::span<const std::uint32_t> all = list_of_level(shape, list, level);
      const std::span<const std::uint32_t> added =
          all.subspan(static_cast<std::size_t>(shape.stitch_index_count(level - 1)));
      std::map<std::uint32_t, int> expected;  // +1 finer border, -1 coarser: 1 for a removed vertex, 0 for a kept one
      for (const auto& [from, to] : coarse_border(shape, level - 1)) ++expected[from];
      for (const auto& [from, to] : coarse_border(shape, level)) --expected[from];
      for (const Triangle& t : triangles_of_list(added)) {
        // The vertex between the two others is the removed one.
        const auto key = [&](std::uint32_t index) {
          const ObjectVertex p = place_of(shape, index);
          return std::pair{p.x + p.z, index};
        };
        std::array<std::pair<int, std::uint32_t>, 3> order = {key(t[0]), key(t[1]), key(t[2])};
        std::sort(order.begin(), order.end());
        --expected[order[1].second];
      }
      for (const auto& [index, count] : expected) ASSERT_EQ(count, 0) << name_of(shape) << " vertex " << index;
    }
  }
}

TEST(Stitch, CountsEqualEqs5And6AndListsAreNested) {
  for (const TileShape& shape : all_shapes(40, 45)) {
    const std::int64_t border = shape.rows() + shape.columns() - 7;
    EXPECT_EQ(shape.stitch_triangle_count(0), 0);
    for (int level = 1; level < shape.levels(); ++level) {
      const std::int64_t power = std::int64_t{1} << (level - 1);
      ASSERT_EQ(shape.stitch_triangle_count(level) * power, border * (2 * power - 1));  // Eq. 5 times 2^(level-1)
      ASSERT_EQ(shape.stitch_index_count(level), 3 * shape.stitch_triangle_count(level));
    }
    const std::vector<std::uint32_t> list = stitch_indices(shape);
    ASSERT_EQ(static_cast<std::int64_t>(list.size()), shape.stitch_index_count(shape.levels() - 1));
    if (shape.levels() > 1) {
      const TileShape fewer = TileShape::make(shape.columns(), shape.rows(), shape.levels() - 1);
      const std::vector<std::uint32_t> front = stitch_indices(fewer);
      ASSERT_TRUE(std::equal(front.begin(), front.end(), list.begin())) << name_of(shape);
    }
  }
}

// Two neighbours at any two levels, and the four around a corner: the chain of all their triangles, in the lattice that
// they share, is the border of the whole. A T-junction would leave edges inside.
TEST(Stitch, TilesOfAnyTwoLevelsMeetWithoutTJunctions) {
  const TileShape shape = TileShape::make(20, 35, 4);
  const TileGrid grid = TileGrid::make(shape, 2, 2, 1.0, 1.0);
  const std::vector<std::uint32_t> list = stitch_indices(shape);
  const auto lattice_index = [&](TileIndex tile, std::uint32_t index) {
    const LatticeVertex v = grid.lattice_vertex(tile, vertex_of(shape, index));
    return static_cast<std::uint32_t>(v.x + 4096 * v.z);
  };
  const auto in_lattice = [&](const int(&levels)[4]) {
    EdgeChain chain;
    for (std::int64_t i = 0; i < 4; ++i) {
      const TileIndex tile = grid.tile_at(i);
      for (const auto& [from, to] : strip_and_stitch(shape, list, levels[i]).remaining()) {
        chain.add(lattice_index(tile, from), lattice_index(tile, to));
      }
    }
    return chain.remaining();
  };
  const std::vector<Edge> full = in_lattice({0, 0, 0, 0});
  // Around the whole: two tiles' rows on each side, and n edges a tile on North and South.
  EXPECT_EQ(full.size(), 2U * 2U * static_cast<std::size_t>(shape.cell_columns() + shape.cell_rows()));
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      EXPECT_EQ(in_lattice({a, b, b, a}), full) << a << " beside " << b;
      EXPECT_EQ(in_lattice({a, a, b, 3 - a}), full) << a << " above " << b;
    }
  }
}

}  // namespace
}  // namespace isohf
