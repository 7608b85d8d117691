#include "isohf/lattice.h"

#include <gtest/gtest.h>

#include <set>

#include "lattice/mesh_check.h"

namespace isohf {
namespace {

using test::deepest_shapes;

TEST(TileMapping, Eq1PlacesEveryVisibleVertexOnItsRow) {
  for (const TileShape& shape : deepest_shapes(24, 19)) {
    const int width = 2 * shape.cell_columns();
    for (int r = 1; r <= shape.rows() - 2; ++r) {
      std::vector<int> places;
      for (int c = 0; c < shape.columns(); ++c) {
        const ObjectVertex p = object_from_grid(shape, GridVertex{c, r});
        ASSERT_EQ(p.z, r - 1);
        if (is_visible(shape, {c, r})) places.push_back(p.x);
      }
      std::vector<int> expected;
      if (r % 2 == 1) {
        for (int x = 0; x <= width; x += 2) expected.push_back(x);
      } else {
        expected.push_back(0);
        for (int x = 1; x < width; x += 2) expected.push_back(x);
        expected.push_back(width);
      }
      ASSERT_EQ(places, expected) << shape.columns() << "x" << shape.rows() << " row " << r;
    }
  }
}

TEST(TileMapping, SlidVerticesAreTheOnesOffTheInfiniteLattice) {
  for (const TileShape& shape : deepest_shapes(24, 19)) {
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        const ObjectVertex p = object_from_grid(shape, GridVertex{c, r});
        ASSERT_EQ(is_slid(shape, {c, r}), (p.x + p.z) % 2 != 0) << c << "," << r;
      }
    }
  }
}

/// All triangles' vertices around a tile, in a 3x3 neighbourhood: which places are vertices of the mesh.
std::set<std::pair<std::int64_t, std::int64_t>> mesh_vertices(const TileGrid& grid) {
  std::set<std::pair<std::int64_t, std::int64_t>> places;
  for (std::int64_t row = -1; row <= 1; ++row) {
    for (std::int64_t column = -1; column <= 1; ++column) {
      for (int r = 0; r < grid.shape().rows(); ++r) {
        for (int c = 0; c < grid.shape().columns(); ++c) {
          if (!is_visible(grid.shape(), {c, r})) continue;
          const LatticeVertex v = grid.lattice_vertex({column, row}, {c, r});
          places.insert({v.x, v.z});
        }
      }
    }
  }
  return places;
}

TEST(Errata, E05PaddingLiesOnTheNeighboursVertices) {
  for (const TileShape& shape : deepest_shapes(16, 19)) {
    const TileGrid grid = TileGrid::make(shape, 1, 1, 1.0, 1.0);
    const auto mesh = mesh_vertices(grid);
    std::set<std::pair<std::int64_t, std::int64_t>> stored;
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        if (r % 2 == 1 && c == shape.columns() - 1) continue;  // the one unused place of an odd row
        const LatticeVertex v = grid.lattice_vertex({0, 0}, {c, r});
        EXPECT_TRUE(mesh.count({v.x, v.z}) == 1) << c << "," << r << " lies on no vertex";
        EXPECT_TRUE(stored.insert({v.x, v.z}).second) << c << "," << r << " is stored twice";
      }
    }
    // The whole ring is there: every mesh vertex at most one row outside, and as near beside the edge as its row has.
    const int width = 2 * shape.cell_columns();
    for (const auto& [x, z] : mesh) {
      const std::int64_t reach = z % 2 == 0 ? 2 : 1;
      if (z < -1 || z > shape.cell_rows() + 1 || x < -reach || x > width + reach) continue;
      EXPECT_EQ(stored.count({x, z}), 1U) << x << "," << z << " is in no array";
    }
    // Printed with b = 0: x = -3 and width+3, while the edge's neighbours lie at -1 and width+1.
    EXPECT_EQ(object_from_grid(shape, GridVertex{0, 2}).x, -1);
    EXPECT_EQ(object_from_grid(shape, GridVertex{shape.columns() - 1, 2}).x, width + 1);
  }
}

}  // namespace
}  // namespace isohf
