#include "isohf/restore/point_sampler.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/light/normals.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Hills with a hole, 300 x 200 samples in tiles of 20 x 19.
class PointSamplerTest : public testing::TestWithParam<CodeType> {
 protected:
  PointSamplerTest() {
    test::MemorySource<float> source(SampleType::kFloat32, 300, 200, [](std::int64_t c, std::int64_t r) {
      if (c > 90 && c < 140 && r > 60 && r < 90) return std::nan("");
      return 500.0 + 40.0 * std::sin(static_cast<double>(c) * 0.3) * std::cos(static_cast<double>(r) * 0.2);
    });
    ConvertOptions options;
    options.code_type = GetParam();
    options.plan.shape = {20, 19};
    options.plan.levels = 1;
    (void)convert(source, folder / "a.isohf", options);
  }

  static std::vector<WorldPoint> places() {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> x_of(-10.0, 320.0);
    std::uniform_real_distribution<double> z_of(-10.0, 220.0);
    std::vector<WorldPoint> all = {{0.0, 0.0}, {std::nan(""), 5.0}, {5.0, HUGE_VAL}, {299.0, 199.0}};
    for (int i = 0; i < 3000; ++i) all.push_back({x_of(random), z_of(random)});
    return all;
  }

  test::TemporaryFolder folder;
};

Job with_memory(std::uint64_t bytes) {
  Job job;
  job.memory_bytes = bytes;
  return job;
}

/// One place from the whole tile's elevations: the definition.
SurfaceSample one(const ArchiveReader& archive, WorldPoint place) {
  SurfaceSample sample;
  const TileGrid& grid = archive.grid();
  if (!grid.contains(place)) return sample;
  const TilePoint at = grid.locate(place);
  sample.tile = at.tile;
  const std::vector<double> elevations = archive.read_elevations(at.tile);
  const Barycentric where = barycentric(grid.shape(), at.point);
  sample.elevation =
      interpolate(where, View2D<const double>(elevations.data(), grid.shape().columns(), grid.shape().rows()));
  sample.state = std::isnan(sample.elevation) ? SurfaceState::kNodata : SurfaceState::kSurface;
  if (sample.state == SurfaceState::kNodata) return sample;
  std::vector<float> relative;
  double datum = std::nan("");
  for (const double elevation : elevations) {
    if (std::isnan(datum)) datum = elevation;
  }
  for (const double elevation : elevations) relative.push_back(static_cast<float>(elevation - datum));
  const View2D<const float> heights(relative.data(), grid.shape().columns(), grid.shape().rows());
  double sum[3] = {};
  for (std::size_t i = 0; i < 3; ++i) {
    if (where.weights[i] <= 0.0) continue;
    const Normal normal = vertex_normal(grid, heights, where.vertices[i]);
    sum[0] += where.weights[i] * double{normal.x};
    sum[1] += where.weights[i] * double{normal.y};
    sum[2] += where.weights[i] * double{normal.z};
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  for (std::size_t i = 0; i < 3; ++i) sample.normal[i] = sum[i] / length + 0.0;
  return sample;
}

void expect_same(const SurfaceSample& found, const SurfaceSample& wanted) {
  ASSERT_EQ(found.state, wanted.state);
  EXPECT_EQ(found.tile, wanted.tile);
  if (wanted.state != SurfaceState::kSurface) return;
  EXPECT_EQ(found.elevation, wanted.elevation);
  EXPECT_EQ(found.normal, wanted.normal);
}

TEST_P(PointSamplerTest, FindsWhatTheWholeTileHasAtAnyPlaceInAnyOrder) {
  const ArchiveReader archive(folder / "a.isohf");
  const std::vector<WorldPoint> all = places();
  std::vector<SurfaceSample> found(all.size());
  std::vector<double> elevations(all.size());
  Surface surface(archive, with_memory(1U << 20U));
  surface.sample(all, std::span(found));
  surface.sample(all, std::span(elevations));
  EXPECT_THROW(surface.sample(all, std::span(found).first(1)), Error);
  EXPECT_THROW(surface.sample(all, std::span(elevations).first(1)), Error);
  std::vector<SunSample> lit(1);
  EXPECT_THROW(surface.sample(all, Sun{}, 0.0, lit), Error);
  int states[3] = {};
  for (std::size_t i = 0; i < all.size(); ++i) {
    SCOPED_TRACE(testing::Message() << all[i].x << " " << all[i].z);
    expect_same(found[i], one(archive, all[i]));
    if (i % 100 == 0) expect_same(surface.at(all[i]), found[i]);
    EXPECT_EQ(std::isnan(elevations[i]), found[i].state != SurfaceState::kSurface);
    if (found[i].state == SurfaceState::kSurface) {
      EXPECT_EQ(elevations[i], found[i].elevation);
    }
    ++states[static_cast<int>(found[i].state)];
  }
  for (const int count : states) EXPECT_GT(count, 10) << "surface, void and outside are all there";
}

TEST_P(PointSamplerTest, AnswersDependNeitherOnBatchesNorOnMemoryNorOnThreadsUntilTheJobIsCancelled) {
  const ArchiveReader archive(folder / "a.isohf");
  const std::vector<WorldPoint> all = places();
  std::vector<SurfaceSample> together(all.size());
  Surface(archive, with_memory(1U << 20U)).sample(all, std::span(together));
  for (const int threads : {0, 1, 2, 7}) {
    std::atomic<bool> cancel = false;
    Job job = with_memory(1);  // keeps one tile
    job.threads = threads;
    job.cancel = &cancel;
    Surface surface(archive, job);
    for (std::size_t first = 0, size = 1; first < all.size(); first += size, size = size * 3 + 1) {
      const std::size_t count = std::min(size, all.size() - first);
      std::vector<SurfaceSample> found(count);
      surface.sample(std::span(all).subspan(first, count), std::span(found));
      for (std::size_t i = 0; i < count; ++i) expect_same(found[i], together[first + i]);
    }
    cancel = true;
    std::vector<double> elevations(all.size());
    EXPECT_THROW(surface.sample(all, std::span(elevations)), Error);
  }
}

INSTANTIATE_TEST_SUITE_P(Types, PointSamplerTest, testing::Values(CodeType::kU16, CodeType::kU8, CodeType::kF32),
                         [](const auto& tested) { return to_string(tested.param); });

/// Every visible vertex at its own place, as products and quotients give it, beside voids or not.
TEST_P(PointSamplerTest, FindsAVertexAtItsOwnPlaceBesideVoids) {
  const ArchiveReader archive(folder / "a.isohf");
  const TileGrid& grid = archive.grid();
  Surface surface(archive);
  int beside_voids = 0;
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    const TileIndex tile = grid.tile_at(flat);
    const std::vector<double> stored = archive.read_elevations(tile);
    std::vector<WorldPoint> places;
    std::vector<double> wanted;
    for (int r = 0; r < grid.shape().rows(); ++r) {
      for (int c = 0; c < grid.shape().columns(); ++c) {
        if (!is_visible(grid.shape(), {c, r})) continue;
        const WorldPoint at = grid.world_from_lattice(grid.lattice_vertex(tile, {c, r}));
        // As coordinates of a map with its origin far away bring it back.
        places.push_back({std::clamp((at.x + 654321.7) - 654321.7, 0.0, grid.world_width()),
                          std::clamp((at.z + 4654321.3) - 4654321.3, 0.0, grid.world_height())});
        wanted.push_back(stored[static_cast<std::size_t>(r * grid.shape().columns() + c)]);
      }
    }
    std::vector<double> found(places.size());
    std::vector<SurfaceSample> samples(places.size());
    surface.sample(places, found);
    surface.sample(places, samples);
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_EQ(std::isnan(found[i]), std::isnan(wanted[i])) << places[i].x << "," << places[i].z;
      ASSERT_EQ(samples[i].state == SurfaceState::kNodata, std::isnan(wanted[i]));
      if (std::isnan(wanted[i])) continue;
      ASSERT_NEAR(found[i], wanted[i], 1e-6);  // 1e-9 of a step down slopes of 20 a step, and sums of the three
      ASSERT_NEAR(samples[i].elevation, wanted[i], 1e-6);
      beside_voids += places[i].x > 85.0 && places[i].x < 145.0 && places[i].z > 55.0 && places[i].z < 95.0 ? 1 : 0;
    }
  }
  EXPECT_GT(beside_voids, 100);
}

