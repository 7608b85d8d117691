#include "isohf/lattice/barycentric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"

namespace isohf {
namespace {

using test::deepest_shapes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Points of a grid with steps of 1/8 in x and z: vertices, sides, half triangles; all arithmetic on them is exact.
template <typename Visit>
void for_fine_points(const TileShape& shape, Visit&& visit) {
  for (int z = 0; z <= 8 * shape.cell_rows(); ++z) {
    for (int x = 0; x <= 16 * shape.cell_columns(); ++x) visit(ObjectPoint{x / 8.0, z / 8.0});
  }
}

double weighted(const TileShape& shape, const Barycentric& at, double ObjectPoint::*coordinate) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const ObjectVertex v = object_from_grid(shape, at.vertices[i]);
    sum += at.weights[i] * (ObjectPoint{static_cast<double>(v.x), static_cast<double>(v.z)}.*coordinate);
  }
  return sum;
}

TEST(Barycentric, WeightsAreNonNegativeSumToOneAndReturnThePointExactly) {
  for (const TileShape& shape : deepest_shapes(9, 11)) {
    for_fine_points(shape, [&](ObjectPoint point) {
      const Barycentric at = barycentric(shape, point);
      for (const double weight : at.weights) ASSERT_GE(weight, 0.0);
      ASSERT_EQ(at.weights[0] + at.weights[1] + at.weights[2], 1.0);
      ASSERT_EQ(weighted(shape, at, &ObjectPoint::x), point.x) << point.x << "," << point.z;
      ASSERT_EQ(weighted(shape, at, &ObjectPoint::z), point.z) << point.x << "," << point.z;
    });
  }
}

TEST(Barycentric, WeightsHoldAtRandomPointsOfLargeTiles) {
  constexpr unsigned kSeed = 99;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const TileShape& shape : {TileShape::make(212, 243, 4), TileShape::make(2564, 3075, 10)}) {
    std::uniform_real_distribution<double> any_x(0.0, 2.0 * shape.cell_columns());
    std::uniform_real_distribution<double> any_z(0.0, shape.cell_rows());
    for (int i = 0; i < 50000; ++i) {
      ObjectPoint point{any_x(random), any_z(random)};
      if (i % 3 == 1) point.x = std::fmod(point.x, 1.0);
      if (i % 3 == 2) point.x = 2.0 * shape.cell_columns() - std::fmod(point.x, 1.0);
      const Barycentric at = barycentric(shape, point);
      for (const double weight : at.weights) ASSERT_GE(weight, 0.0);
      ASSERT_NEAR(at.weights[0] + at.weights[1] + at.weights[2], 1.0, 4.5e-16);  // two roundings near 1
      ASSERT_NEAR(weighted(shape, at, &ObjectPoint::x), point.x, 4e-12);         // roundings of coordinates below 8192
      ASSERT_NEAR(weighted(shape, at, &ObjectPoint::z), point.z, 4e-12);
    }
  }
}

TEST(Barycentric, VerticesAreATriangleOfTheLevel0StripThatHoldsThePoint) {
  for (const TileShape& shape : deepest_shapes(9, 11)) {
    std::set<std::set<std::uint32_t>> drawn;
    for (const test::Triangle& t : test::triangles_of_strip(strip_indices(shape, 0))) {
      if (!test::repeats_a_vertex(t)) drawn.insert({t[0], t[1], t[2]});
    }
    for_fine_points(shape, [&](ObjectPoint point) {
      const Barycentric at = barycentric(shape, point);
      std::set<std::uint32_t> named;
      for (const GridVertex& v : at.vertices) {
        ASSERT_TRUE(is_visible(shape, v));
        named.insert(static_cast<std::uint32_t>(v.column + v.row * shape.columns()));
      }
      // With weights >= 0 that return the point (above), the triangle holds it.
      ASSERT_EQ(drawn.count(named), 1U) << point.x << "," << point.z;
    });
  }
}

TEST(Barycentric, VerticesComeLeftmostAloneRightmost) {
  const TileShape shape = TileShape::make(8, 9, 1);
  for_fine_points(shape, [&](ObjectPoint point) {
    const Barycentric at = barycentric(shape, point);
    const ObjectVertex g = object_from_grid(shape, at.vertices[0]);
    const ObjectVertex h = object_from_grid(shape, at.vertices[1]);
    const ObjectVertex i = object_from_grid(shape, at.vertices[2]);
    ASSERT_EQ(g.z, i.z);
    ASSERT_EQ(std::abs(h.z - g.z), 1);
    ASSERT_LT(g.x, i.x);
    ASSERT_LE(g.x, h.x);
    ASSERT_LE(h.x, i.x);
  });
}

