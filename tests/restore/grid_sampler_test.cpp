#include "isohf/restore/grid_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "isohf/sampling/resample/kernels.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(QuinticSpline, PassesThroughItsSamples) {
  std::vector<double> samples;
  for (int i = 0; i < 90; ++i) samples.push_back(std::sin(i * i * 0.37) * 100.0);
  std::vector<double> line = samples;
  quintic_prefilter(line);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const QuinticWeights at = quintic_weights(static_cast<double>(i));
    double sum = 0.0;
    for (int t = 0; t < 6; ++t) {
      sum += at.weights[static_cast<std::size_t>(t)] * line[static_cast<std::size_t>(mirror_index(at.first + t, 90))];
    }
    EXPECT_NEAR(sum, samples[i], 1e-9);  // a few hundred roundings of numbers up to 1e4
  }
}

TEST(QuinticSpline, ResponseIsTheFilterAndTheSplineInOne) {
  std::vector<double> samples;
  for (int i = 0; i < 120; ++i) samples.push_back(std::sin(i * i * 0.37) * 100.0);
  std::vector<double> line = samples;
  quintic_prefilter(line);
  for (double u = 40.0; u < 80.0; u += 0.37) {
    const QuinticWeights at = quintic_weights(u);
    const QuinticResponse response = quintic_response(u);
    EXPECT_NEAR(std::accumulate(response.weights.begin(), response.weights.end(), 0.0), 1.0, 1e-9);
    double spline = 0.0;
    for (std::size_t t = 0; t < 6; ++t) {
      spline += at.weights[t] * line[static_cast<std::size_t>(at.first) + t];
    }
    double direct = 0.0;
    for (std::size_t t = 0; t < response.weights.size(); ++t) {
      direct += response.weights[t] * samples[static_cast<std::size_t>(response.first) + t];
    }
    EXPECT_NEAR(direct, spline, 1e-7);  // the response ends at 1e-10 of samples of 100
  }
}

/// Tiles of heights that are a function of the place, sampled at every stored vertex.
template <typename Height>
GridSampler surface_of(const TileGrid& grid, const SampleGrid& samples, RestoreMethod method, Height height,
                       bool wraps_x = false, const ScratchFolder& scratch = {}) {
  const ReadTile read = [grid, height](TileIndex tile) {
    TileCodes codes;
    codes.type = CodeType::kF32;
    for (int r = 0; r < grid.shape().rows(); ++r) {
      for (int c = 0; c < grid.shape().columns(); ++c) {
        const WorldPoint at = grid.world_from_lattice(grid.lattice_vertex(tile, {c, r}));
        codes.heights.push_back(static_cast<float>(height(at.x, at.z)));
      }
    }
    return codes;
  };
  return {grid, wraps_x, {CodeType::kF32, 0.0, 1.0}, read, samples, method, std::nullopt, scratch};
}

TileGrid three_by_two() {
  return TileGrid::make(TileShape::make(20, 19, 4), 3, 2, 16.0, 16.0 * std::sqrt(0.75));
}

TEST(GridSampler, HoldsPlanesWhereverTilesMeet) {
  const TileGrid grid = three_by_two();
  const SampleGrid samples{90, 50, 0.0, 0.0, grid.world_width() / 89, grid.world_height() / 49};
  for (const RestoreMethod method : {RestoreMethod::kBarycentric, RestoreMethod::kHex}) {
    auto plane = [](double x, double z) { return 3.0 * x - 2.0 * z + 100.0; };
    GridSampler rows = surface_of(grid, samples, method, plane);
    std::vector<double> all(90 * 50);
    rows.read(0, 50, all);
    for (std::int64_t r = 0; r < 50; ++r) {
      for (std::int64_t c = 0; c < 90; ++c) {
        const double expected =
            plane(static_cast<double>(c) * samples.spacing_x, static_cast<double>(r) * samples.spacing_z);
        EXPECT_NEAR(all[static_cast<std::size_t>(r * 90 + c)], expected, 1e-4);  // vertices are floats near 250
      }
    }
  }
}

TEST(GridSampler, EndsWithTheSurfaceHoweverManyColumnsThereAre) {
  const TileGrid grid = three_by_two();
  const SampleGrid samples{6000, 1, 0.0, 5.0, grid.world_width() / 4500.0, 1.0};
  for (const RestoreMethod method : {RestoreMethod::kBarycentric, RestoreMethod::kHex}) {
    GridSampler rows = surface_of(grid, samples, method, [](double x, double) { return x; });
    std::vector<double> row(6000);
    rows.read(0, 1, row);
    for (std::size_t c = 0; c < row.size(); ++c) {
      const double x = static_cast<double>(c) * samples.spacing_x;
      ASSERT_EQ(std::isnan(row[c]), c > 4500) << c;
      if (c <= 4500) {
        ASSERT_NEAR(row[c], x, 1e-4);
      }
    }
  }
}

