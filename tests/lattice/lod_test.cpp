#include "isohf/lattice/lod.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"

namespace isohf {
namespace {

const double kInf = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Lod, LevelsFollowTheAreaBySection39) {
  // "level λ is used only when full-detail triangles have area 4^(1-λ) pixels"
  for (int level = 0; level <= 9; ++level) {
    EXPECT_DOUBLE_EQ(fractional_level(std::pow(4.0, 1 - level), 10), level);
  }
  EXPECT_DOUBLE_EQ(fractional_level(1.0 / 256.0, 10), 5.0);
  EXPECT_DOUBLE_EQ(fractional_level(2.0, 10), 0.5);
  EXPECT_DOUBLE_EQ(fractional_level(2.0, 10, 32.0), 2.0);
}

TEST(Lod, LevelsStayInRange) {
  for (int levels = 1; levels <= 14; ++levels) {
    EXPECT_EQ(fractional_level(0.0, levels), levels - 1);
    EXPECT_EQ(fractional_level(1e-300, levels), levels - 1);
    EXPECT_EQ(fractional_level(1e300, levels), 0.0);
    EXPECT_EQ(fractional_level(kInf, levels), 0.0);
    EXPECT_EQ(fractional_level(kNan, levels), 0.0);
  }
}

TEST(Lod, BlendsInTwoStagesByEqs7And8) {
  const LodBlend near_fine = lod_blend(2.25, 4);
  EXPECT_EQ(near_fine.first, 2);
  EXPECT_EQ(near_fine.second, 3);
  EXPECT_DOUBLE_EQ(near_fine.alpha, 0.5);
  const LodBlend near_coarse = lod_blend(2.75, 4);
  EXPECT_EQ(near_coarse.first, 3);
  EXPECT_EQ(near_coarse.second, 2);
  EXPECT_DOUBLE_EQ(near_coarse.alpha, 0.5);
  const LodBlend middle = lod_blend(0.5, 4);
  EXPECT_EQ(middle.first, 1);
  EXPECT_EQ(middle.second, 0);
  EXPECT_DOUBLE_EQ(middle.alpha, 1.0);
}

/// How much of the picture's weight goes to a level where the other covers it: first is opaque, second lies over it.
double weight_of(const LodBlend& blend, int level) {
  double weight = 0.0;
  if (blend.first == level) weight += 1.0 - blend.alpha;
  if (blend.second == level) weight += blend.alpha;
  return weight;
}

TEST(Lod, BlendIsContinuousButForTheOrderAtTheMiddle) {
  for (int levels = 1; levels <= 6; ++levels) {
    for (double level = 0.0; level < levels - 1; level += 1.0 / 64.0) {
      const LodBlend here = lod_blend(level, levels);
      const LodBlend next = lod_blend(level + 1.0 / 64.0, levels);
      ASSERT_GE(here.alpha, 0.0);
      ASSERT_LE(here.alpha, 1.0);
      ASSERT_LE(std::abs(here.first - here.second), 1);
      const double beta = level - std::floor(level);
      const bool swaps = beta < 0.5 && beta + 1.0 / 64.0 >= 0.5;
      if (swaps) {
        // Both drawn in full from here on, in the other order: visible surfaces are the upper of the two either way.
        EXPECT_NEAR(next.alpha, 1.0, 1.0 / 32.0);
        EXPECT_NEAR(here.alpha, 1.0, 1.0 / 32.0);
        EXPECT_EQ(here.first, next.second);
        continue;
      }
      for (int l = 0; l < levels; ++l) ASSERT_NEAR(weight_of(here, l), weight_of(next, l), 1.0 / 32.0 + 1e-12);
    }
  }
}

TEST(Lod, WholeLevelsAreDrawnAlone) {
  for (int levels = 1; levels <= 6; ++levels) {
    for (int level = 0; level < levels; ++level) {
      const LodBlend blend = lod_blend(level, levels);
      EXPECT_EQ(blend.first, level);
      EXPECT_EQ(blend.alpha, 0.0);
      EXPECT_LT(blend.second, levels);
    }
    EXPECT_EQ(lod_blend(1e9, levels).first, levels - 1);
    EXPECT_EQ(lod_blend(-1.0, levels).first, 0);
    EXPECT_EQ(lod_blend(kNan, levels).first, 0);
  }
}

TEST(Errata, E18AreaOfAFlatTriangleIsSigmaXTimesSigmaZ) {
  const TileShape shape = TileShape::make(12, 11, 3);
  const double sin60 = std::numbers::sqrt3 / 2.0;
  // Equilateral triangles with edges of 10.
  const TileGrid grid = TileGrid::make(shape, 1, 1, 10.0 * shape.cell_columns(), 10.0 * sin60 * shape.cell_rows());
  const double edge = 2.0 * grid.sigma_x();  // half an edge, not twice the edge
  EXPECT_DOUBLE_EQ(edge, 10.0);
  EXPECT_NEAR(triangle_area(grid, 0.0), std::numbers::sqrt3 / 4.0 * edge * edge, 1e-12);
  EXPECT_NEAR(triangle_area(grid, 1.0), std::numbers::sqrt2 * triangle_area(grid, 0.0), 1e-12);
  EXPECT_GT(triangle_area(grid, 0.0), 20.0 * grid.sigma_x() * std::numbers::sqrt3 / 8.0);  // as printed: 1.08, a length
}

/// Calls check with the triangle's area times how far a level's surface lies above the full-detail vertex, for each
/// vertex inside or on each of its triangles. Heights x² + z² (times `sign`) are integers, so all of it is exact.
template <typename Check>
void for_level_against_vertices(const TileShape& shape, int level, std::int64_t sign, Check&& check) {
  const auto height = [&](const ObjectVertex& p) { return sign * (std::int64_t{p.x} * p.x + std::int64_t{p.z} * p.z); };
  const auto doubled = [](const ObjectVertex& a, const ObjectVertex& b, const ObjectVertex& c) {
    return std::int64_t{b.z - a.z} * (c.x - a.x) - std::int64_t{b.x - a.x} * (c.z - a.z);
  };
  for (const test::Triangle& t : test::triangles_of_strip(strip_indices(shape, level))) {
    if (test::repeats_a_vertex(t)) continue;
    const ObjectVertex a = test::place_of(shape, t[0]);
    const ObjectVertex b = test::place_of(shape, t[1]);
    const ObjectVertex c = test::place_of(shape, t[2]);
    for (int r = 1; r <= shape.rows() - 2; ++r) {
      for (int column = 1; column < shape.columns(); ++column) {
        if (!is_visible(shape, {column, r})) continue;
        const ObjectVertex p = object_from_grid(shape, GridVertex{column, r});
        const std::int64_t wa = doubled(p, b, c);
        const std::int64_t wb = doubled(a, p, c);
        const std::int64_t wc = doubled(a, b, p);
        if (wa < 0 || wb < 0 || wc < 0) continue;
        check(wa * height(a) + wb * height(b) + wc * height(c) - (wa + wb + wc) * height(p));
      }
    }
  }
}

// Where the surface curves downwards (a hill) a coarser level lies below it, in a valley above: C <= F where F'' < 0.
TEST(Errata, E17CoarserLevelsLieBelowHillsAndAboveValleys) {
  const TileShape shape = TileShape::make(12, 19, 4);
  for (int level = 1; level < shape.levels(); ++level) {
    int below = 0;
    for_level_against_vertices(shape, level, -1, [&](std::int64_t coarse_above_fine) {
      ASSERT_LE(coarse_above_fine, 0);
      below += coarse_above_fine < 0 ? 1 : 0;
    });
    EXPECT_GT(below, 0);
    for_level_against_vertices(shape, level, 1,
                               [](std::int64_t coarse_above_fine) { ASSERT_GE(coarse_above_fine, 0); });
  }
}

// Beyond the errata: section 3.9 divides the area by the depth once. What projects like 1/z are lengths.
TEST(Lod, ProjectedAreaFallsWithTheSquareOfTheDistance) {
  const double focal_px = 1000.0;
  // A square metre at 10 m: 100 x 100 pixels.
  EXPECT_DOUBLE_EQ(projected_area_px(1.0, focal_px, 10.0), 10000.0);
  EXPECT_DOUBLE_EQ(projected_area_px(1.0, focal_px, 20.0), 2500.0);
  EXPECT_EQ(projected_area_px(1.0, focal_px, 0.0), kInf);
  EXPECT_EQ(projected_area_px(1.0, focal_px, -5.0), kInf);
  // So each doubling of the distance is one level.
  EXPECT_DOUBLE_EQ(fractional_level(projected_area_px(1.0, focal_px, 2000.0), 14) -
                       fractional_level(projected_area_px(1.0, focal_px, 1000.0), 14),
                   1.0);
}

}  // namespace
}  // namespace isohf