TEST(Barycentric, LinearFunctionsAreReproducedEverywhere) {
  for (const TileShape& shape : deepest_shapes(9, 11)) {
    std::vector<double> heights(static_cast<std::size_t>(shape.stored_vertex_count()), kNan);
    const View2D<double> view(heights.data(), shape.columns(), shape.rows());
    const auto plane = [](double x, double z) { return 3.0 * x - 5.0 * z + 7.0; };
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        const ObjectVertex v = object_from_grid(shape, GridVertex{c, r});
        if (is_visible(shape, {c, r})) view(c, r) = plane(v.x, v.z);  // padding stays void: it must not be read
      }
    }
    for_fine_points(shape, [&](ObjectPoint point) {
      ASSERT_EQ(interpolate(barycentric(shape, point), View2D<const double>(view)), plane(point.x, point.z));
    });
  }
}

std::vector<float> random_heights(const TileGrid& grid, TileIndex tile) {
  std::vector<float> heights;
  for (int r = 0; r < grid.shape().rows(); ++r) {
    for (int c = 0; c < grid.shape().columns(); ++c) {
      const LatticeVertex v = grid.lattice_vertex(tile, {c, r});
      heights.push_back(static_cast<float>((v.x * 7919 + v.z * 104729 + v.x * v.z * 31) % 1009));
    }
  }
  return heights;
}

TEST(Barycentric, InterpolationIsEqualBitForBitOnBothSidesOfTileEdges) {
  const TileShape shape = TileShape::make(8, 11, 2);
  const TileGrid grid = TileGrid::make(shape, 2, 2, 1.0, 1.0);
  std::vector<std::vector<float>> heights;
  for (std::int64_t i = 0; i < 4; ++i) heights.push_back(random_heights(grid, grid.tile_at(i)));
  const auto height = [&](std::int64_t tile, double x, double z) {
    const View2D<const float> view(heights[static_cast<std::size_t>(tile)].data(), shape.columns(), shape.rows());
    return interpolate(barycentric(shape, {x, z}), view);
  };
  const double width = 2.0 * shape.cell_columns();
  const double depth = shape.cell_rows();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (int i = 0; i < 5000; ++i) {
    const double x = i < 100 ? i * width / 99.0 : width * any(random);
    const double z = i < 100 ? i * depth / 99.0 : depth * any(random);
    ASSERT_EQ(height(0, width, z), height(1, 0.0, z)) << z;
    ASSERT_EQ(height(2, width, z), height(3, 0.0, z)) << z;
    ASSERT_EQ(height(0, x, depth), height(2, x, 0.0)) << x;
    ASSERT_EQ(height(1, x, depth), height(3, x, 0.0)) << x;
  }
}

TEST(Barycentric, VoidsAreReadOnlyWhereTheyHaveWeight) {
  const TileShape shape = TileShape::make(8, 9, 1);
  std::vector<float> heights(static_cast<std::size_t>(shape.stored_vertex_count()), 1.0F);
  heights[static_cast<std::size_t>(3 + 4 * shape.columns())] = std::numeric_limits<float>::quiet_NaN();
  const View2D<const float> view(heights.data(), shape.columns(), shape.rows());
  for_fine_points(shape, [&](ObjectPoint point) {
    const Barycentric at = barycentric(shape, point);
    bool touches = false;
    for (std::size_t i = 0; i < 3; ++i) touches |= at.weights[i] > 0.0 && at.vertices[i] == GridVertex{3, 4};
    const double value = interpolate(at, view);
    ASSERT_EQ(std::isnan(value), touches) << point.x << "," << point.z;
    if (!touches) {
      ASSERT_EQ(value, 1.0);
    }
  });
}

TEST(Barycentric, PointsOutsideAreMovedToTheSquare) {
  const TileShape shape = TileShape::make(8, 9, 1);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double x : {-inf, -3.0, 0.0, 8.0, 9.0, inf, kNan}) {
    for (const double z : {-inf, -3.0, 0.0, 6.0, 9.0, inf, kNan}) {
      const Barycentric at = barycentric(shape, {x, z});
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_TRUE(is_visible(shape, at.vertices[i]));
        EXPECT_GE(at.weights[i], 0.0);
      }
      EXPECT_EQ(at.weights[0] + at.weights[1] + at.weights[2], 1.0);
    }
  }
  const Barycentric corner = barycentric(shape, {-1.0, -1.0});
  EXPECT_EQ(weighted(shape, corner, &ObjectPoint::x), 0.0);
  EXPECT_EQ(weighted(shape, corner, &ObjectPoint::z), 0.0);
}

/// A position in grid space, fractional; integer at vertices.
struct GridPoint {
  double column;
  double row;
};