/// A grid of samples that are vertices of even rows' neighbours: the same by both methods.
TEST_P(PointSamplerTest, RestoresSamplesThatAreVerticesBesideVoids) {
  const ArchiveReader archive(folder / "a.isohf");
  const TileGrid& grid = archive.grid();
  // Of the source's ground, where rows of samples end.
  const WorldBounds& ground = archive.metadata().valid;
  const auto across = static_cast<std::int64_t>(ground.x1 / (2.0 * grid.sigma_x()));
  const auto down = static_cast<std::int64_t>(ground.z1 / (2.0 * grid.sigma_z()));
  // Odd rows of vertices, by spacings that are no sums of powers of two.
  const SampleGrid samples{across, down, 1e-13, 1e-13, 2.0 * grid.sigma_x(), 2.0 * grid.sigma_z()};
  std::vector<double> exact(static_cast<std::size_t>(across * down));
  std::vector<WorldPoint> places;
  for (std::int64_t r = 0; r < down; ++r) {
    for (std::int64_t c = 0; c < across; ++c) places.push_back(grid.world_from_lattice({2 * c, 2 * r}));
  }
  Surface(archive).sample(places, exact);
  for (const RestoreMethod method : {RestoreMethod::kBarycentric, RestoreMethod::kHex}) {
    std::vector<double> found(exact.size());
    RowReader(archive, samples, method).read(0, down, found);
    std::int64_t voids = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(std::isnan(found[i]), std::isnan(exact[i])) << to_string(method) << " " << i;
      voids += std::isnan(found[i]) ? 1 : 0;
    }
    EXPECT_GT(voids, 20);
  }
}

}  // namespace
}  // namespace isohf
