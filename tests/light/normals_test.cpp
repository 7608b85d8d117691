#include "isohf/light/normals.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"

namespace isohf {
namespace {

using Vector = std::array<double, 3>;
constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

/// Two components of a unit float vector that agree to this differ by the rounding of their last place.
constexpr double kFloatRounding = 1.2e-7;

Vector vector_of(const Normal& n) {
  return {n.x, n.y, n.z};
}

Vector unit(const Vector& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

void expect_close(const Normal& found, const Vector& wanted, double tolerance) {
  const Vector other = vector_of(found);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(other[i], wanted[i], tolerance) << "component " << i;
}

/// A tile cut from one function of all lattice vertices, as neighbours share it.
struct Tile {
  template <typename Height>
  Tile(const TileGrid& grid, TileIndex index, Height&& height)
      : heights(static_cast<std::size_t>(grid.shape().stored_vertex_count())), normals(heights.size()) {
    const TileShape& shape = grid.shape();
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        elevations(shape)(c, r) = static_cast<float>(height(grid.lattice_vertex(index, {c, r})));
      }
    }
  }
  View2D<float> elevations(const TileShape& shape) { return {heights.data(), shape.columns(), shape.rows()}; }
  View2D<Normal> computed(const TileGrid& grid) {
    const View2D<Normal> view(normals.data(), grid.shape().columns(), grid.shape().rows());
    tile_normals(grid, elevations(grid.shape()), view);
    return view;
  }

  std::vector<float> heights;
  std::vector<Normal> normals;
};

/// 16-bit elevations in steps of 1/8, a hash of the vertex.
double random_height(LatticeVertex v) {
  auto h =
      static_cast<std::uint64_t>(v.x) * 0x9e3779b97f4a7c15U ^ static_cast<std::uint64_t>(v.z) * 0xc2b2ae3d27d4eb4fU;
  h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9U;
  h ^= h >> 32;
  return static_cast<double>(h & 0xffffU) / 8.0;
}

std::vector<TileShape> small_shapes() {
  std::vector<TileShape> shapes;
  for (int columns = 5; columns <= 9; ++columns) {
    for (int rows = 5; rows <= 11; rows += 2) shapes.push_back(TileShape::make(columns, rows, 1));
  }
  shapes.push_back(TileShape::make(20, 19, 4));
  return shapes;
}

template <typename Visit>
void for_visible(const TileShape& shape, Visit&& visit) {
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      if (is_visible(shape, {c, r})) visit(GridVertex{c, r});
    }
  }
}

// Spacings, slopes and heights are short binary fractions: elevations are exact, and what is left is the rounding of
// the three components to float.
TEST(Normals, AreExactForPlanesEverywhere) {
  const double slopes[][2] = {{0.0, 0.0}, {0.5, 0.0}, {0.0, -0.75}, {1.25, 0.5}, {-3.0, 2.0}};
  for (const TileShape& shape : small_shapes()) {
    for (const double stretch : {1.0, 4.0, 0.125}) {
      const TileGrid grid =
          TileGrid::make(shape, 2, 2, 2.0 * shape.cell_columns() * 0.5, shape.cell_rows() * 0.25 * stretch);
      for (const auto& slope : slopes) {
        const double alpha = slope[0];
        const double beta = slope[1];
        const Vector wanted = unit({-alpha, 1.0, -beta});
        Tile tile(grid, {1, 0}, [&](LatticeVertex v) {
          const WorldPoint p = grid.world_from_lattice(v);
          return alpha * p.x + beta * p.z;
        });
        const View2D<Normal> normals = tile.computed(grid);
        for_visible(shape, [&](GridVertex v) {
          SCOPED_TRACE(testing::Message() << shape.columns() << "x" << shape.rows() << " (" << v.column << "," << v.row
                                          << ") slopes " << alpha << "," << beta);
          expect_close(normals(v.column, v.row), wanted, kFloatRounding);
        });
      }
    }
  }
}

