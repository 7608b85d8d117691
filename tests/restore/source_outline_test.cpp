#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

constexpr std::int64_t kWide = 90;
constexpr std::int64_t kHigh = 70;
constexpr double kStep = 1.0 / 60.0;

/// Areas of ground at 9 degrees East and 47 North.
struct DegreeSource : test::MemorySource<std::int16_t> {
  DegreeSource()
      : MemorySource(SampleType::kInt16, kWide, kHigh,
                     [](std::int64_t c, std::int64_t r) { return static_cast<double>(500 + 3 * c - 2 * r); }) {
    Georeference& georeference = mutable_info().georeference;
    georeference.registration = Registration::kArea;
    georeference.unit = HorizontalUnit::kDegree;
    georeference.has_origin = true;
    georeference.origin_x = 9.0 + kStep / 2.0;
    georeference.origin_y = 47.0 - kStep / 2.0;
    georeference.spacing_x = georeference.spacing_y = kStep;
  }
};

/// A projected source ends within the tiles. What is made of the archive ends where it does, not a pixel or two beyond.
TEST(SourceOutline, SamplesOutsideAProjectedSourceAreVoidAndThoseInsideAreNot) {
  const test::TemporaryFolder folder;
  for (const char* const projection : {"local", "utm", "lambert-conformal"}) {
    DegreeSource source;
    ConvertOptions options;
    options.plan.ground.projection = ProjectionRequest::parse(projection);
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
    const ArchiveReader archive(folder / "a.isohf");
    const WorldGeoreference georeference(archive.metadata());
    const TileGrid& tiles = archive.grid();
    SampleGrid grid;
    grid.width = 211;
    grid.height = 173;
    grid.spacing_x = tiles.world_width() / static_cast<double>(grid.width - 1);
    grid.spacing_z = tiles.world_height() / static_cast<double>(grid.height - 1);
    std::int64_t beyond = 0;
    for (const RestoreMethod method : {RestoreMethod::kHex, RestoreMethod::kBarycentric}) {
      RowReader rows(archive, grid, method);
      std::vector<double> elevations(static_cast<std::size_t>(grid.width * grid.height));
      rows.read(0, grid.height, elevations);
      for (std::size_t i = 0; i < elevations.size(); ++i) {
        const auto sample = static_cast<std::int64_t>(i);
        const GeoPoint at = georeference.geo_from_world({static_cast<double>(sample % grid.width) * grid.spacing_x,
                                                         static_cast<double>(sample / grid.width) * grid.spacing_z});
        const double u = (at.longitude - 9.0) / kStep;  // from the source's edge
        const double v = (47.0 - at.latitude) / kStep;
        const double inside = std::min({u, v, kWide - u, kHigh - v});
        if (std::abs(inside) > 0.02) {
          EXPECT_EQ(std::isnan(elevations[i]), inside < 0.0) << projection << " at " << u << " " << v;
        }
        beyond += inside < -0.02 ? 1 : 0;
      }
    }
    EXPECT_GT(beyond, 100);
  }
}

/// Georeferences are rounded: what lies a hundredth of a sample beyond the end counts as on it.
TEST(SourceOutline, SamplesOnARoundedEdgeAreNotVoid) {
  const test::TemporaryFolder folder;
  DegreeSource source;
  source.mutable_info().georeference.unit = HorizontalUnit::kMetre;
  source.mutable_info().georeference.registration = Registration::kPoint;
  ConvertOptions options;
  (void)convert(source, folder / "a.isohf", options);
  const ArchiveReader archive(folder / "a.isohf");
  for (const double off : {-0.008, 0.008, -0.02}) {
    SampleGrid grid = source_grid(archive.metadata().source);
    grid.first_x += off * grid.spacing_x;
    grid.first_z += off * grid.spacing_z;
    for (const RestoreMethod method : {RestoreMethod::kHex, RestoreMethod::kBarycentric}) {
      RowReader rows(archive, grid, method);
      std::vector<double> elevations(static_cast<std::size_t>(kWide * kHigh));
      rows.read(0, kHigh, elevations);
      const auto voids = std::count_if(elevations.begin(), elevations.end(), [](double e) { return std::isnan(e); });
      EXPECT_EQ(voids, std::abs(off) < 0.01 ? 0 : kWide + kHigh - 1) << off;
    }
  }
}

}  // namespace
}  // namespace isohf
