#include "height_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruction_error.h"

namespace isohf::experiment {
namespace {

std::vector<TestMesh> all_meshes(std::int64_t triangles) {
  return {make_iso_mesh(triangles), make_ortho_mesh(triangles, Diagonals::kConsistent),
          make_ortho_mesh(triangles, Diagonals::kAlternating)};
}

TEST(TestMesh, EveryVertexInsideStandsForAnAreaOfOne) {
  for (const std::int64_t triangles : {500, 1000, 5000, 10000}) {
    for (const TestMesh& mesh : all_meshes(triangles)) {
      EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), static_cast<double>(triangles),
                  0.1 * static_cast<double>(triangles));
      int measured = 0;
      for (const MeshTriangle& t : mesh.triangles) {
        EXPECT_GT(mesh.shapes[t.shape].doubled_area(), 0.0);
        if (!t.is_measured) continue;
        ++measured;
        EXPECT_NEAR(mesh.shapes[t.shape].doubled_area(), 1.0, 1e-12);
      }
      EXPECT_GE(measured, 50);
    }
  }
}

TEST(TestMesh, LooksTheSameAfterHalfATurn) {
  for (const TestMesh& mesh : all_meshes(1000)) {
    double x = 0.0;
    double z = 0.0;
    for (const MeshTriangle& t : mesh.triangles) {
      if (!t.is_measured) continue;
      for (const std::uint32_t v : t.vertices) {
        x += mesh.vertices[v].x;
        z += mesh.vertices[v].z;
      }
    }
    EXPECT_NEAR(x, 0.0, 1e-9);
    EXPECT_NEAR(z, 0.0, 1e-9);
  }
}

TEST(TriangleRule, IntegratesPolynomialsOfDegreeFive) {
  for (const int parts : {1, 2, 8}) {
    double area = 0.0;
    double moment = 0.0;
    for (const RulePoint& p : triangle_rule(parts)) {
      area += p.weight;
      moment += p.weight * std::pow(p.second, 3) * std::pow(p.third, 2);
    }
    EXPECT_NEAR(area, 1.0, 1e-14);
    EXPECT_NEAR(moment, 2.0 * 6.0 * 2.0 / 5040.0, 1e-15);  // 2·a!b!/(a+b+2)!
  }
  EXPECT_EQ(elevation_rule().size(), kElevationPoints);
  EXPECT_EQ(slope_rule().size(), kSlopePoints);
}

// No other heights are better: the error is at its least where moving any vertex either way makes it worse.
TEST(HeightFit, BeatsInterpolation) {
  const SineWave wave = {0.7, 0.2};
  for (const TestMesh& mesh : all_meshes(1000)) {
    const ComplexHeights exact = wave_at_vertices(wave, mesh);
    const ComplexHeights fitted = HeightFit(mesh).fit(wave);
    TestMesh whole = mesh;
    for (MeshTriangle& t : whole.triangles) t.is_measured = true;
    const ErrorMeter meter(whole, wave, 1.0);
    const std::vector<bool> all(whole.triangles.size(), true);
    const auto squared = [&](const ComplexHeights& heights) {
      std::vector<double> phase_0;
      for (const std::complex<double>& y : heights) phase_0.push_back(y.imag());
      ErrorSums sums;
      meter.add(all, exact, phase_0, sums);
      return sums.sums[kRms];
    };
    const double least = squared(fitted);
    EXPECT_LT(least, 0.5 * squared(exact));
    for (const std::size_t i : {std::size_t{0}, fitted.size() / 2, fitted.size() - 1}) {
      for (const double step : {-1e-3, 1e-3}) {
        ComplexHeights moved = fitted;
        moved[i] += std::complex<double>(0.0, step);
        EXPECT_GT(squared(moved), least);
      }
    }
  }
}

// Crests along a diagonal: every square on a slope takes the diagonal that lies along the crest.
TEST(FitDiagonals, TakeTheDiagonalsAlongTheCrests) {
  const TestMesh mesh = make_ortho_mesh(1000, Diagonals::kBoth);
  for (const bool along_consistent : {true, false}) {
    const SineWave wave = {(along_consistent ? 0.75 : 0.25) * std::numbers::pi, 0.05};
    const ComplexHeights exact = wave_at_vertices(wave, mesh);
    std::vector<double> heights;
    for (const std::complex<double>& y : exact) heights.push_back(y.imag());
    const DiagonalChoice choice = fit_diagonals(mesh, wave_on_shapes(wave, mesh), exact, heights, true);
    int other = 0;
    for (const std::uint8_t takes_other : choice.takes_other) other += takes_other;
    const double share = other / static_cast<double>(choice.takes_other.size());
    EXPECT_NEAR(share, along_consistent ? 0.0 : 1.0, 0.1);
  }
}

}  // namespace
}  // namespace isohf::experiment
