#include "isohf/surface.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "isohf/archive.h"
#include "isohf/base/view.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Hills over 5 to 9 East and 44 to 47 North, on a map.
class SurfaceInDegrees : public testing::Test {
 protected:
  void convert_to(ProjectionKind kind, bool placed = true) {
    test::MemorySource<float> source(SampleType::kFloat32, 80, 60, [](std::int64_t c, std::int64_t r) {
      if (c > 30 && c < 36 && r > 20 && r < 25) return std::nan("");
      return 500.0 + 40.0 * std::sin(static_cast<double>(c) * 0.3) * std::cos(static_cast<double>(r) * 0.2);
    });
    Georeference& place = source.mutable_info().georeference;
    place.registration = Registration::kArea;
    place.unit = HorizontalUnit::kDegree;
    place.spacing_x = place.spacing_y = 0.05;
    place.has_origin = placed;
    place.origin_x = 5.025;
    place.origin_y = 46.975;
    ConvertOptions options;
    options.code_type = CodeType::kF32;
    options.plan.shape = {20, 19};
    options.plan.levels = 1;
    options.plan.ground.projection.is_auto = false;
    options.plan.ground.projection.kind = kind;
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
  }

  /// Rows end where the source does, to a hundredth of a sample, and not with the tiles.
  static bool is_in_source(GeoPoint at) {
    constexpr double kBeyond = 0.01 * 0.05;
    return at.longitude > 5.0 - kBeyond && at.longitude < 9.0 + kBeyond && at.latitude > 44.0 - kBeyond &&
           at.latitude < 47.0 + kBeyond;
  }

  /// Reads the grid in calls of so many rows on so many threads.
  static std::vector<double> read(const ArchiveReader& archive, const SampleGrid& grid, std::int64_t rows_at_once,
                                  int threads) {
    std::vector<double> elevations(static_cast<std::size_t>(grid.width * grid.height));
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] {
      RowReader rows(archive, grid);
      for (std::int64_t row = 0; row < grid.height; row += rows_at_once) {
        const std::int64_t count = std::min(rows_at_once, grid.height - row);
        rows.read(
            row, count,
            std::span(elevations)
                .subspan(static_cast<std::size_t>(row * grid.width), static_cast<std::size_t>(count * grid.width)));
      }
    });
    return elevations;
  }

  test::TemporaryFolder folder;
};

TEST_F(SurfaceInDegrees, FindsWhatTheTriangleAtEveryPlaceHas) {
  for (const ProjectionKind kind : {ProjectionKind::kLocal, ProjectionKind::kTransverseMercator, ProjectionKind::kUtm,
                                    ProjectionKind::kLambertConformal}) {
    SCOPED_TRACE(to_string(kind));
    convert_to(kind);
    const ArchiveReader archive(folder / "a.isohf");
    const TileGrid& tiles = archive.grid();
    Surface surface(archive);
    // Larger than the ground on all sides.
    const SampleGrid grid{67, 59, 4.71, 47.23, 0.0731, 0.0617, true};
    const std::vector<double> found = read(archive, grid, 7, 2);
    int found_there = 0;
    for (std::int64_t row = 0; row < grid.height; ++row) {
      for (std::int64_t column = 0; column < grid.width; ++column) {
        const GeoPoint geo{4.71 + static_cast<double>(column) * 0.0731, 47.23 - static_cast<double>(row) * 0.0617};
        const WorldPoint world = surface.georeference().world_from_geo(geo);
        double expected = std::nan("");
        if (tiles.contains(world) && is_in_source(geo)) {
          const TilePoint at = tiles.locate(world);
          const std::vector<double> heights = archive.read_elevations(at.tile);
          expected = interpolate(barycentric(tiles.shape(), at.point),
                                 View2D<const double>(heights.data(), tiles.shape().columns(), tiles.shape().rows()));
        }
        const double here = found[static_cast<std::size_t>(row * grid.width + column)];
        ASSERT_EQ(std::isnan(here), std::isnan(expected)) << column << " " << row;
        if (std::isnan(expected)) continue;
        ++found_there;
        ASSERT_EQ(here, expected) << column << " " << row;
        if (column % 20 == 0) {
          ASSERT_EQ(surface.at(geo).elevation, expected);
        }
      }
    }
    EXPECT_GT(found_there, 2000);
    EXPECT_LT(found_there, 67 * 59);
  }
}

TEST_F(SurfaceInDegrees, BitsDoNotDependOnThreadsOrOnHowRowsAreCut) {
  convert_to(ProjectionKind::kLambertConformal);
  const ArchiveReader archive(folder / "a.isohf");
  const SampleGrid grid{131, 97, 4.9, 47.1, 0.033, 0.035, true};
  const std::vector<double> whole = read(archive, grid, 97, 1);
  for (const std::int64_t rows : {1, 5, 96}) {
    const std::vector<double> cut = read(archive, grid, rows, 4);
    EXPECT_EQ(std::memcmp(cut.data(), whole.data(), whole.size() * sizeof(double)), 0) << rows;
  }
}

