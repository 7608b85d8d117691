#include "terrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace isohf::terrain {
namespace {

std::vector<float> row_of(const Terrain& terrain, std::int64_t column, std::int64_t row, std::size_t count) {
  std::vector<float> heights(count);
  terrain.row(column, row, heights);
  return heights;
}

std::vector<float> square_of(const Terrain& terrain, std::int64_t column, std::int64_t row, std::size_t side) {
  std::vector<float> all;
  for (std::size_t r = 0; r < side; ++r) {
    const auto heights = row_of(terrain, column, row + static_cast<std::int64_t>(r), side);
    all.insert(all.end(), heights.begin(), heights.end());
  }
  return all;
}

/// Mean absolute second difference along a row: how rough the land is from one sample to the next.
double roughness(const std::vector<float>& heights) {
  double sum = 0;
  for (std::size_t i = 2; i < heights.size(); ++i) sum += std::abs(heights[i] - 2 * heights[i - 1] + heights[i - 2]);
  return sum / static_cast<double>(heights.size() - 2);
}

TEST(Terrain, IsTheSameHoweverARowIsCut) {
  TerrainOptions options;
  options.void_fraction = 0.1;
  const Terrain terrain(options);
  const auto whole = row_of(terrain, 0, 77, 1500);
  for (const std::size_t from : {1U, 7U, 255U, 256U, 257U, 900U}) {
    for (const std::size_t count : {1U, 31U, 256U, 600U}) {
      const auto part = row_of(terrain, static_cast<std::int64_t>(from), 77, count);
      EXPECT_EQ(std::memcmp(part.data(), whole.data() + from, count * sizeof(float)), 0) << from << " " << count;
    }
  }
}

TEST(Terrain, IsAnotherLandForAnotherSeed) {
  TerrainOptions options;
  const auto one = row_of(Terrain(options), 0, 0, 500);
  options.seed = 2;
  const auto two = row_of(Terrain(options), 0, 0, 500);
  EXPECT_NE(one, two);
}

TEST(Terrain, StaysWithinItsBounds) {
  TerrainOptions options;
  options.feature_m = 1500;
  for (const double relief : {1.0, 2500.0, 20000.0}) {
    for (const bool coast : {false, true}) {
      options.relief_m = relief;
      options.coast = coast;
      options.base_m = -300;
      const Terrain terrain(options);
      const auto [low, high] = terrain.bounds();
      const auto heights = square_of(terrain, 1000, 2000, 300);
      const auto [least, most] = std::minmax_element(heights.begin(), heights.end());
      EXPECT_GE(*least, low);
      EXPECT_LE(*most, high);
      EXPECT_GT(*most - *least, 0.2 * relief) << "flat land";
    }
  }
}

TEST(Terrain, HasNoCliffsBetweenChunksOrLatticeCells) {
  TerrainOptions options;
  options.roughness_m = 0;
  const Terrain terrain(options);
  // 30 m apart: 80 degrees of slope is 170 m.
  const auto heights = square_of(terrain, 0, 0, 600);
  for (std::size_t r = 1; r < 600; ++r) {
    for (std::size_t c = 1; c < 600; ++c) {
      const float h = heights[r * 600 + c];
      ASSERT_LT(std::abs(h - heights[r * 600 + c - 1]), 170) << c << " " << r;
      ASSERT_LT(std::abs(h - heights[(r - 1) * 600 + c]), 170) << c << " " << r;
    }
  }
}

TEST(Terrain, IsAsFineFarFromTheOriginAsNearIt) {
  TerrainOptions options;
  options.roughness_m = 0;
  const Terrain terrain(options);
  double near = 0;
  double far = 0;
  for (std::int64_t r = 0; r < 400; ++r) {
    near += roughness(row_of(terrain, 0, 37 * r, 2000));
    far += roughness(row_of(terrain, 1'500'000'000, 1'700'000'000 + 37 * r, 2000));
  }
  // Positions held in floats would give steps of 128 samples out there, and cliffs between them.
  EXPECT_LT(far, 1.5 * near);
  EXPECT_GT(far, near / 1.5);
}

TEST(Terrain, VoidPatchesCoverTheShareAskedFor) {
  for (const double share : {0.02, 0.1, 0.4}) {
    TerrainOptions options;
    options.void_fraction = share;
    const auto heights = square_of(Terrain(options), 0, 0, 1024);
    const auto voids = std::count_if(heights.begin(), heights.end(), [](float h) { return std::isnan(h); });
    // 256 cells, each with a patch or not: three standard deviations are under half of the smallest share.
    EXPECT_NEAR(static_cast<double>(voids) / (1024.0 * 1024.0), share, 0.25 * share + 0.012) << share;
  }
}

TEST(Terrain, CoastIsAFlatSeaAtTheBase) {
  TerrainOptions options;
  options.seed = 60;
  options.coast = true;
  options.base_m = 12;
  const auto heights = square_of(Terrain(options), 0, 0, 384);
  const auto sea = std::count(heights.begin(), heights.end(), 12.0F);
  EXPECT_GT(sea, 384 * 384 / 5);
  EXPECT_LT(sea, 384 * 384 * 4 / 5);
  EXPECT_GE(*std::min_element(heights.begin(), heights.end()), 12 - options.roughness_m);
}

}  // namespace
}  // namespace isohf::terrain
