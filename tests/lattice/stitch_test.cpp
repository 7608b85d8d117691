#include "isohf/lattice/stitch.h"

#include <gtest/gtest.h>

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
  std::vector<TileShape> shapes = deepest_shapes(40, 45);
  for (const Table1Row& row : table1()) {
    if (row.valid) shapes.push_back(TileShape::make(row.columns, row.rows, row.levels));
  }
  constexpr std::int64_t kMostTriangles = kSanitized ? 50000 : 1000000;  // edges are sorted
  for (const TileShape& shape : shapes) {
    const std::vector<std::uint32_t> list = stitch_indices(shape);
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

}  // namespace
}  // namespace isohf