TEST(Normals, BatchEqualsSingleBitForBit) {
  std::vector<TileShape> shapes = small_shapes();
  shapes.push_back(TileShape::make(212, 243, 4));
  shapes.push_back(TileShape::make(524, 11, 2));  // more columns than the batch handles in one piece
  for (const TileShape& shape : shapes) {
    const TileGrid grid = TileGrid::make(shape, 3, 3, 700.0, 1100.0);
    Tile tile(grid, {1, 1}, random_height);
    tile.heights[tile.heights.size() / 3] = kVoid;
    const View2D<Normal> normals = tile.computed(grid);
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        ASSERT_EQ(normals(c, r), vertex_normal(grid, tile.elevations(shape), {c, r})) << c << "," << r;
      }
    }
  }
}

TEST(Normals, AreEqualBitForBitOnBothSidesOfEveryEdgeAndCorner) {
  for (const TileShape& shape : small_shapes()) {
    const TileGrid grid = TileGrid::make(shape, 3, 3, 90.0, 107.0);
    std::map<std::pair<std::int64_t, std::int64_t>, std::pair<Normal, int>> seen;
    for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
      Tile tile(grid, grid.tile_at(i), random_height);
      const View2D<Normal> normals = tile.computed(grid);
      for_visible(shape, [&](GridVertex v) {
        const LatticeVertex at = grid.lattice_vertex(grid.tile_at(i), v);
        auto& [first, tiles] = seen.try_emplace({at.x, at.z}, std::pair{normals(v.column, v.row), 0}).first->second;
        ASSERT_EQ(first, normals(v.column, v.row)) << at.x << "," << at.z;
        ++tiles;
      });
    }
    int in_four_tiles = 0;
    for (const auto& [at, entry] : seen) in_four_tiles += entry.second == 4 ? 1 : 0;
    EXPECT_EQ(in_four_tiles, 4);
  }
}

TEST(Normals, HoldNothingAtInvisibleVerticesAndPointUpBesideVoids) {
  const TileShape shape = TileShape::make(8, 11, 1);
  const TileGrid grid = TileGrid::make(shape, 1, 1, 10.0, 12.0);
  // Which vertices are on one triangle of the drawn mesh or its continuation: from the strips of a 3x3 neighbourhood.
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<LatticeVertex>> around;
  const std::vector<test::Triangle> triangles = test::triangles_of_strip(strip_indices(shape, 0));
  for (std::int64_t tc = -1; tc <= 1; ++tc) {
    for (std::int64_t tr = -1; tr <= 1; ++tr) {
      for (const test::Triangle& t : triangles) {
        if (test::repeats_a_vertex(t)) continue;
        for (const std::uint32_t a : t) {
          for (const std::uint32_t b : t) {
            const LatticeVertex p = grid.lattice_vertex({tc, tr}, test::vertex_of(shape, a));
            around[{p.x, p.z}].push_back(grid.lattice_vertex({tc, tr}, test::vertex_of(shape, b)));
          }
        }
      }
    }
  }
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      for (const float hole : {kVoid, std::numeric_limits<float>::infinity()}) {
        Tile tile(grid, {0, 0}, random_height);
        tile.elevations(shape)(c, r) = hole;
        const LatticeVertex where = grid.lattice_vertex({0, 0}, {c, r});
        const View2D<Normal> normals = tile.computed(grid);
        for (int row = 0; row < shape.rows(); ++row) {
          for (int column = 0; column < shape.columns(); ++column) {
            const Normal normal = normals(column, row);
            const LatticeVertex at = grid.lattice_vertex({0, 0}, {column, row});
            const auto& neighbours = around[{at.x, at.z}];
            if (!is_visible(shape, {column, row})) {
              ASSERT_EQ(normal, (Normal{0.0F, 0.0F, 0.0F}));
            } else if (std::find(neighbours.begin(), neighbours.end(), where) != neighbours.end()) {
              ASSERT_EQ(normal, (Normal{0.0F, 1.0F, 0.0F})) << column << "," << row << " beside " << c << "," << r;
            } else {
              ASSERT_NE(normal, (Normal{0.0F, 1.0F, 0.0F}));
            }
          }
        }
      }
    }
  }
}