TEST_F(SurfaceInDegrees, NoRowsAreReadFromMemoryAndFromAScratchFile) {
  convert_to(ProjectionKind::kEquirectangular);
  const ArchiveReader archive(folder / "a.isohf");
  const SampleGrid grid{4000, 40, 0.0, 0.0, 50.0, 50.0};
  RowReader(archive, grid).read(0, 0, {});
  // The least memory that it works in leaves rows to the file.
  Job job;
  job.threads = 1;
  job.scratch_folder = folder.path();
  std::optional<RowReader> rows;
  for (job.memory_bytes = 1U << 18U; !rows; job.memory_bytes += 1U << 16U) {
    try {
      rows.emplace(archive, grid, RestoreMethod::kBarycentric, job);
    } catch (const Error& error) {
      ASSERT_EQ(error.code(), ErrorCode::kOutOfMemory);
    }
  }
  rows->read(3, 0, {});
}

TEST_F(SurfaceInDegrees, RefusesGridsWithoutSamplesAndArchivesWithoutAnOrigin) {
  convert_to(ProjectionKind::kUtm);
  {
    const ArchiveReader archive(folder / "a.isohf");
    EXPECT_THROW(RowReader(archive, {0, 5, 5.0, 46.0, 0.1, 0.1, true}), Error);
    EXPECT_THROW(RowReader(archive, {5, 5, 5.0, 46.0, 0.1, 0.0, true}), Error);
    EXPECT_THROW(RowReader(archive, {5, 5, 5.0, 46.0, std::nan(""), 0.1, true}), Error);
    EXPECT_THROW(RowReader(archive, {5, 5, 1e9, 0.0, 1.0, 1.0}), Error) << "far beyond the surface";
  }
  convert_to(ProjectionKind::kEquirectangular, false);
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_THROW(RowReader(archive, {5, 5, 5.0, 46.0, 0.1, 0.1, true}), Error);
  EXPECT_THROW((void)Surface(archive).at(GeoPoint{7.0, 46.0}), Error);
  EXPECT_THROW((void)Surface(archive).at(MapPoint{7.0, 46.0}), Error);
}

TEST_F(SurfaceInDegrees, FindsTheSameByDegreesAndByTheSourcesCoordinates) {
  convert_to(ProjectionKind::kLambertConformal);
  const ArchiveReader archive(folder / "a.isohf");
  Surface surface(archive);
  const SurfaceSample by_geo = surface.at(GeoPoint{7.3, 45.1});
  ASSERT_EQ(by_geo.state, SurfaceState::kSurface);
  EXPECT_EQ(surface.at(MapPoint{7.3, 45.1}).elevation, by_geo.elevation) << "the source is in degrees";
  EXPECT_EQ(surface.at(MapPoint{7.3 + 360.0, 45.1}).tile, by_geo.tile);
  const WorldPoint world = surface.georeference().world_from_geo({7.3, 45.1});
  EXPECT_EQ(surface.at(world).elevation, by_geo.elevation);
  const GeoPoint back = surface.georeference().geo_from_world(world);
  EXPECT_NEAR(back.longitude, 7.3, 1e-9);
  EXPECT_NEAR(back.latitude, 45.1, 1e-9);
}

TEST_F(SurfaceInDegrees, RowsStopWhereTheJobIsCancelled) {
  convert_to(ProjectionKind::kUtm);
  const ArchiveReader archive(folder / "a.isohf");
  const std::atomic<bool> cancel = true;
  Job job;
  job.cancel = &cancel;
  RowReader rows(archive, natural_grid(archive.metadata()));
  const auto read = [&] { rows.read_all([](std::int64_t, std::span<const double>) {}, job); };
  EXPECT_EQ(test::error_of(read).code(), ErrorCode::kCancelled);
}

TEST_F(SurfaceInDegrees, RowsOfAWorldGridAreTheTriangles) {
  convert_to(ProjectionKind::kUtm);
  const ArchiveReader archive(folder / "a.isohf");
  Surface surface(archive);
  const SampleGrid grid = grid_over(archive.metadata().valid, true, GridSize{40, 30}, {});
  RowReader rows(archive, grid, RestoreMethod::kBarycentric);
  std::int64_t rows_seen = 0;
  Job job;
  job.threads = 2;
  job.progress = [&](const Progress& at) { rows_seen = at.done; };
  rows.read_all(
      [&](std::int64_t first, std::span<const double> elevations) {
        for (std::size_t i = 0; i < elevations.size(); ++i) {
          const auto column = static_cast<double>(i % 40);
          const auto row = static_cast<double>(first + static_cast<std::int64_t>(i) / 40);
          const WorldPoint at{grid.first_x + column * grid.spacing_x, grid.first_z + row * grid.spacing_z};
          const SurfaceSample here = surface.at(at);
          const bool is_there =
              here.state == SurfaceState::kSurface && is_in_source(surface.georeference().geo_from_world(at));
          ASSERT_EQ(std::isnan(elevations[i]), !is_there);
          if (is_there) {
            ASSERT_NEAR(elevations[i], here.elevation, 1e-9);
          }
        }
      },
      job);
  EXPECT_EQ(rows_seen, 30);
  const std::optional<Georeference> where = grid_georeference(archive.metadata(), grid);
  ASSERT_TRUE(where.has_value());
  EXPECT_EQ(where->unit, HorizontalUnit::kMetre);
  EXPECT_EQ(where->system.epsg, std::nullopt) << "UTM of an unnamed system in degrees has no code";
}

}  // namespace
}  // namespace isohf