/// The exact inverse of Eq. 1 on the tile's visible square, extended piecewise linearly inside each triangle (E12):
/// a point in a triangle maps to the point with the same barycentric weights in the grid-space triangle.
GridPoint grid_from_object(const TileShape& shape, ObjectPoint point) {
  const int width = 2 * shape.cell_columns();
  // Row of triangles: rows r (above) and r+1 (below), v in [0, 1] from one to the other.
  const int row = std::min(static_cast<int>(point.z), shape.cell_rows() - 1) + 1;
  const double v = point.z - (row - 1);
  // Ordinary rows are straight shears: an odd row has its vertices at x = 2(c-1), an even one at x = 2(c-1)-1.
  const double even_share = row % 2 == 0 ? 1.0 - v : v;
  double column = (point.x + even_share) / 2.0 + 1.0;
  // Half triangles at the straight edges: at a constant z their columns run at twice the ordinary rate.
  if (point.x < even_share) column = 1.0 + point.x;
  if (point.x > width - even_share) column = (shape.columns() - 3) + (point.x - (width - even_share));
  return {column, row + v};
}

/// Table 2 as printed, on a position in grid space.
struct Table2 {
  GridVertex g;
  GridVertex h;
  double beta;
  double alpha;
};

Table2 table_2(const GridPoint& at) {
  const int c = static_cast<int>(at.column);
  const int r = static_cast<int>(at.row);
  const double u = at.column - c;
  const double v = at.row - r;
  if (r % 2 == 0 && u < 1.0 - v) return {{c, r}, {c, r + 1}, 1.0 - v, u};
  if (r % 2 == 0) return {{c, r + 1}, {c + 1, r}, v, u + v - 1.0};
  if (u > v) return {{c, r}, {c + 1, r + 1}, 1.0 - v, u - v};
  return {{c, r + 1}, {c, r}, v, u};
}

TEST(Barycentric, AgreesWithTable2OnThePiecewiseInverse) {
  for (const TileShape& shape : deepest_shapes(9, 11)) {
    for_fine_points(shape, [&](ObjectPoint point) {
      const Barycentric at = barycentric(shape, point);
      const Table2 table = table_2(grid_from_object(shape, point));
      const std::array<double, 3> weights = {table.beta - table.alpha, 1.0 - table.beta, table.alpha};
      const std::array<GridVertex, 3> vertices = {table.g, table.h, GridVertex{table.g.column + 1, table.g.row}};
      // On a side the two may name different triangles: compare the weights of each vertex, not their order.
      for (std::size_t i = 0; i < 3; ++i) {
        double weight = 0.0;
        for (std::size_t k = 0; k < 3; ++k) weight += at.vertices[k] == vertices[i] ? at.weights[k] : 0.0;
        ASSERT_EQ(weight, weights[i]) << point.x << "," << point.z;
      }
    });
  }
}

TEST(Errata, E11AlphaIsBetaTimesGamma) {
  const TileShape shape = TileShape::make(8, 9, 1);
  int told_apart = 0;
  for_fine_points(shape, [&](ObjectPoint point) {
    const Barycentric at = barycentric(shape, point);
    const ObjectVertex g = object_from_grid(shape, at.vertices[0]);
    const ObjectVertex h = object_from_grid(shape, at.vertices[1]);
    const ObjectVertex i = object_from_grid(shape, at.vertices[2]);
    // Figure 9: the horizontal line through the point cuts HG and HI; gamma is the point's place between the cuts.
    const double beta = 1.0 - std::abs(point.z - g.z);
    if (beta == 0.0) return;  // at H, where the cuts coincide
    const double left = (1.0 - beta) * h.x + beta * g.x;
    const double right = (1.0 - beta) * h.x + beta * i.x;
    const double gamma = (point.x - left) / (right - left);
    ASSERT_NEAR(at.weights[2], beta * gamma, 1e-15);
    ASSERT_NEAR(at.weights[0], beta * (1.0 - gamma), 1e-15);
    ASSERT_NEAR(at.weights[1], 1.0 - beta, 1e-15);
    if (std::abs(gamma / beta - at.weights[2]) > 0.01) ++told_apart;  // as printed
  });
  EXPECT_GT(told_apart, 1000);
}

TEST(Errata, E12Table2WithoutThePiecewiseInverseMissesTheHalfTriangles) {
  const TileShape shape = TileShape::make(8, 9, 1);
  const ObjectPoint point{0.25, 0.5};  // in the half triangle (1,2) (2,2) (1,1)
  const Barycentric at = barycentric(shape, point);
  EXPECT_EQ(at.vertices[0], (GridVertex{1, 2}));
  EXPECT_EQ(at.vertices[1], (GridVertex{1, 1}));
  EXPECT_EQ(at.vertices[2], (GridVertex{2, 2}));
  EXPECT_EQ(at.weights, (std::array<double, 3>{0.25, 0.5, 0.25}));
  // Eq. 1's ordinary inverse: c = (x + share of the even row) / 2 + 1.
  const Table2 naive = table_2({(point.x + 0.5) / 2.0 + 1.0, point.z + 1.0});
  EXPECT_NE(naive.alpha, 0.25);
}

}  // namespace
}  // namespace isohf