TEST(Normals, StayFiniteForTheLargestFloats) {
  const TileShape shape = TileShape::make(9, 9, 1);
  const TileGrid grid = TileGrid::make(shape, 1, 1, 0.5, 0.5);
  Tile tile(grid, {0, 0}, [](LatticeVertex v) {
    return random_height(v) > 4096.0 ? std::numeric_limits<float>::max() : std::numeric_limits<float>::lowest();
  });
  const View2D<Normal> normals = tile.computed(grid);
  for_visible(shape, [&](GridVertex v) {
    const Vector n = vector_of(normals(v.column, v.row));
    EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1.0, 2 * kFloatRounding);
  });
}

/// The sum over the real triangles around each vertex of the middle tile, taken from the strips of all nine tiles.
std::map<std::pair<std::int64_t, std::int64_t>, std::pair<Vector, int>> fans(const TileGrid& grid) {
  std::map<std::pair<std::int64_t, std::int64_t>, std::pair<Vector, int>> sums;
  const TileShape& shape = grid.shape();
  const std::vector<test::Triangle> triangles = test::triangles_of_strip(strip_indices(shape, 0));
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    for (const test::Triangle& t : triangles) {
      if (test::repeats_a_vertex(t)) continue;
      std::array<LatticeVertex, 3> at{};
      std::array<Vector, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        at[k] = grid.lattice_vertex(grid.tile_at(i), test::vertex_of(shape, t[k]));
        const WorldPoint ground = grid.world_from_lattice(at[k]);
        p[k] = {ground.x, random_height(at[k]), ground.z};
      }
      const Vector u = {p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]};
      const Vector v = {p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]};
      const Vector cross = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
      for (const LatticeVertex& vertex : at) {
        auto& [sum, faces] = sums[{vertex.x, vertex.z}];
        for (std::size_t k = 0; k < 3; ++k) sum[k] += cross[k];
        ++faces;
      }
    }
  }
  return sums;
}

TEST(Errata, E07NormalsAreTheAreaWeightedSumOverTheRealFan) {
  for (const TileShape& shape : small_shapes()) {
    const TileGrid grid = TileGrid::make(shape, 3, 3, 9000.0, 11000.0);
    const auto sums = fans(grid);
    Tile tile(grid, {1, 1}, random_height);
    const View2D<Normal> normals = tile.computed(grid);
    const int east = shape.columns() - 2;
    for_visible(shape, [&](GridVertex v) {
      const LatticeVertex at = grid.lattice_vertex({1, 1}, v);
      const auto& [sum, faces] = sums.at({at.x, at.z});
      SCOPED_TRACE(testing::Message() << shape.columns() << "x" << shape.rows() << " (" << v.column << "," << v.row
                                      << ")");
      const bool odd = v.row % 2 != 0;
      const bool on_edge = v.column == 1 || v.column == (odd ? east - 1 : east);
      EXPECT_EQ(faces, on_edge ? (odd ? 8 : 4) : 6);
      expect_close(normals(v.column, v.row), unit(sum), kFloatRounding);
    });
  }
}

// Beyond the errata: the vertices next to the slid ones have six faces as well, but not a regular hexagon's. With the
// regular stencil a plane that rises eastwards would come out a sixth too flat there.
TEST(Errata, E07VerticesNextToASlidOneHaveANarrowerFan) {
  const TileShape shape = TileShape::make(9, 9, 1);
  const TileGrid grid = TileGrid::make(shape, 1, 1, 10.0, 8.0);
  Tile tile(grid, {0, 0}, [&](LatticeVertex v) { return grid.world_from_lattice(v).x; });
  const View2D<const float> h = tile.elevations(shape);
  const Normal normal = vertex_normal(grid, h, {2, 4});
  expect_close(normal, unit({-1.0, 1.0, 0.0}), kFloatRounding);
  const double regular =
      (2.0 * (h(3, 4) - h(1, 4)) + (h(2, 5) - h(1, 5)) + (h(2, 3) - h(1, 3))) / 12.0 / grid.sigma_x();
  EXPECT_NEAR(regular, 5.0 / 6.0, 1e-6);
}