TEST(GridSampler, GoRoundWhereTheWorldDoes) {
  const TileGrid grid = three_by_two();
  const double round = grid.world_width();
  // The same waves, once with the seam in the middle.
  const auto waves = [&](double x, double) { return 1000.0 * std::sin(2.0 * M_PI * x / round + 0.4); };
  const auto shifted = [&](double x, double z) { return waves(x + grid.extent_x(), z); };
  const SampleGrid samples{96, 20, 0.25, 3.0, round / 96.0, 1.0};
  const auto all = [&](const auto& height, bool wraps_x) {
    GridSampler rows = surface_of(grid, samples, RestoreMethod::kHex, height, wraps_x);
    std::vector<double> heights(96 * 20);
    rows.read(0, 20, heights);
    return heights;
  };
  const std::vector<double> a = all(waves, true);
  const std::vector<double> b = all(shifted, true);
  const std::vector<double> open = all(waves, false);
  double bent = 0.0;
  for (std::size_t r = 0; r < 20; ++r) {
    for (std::size_t c = 0; c < 96; ++c) {
      // A row that goes round begins nowhere; vertices are floats.
      EXPECT_NEAR(a[r * 96 + (c + 32) % 96], b[r * 96 + c], 1e-3);
      bent = std::max(bent, std::abs(open[r * 96 + c] - a[r * 96 + c]));
    }
  }
  EXPECT_GT(bent, 0.1) << "ends are no seam: the test would not see one";
}

TEST(GridSampler, GivesTheSameBitsHoweverItIsCutAndWhereverItsRowsAre) {
  const test::TemporaryFolder folder;
  const TileGrid grid = three_by_two();
  const SampleGrid samples{61, 40, 0.3, 0.2, 0.7, 0.6};
  const auto hills = [](double x, double z) {
    return std::hypot(x - 20.0, z - 13.0) < 4.0 ? std::nan("") : std::sin(x * 0.7) * std::cos(z * 0.9) * 100.0;
  };
  for (const RestoreMethod method : {RestoreMethod::kBarycentric, RestoreMethod::kHex}) {
    std::vector<double> whole(61 * 40);
    surface_of(grid, samples, method, hills).read(0, 40, whole);
    for (const std::int64_t step : {1, 3, 17, -1, -4, -40}) {
      const ScratchFolder scratch = step < 0 ? ScratchFolder(folder.path()) : std::nullopt;
      GridSampler rows = surface_of(grid, samples, method, hills, false, scratch);
      for (std::int64_t row = 0; row < 40; row += std::abs(step)) {
        const std::int64_t count = std::min<std::int64_t>(std::abs(step), 40 - row);
        std::vector<double> part(static_cast<std::size_t>(61 * count));
        rows.read(row, count, part);
        EXPECT_EQ(std::memcmp(part.data(), whole.data() + row * 61, part.size() * sizeof(double)), 0) << row;
      }
    }
  }
}

TEST(GridSampler, BothMethodsAreVoidAtTheSamePlacesAndNoVoidLeaks) {
  const TileGrid grid = three_by_two();
  const SampleGrid samples{61, 36, 0.3, 0.2, 0.7, 0.6};
  const auto level = [](double x, double z) { return std::hypot(x - 20.0, z - 13.0) < 5.0 ? std::nan("") : 1000.0; };
  std::vector<double> triangles(61 * 36);
  std::vector<double> spline(61 * 36);
  surface_of(grid, samples, RestoreMethod::kBarycentric, level).read(0, 36, triangles);
  surface_of(grid, samples, RestoreMethod::kHex, level).read(0, 36, spline);
  std::int64_t voids = 0;
  for (std::size_t i = 0; i < spline.size(); ++i) {
    ASSERT_EQ(std::isnan(spline[i]), std::isnan(triangles[i])) << i;
    voids += std::isnan(spline[i]) ? 1 : 0;
    if (std::isnan(spline[i])) continue;
    EXPECT_NEAR(spline[i], 1000.0, 1e-6) << i;
  }
  EXPECT_GT(voids, 10);
}

}  // namespace
}  // namespace isohf
