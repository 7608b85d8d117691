#include "isohf/restore/geo_rows.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <vector>

#include "isohf/archive.h"
#include "isohf/base/view.h"
#include "isohf/convert/convert.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "support/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Hills over 5 to 9 East and 44 to 47 North, on a map.
class GeoRowsTest : public testing::Test {
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
    options.plan.ground.projection = {false, kind, {}, 0};
    options.overwrite = true;
    const std::atomic<bool> cancel = false;
    (void)convert(source, folder / "a.isohf", options, {}, cancel);
  }

  /// Reads the grid in calls of so many rows on so many threads.
  static std::vector<double> read(const ArchiveReader& archive, const GeoGrid& grid, std::int64_t rows_at_once,
                                  int threads) {
    std::vector<double> elevations(static_cast<std::size_t>(grid.width * grid.height));
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] {
      GeoRows rows(
          archive.metadata(), [&](TileIndex tile) { return archive.read_tile(tile); }, grid);
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

TEST_F(GeoRowsTest, FindsWhatTheTriangleAtEveryPlaceHas) {
  for (const ProjectionKind kind : {ProjectionKind::kLocal, ProjectionKind::kTransverseMercator, ProjectionKind::kUtm,
                                    ProjectionKind::kLambertConformal}) {
    SCOPED_TRACE(to_string(kind));
    convert_to(kind);
    const ArchiveReader archive(folder / "a.isohf");
    const TileGrid& tiles = archive.grid();
    const GeoPlaces places(archive.metadata());
    // Larger than the ground on all sides.
    const GeoGrid grid{67, 59, {4.71, 47.23}, 0.0731, 0.0617};
    const std::vector<double> found = read(archive, grid, 7, 2);
    int surface = 0;
    for (std::int64_t row = 0; row < grid.height; ++row) {
      for (std::int64_t column = 0; column < grid.width; ++column) {
        const WorldPoint world = places.world_from_geo(
            {4.71 + static_cast<double>(column) * 0.0731, 47.23 - static_cast<double>(row) * 0.0617});
        double expected = std::nan("");
        if (tiles.contains(world)) {
          const TilePoint at = tiles.locate(world);
          const std::vector<double> heights =
              elevations_of(archive.read_tile(at.tile), archive.metadata().quantisation);
          expected = interpolate(barycentric(tiles.shape(), at.point),
                                 View2D<const double>(heights.data(), tiles.shape().columns(), tiles.shape().rows()));
        }
        const double here = found[static_cast<std::size_t>(row * grid.width + column)];
        ASSERT_EQ(std::isnan(here), std::isnan(expected)) << column << " " << row;
        if (std::isnan(expected)) continue;
        ++surface;
        ASSERT_EQ(here, expected) << column << " " << row;
      }
    }
    EXPECT_GT(surface, 2000);
    EXPECT_LT(surface, 67 * 59);
  }
}

TEST_F(GeoRowsTest, BitsDoNotDependOnThreadsOrOnHowRowsAreCut) {
  convert_to(ProjectionKind::kLambertConformal);
  const ArchiveReader archive(folder / "a.isohf");
  const GeoGrid grid{131, 97, {4.9, 47.1}, 0.033, 0.035};
  const std::vector<double> whole = read(archive, grid, 97, 1);
  for (const std::int64_t rows : {1, 5, 96}) {
    const std::vector<double> cut = read(archive, grid, rows, 4);
    EXPECT_EQ(std::memcmp(cut.data(), whole.data(), whole.size() * sizeof(double)), 0) << rows;
  }
}

TEST_F(GeoRowsTest, RefusesGridsWithoutSamplesAndArchivesWithoutAPlace) {
  convert_to(ProjectionKind::kUtm);
  {
    const ArchiveReader archive(folder / "a.isohf");
    const auto read_tile = [&](TileIndex tile) { return archive.read_tile(tile); };
    EXPECT_THROW(GeoRows(archive.metadata(), read_tile, {0, 5, {5.0, 46.0}, 0.1, 0.1}), Error);
    EXPECT_THROW(GeoRows(archive.metadata(), read_tile, {5, 5, {5.0, 46.0}, 0.1, 0.0}), Error);
    EXPECT_THROW(GeoRows(archive.metadata(), read_tile, {5, 5, {5.0, 46.0}, std::nan(""), 0.1}), Error);
  }
  convert_to(ProjectionKind::kEquirectangular, false);
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_THROW(GeoRows(archive.metadata(), [&](TileIndex tile) { return archive.read_tile(tile); },
                       {5, 5, {5.0, 46.0}, 0.1, 0.1}),
               Error);
}

}  // namespace
}  // namespace isohf