/// An equilateral tile with edges of one unit, as Eqs. 10-11 assume, and a vertex's neighbours in the paper's letters.
struct UnitHexagon {
  TileShape shape = TileShape::make(9, 9, 1);
  TileGrid grid = TileGrid::make(shape, 1, 1, shape.cell_columns(), shape.cell_rows() * kSin60);
  double alpha = 0.25;
  double beta = -0.5;
  Tile tile{grid, {0, 0}, [this](LatticeVertex v) {
              const WorldPoint p = grid.world_from_lattice(v);
              return alpha * p.x + beta * p.z;
            }};
  /// Clockwise from the North-West neighbour of (4, 3): D E F G H I (Eq. 10, s = 1).
  std::array<double, 6> neighbours() {
    const View2D<const float> h = tile.elevations(shape);
    return {h(4, 2), h(5, 2), h(5, 3), h(5, 4), h(4, 4), h(3, 3)};
  }
  Normal normal() { return vertex_normal(grid, tile.elevations(shape), {4, 3}); }
};

TEST(Errata, E08NormalsOfAUnitHexagonHaveYOfFourSin60) {
  UnitHexagon hexagon;
  const auto [d, e, f, g, h, i] = hexagon.neighbours();
  const double gd = d - g;
  const double eh = h - e;
  const double fi = i - f;
  const double x = 4.0 / 6.0 * kSin60 * (gd + eh + 2.0 * fi);
  const double z = gd - eh;
  // Elevations of the plane are rounded to float: half of 2^-23 relative, on heights below 4, over distances of 1.
  const double tolerance = 4e-7;
  expect_close(hexagon.normal(), unit({x, 4.0 * kSin60, z}), tolerance);
  expect_close(hexagon.normal(), unit({-hexagon.alpha, 1.0, -hexagon.beta}), tolerance);
  const Vector printed = {x, 4.0, z};
  EXPECT_NEAR(printed[0] / printed[1] / -hexagon.alpha, 1.0 - 0.134, 0.001);
}

TEST(Errata, E09ThirdRowOfKTakesTheDifferenceOfTheFirstTwoTerms) {
  UnitHexagon hexagon;
  const auto [d, e, f, g, h, i] = hexagon.neighbours();
  const std::array<double, 4> c = {d - g, h - e, i - f, 1.0};
  const auto times = [&](const std::array<double, 4>& row) {
    return row[0] * c[0] + row[1] * c[1] + row[2] * c[2] + row[3] * c[3];
  };
  const double third = 1.0 / std::numbers::sqrt3;
  const std::array<double, 4> first_row = {third, third, 2.0 * third, 0.0};
  const std::array<double, 4> second_row = {0.0, 0.0, 0.0, 4.0 * kSin60};  // E8
  const std::array<double, 4> third_row = {1.0, -1.0, 0.0, 0.0};
  const std::array<double, 4> printed_third_row = {1.0, -1.0, 1.0, 0.0};
  expect_close(hexagon.normal(), unit({times(first_row), times(second_row), times(third_row)}), 4e-7);
  const Vector printed = unit({times(first_row), times(second_row), times(printed_third_row)});
  EXPECT_GT(std::abs(printed[2] - hexagon.normal().z), 0.05);
}

TEST(Errata, E10FourSixthsIsAFraction) {
  UnitHexagon hexagon;
  const auto [d, e, f, g, h, i] = hexagon.neighbours();
  const double sum = (d - g) + (h - e) + 2.0 * (i - f);
  const double printed = (4 / 6) * kSin60 * sum;  // as GLSL divides
  EXPECT_EQ(printed, 0.0);
  EXPECT_NEAR(4.0 / 6.0 * kSin60 * sum / (4.0 * kSin60), hexagon.normal().x / hexagon.normal().y, 1e-6);
  EXPECT_NE(hexagon.normal().x, 0.0F);
}

}  // namespace
}  // namespace isohf
