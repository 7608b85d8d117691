#include "isohf/restore/ground_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(GroundScale, IsKnownForElevationsWhereTheWorldHasMetresOrDegrees) {
  Metadata metadata(TileGrid::make(TileShape::make(12, 11, 3), 1, 1, 1.0, 1.0));
  metadata.horizontal_unit = "metre";
  metadata.vertical_unit = "ft";
  EXPECT_EQ(ground_scale(metadata).elevation, 0.3048);
  metadata.horizontal_unit = "unknown";
  EXPECT_EQ(ground_scale(metadata).elevation, 1.0);
  metadata.source.crs_unit = "degree";
  EXPECT_EQ(ground_scale(metadata).elevation, 0.3048);
  metadata.vertical_unit = "unknown";
  EXPECT_EQ(ground_scale(metadata).elevation, 1.0);
}

/// One terrain, 10 m between samples, in units of its own.
struct Units {
  std::string vertical;
  double metres = 1.0;   ///< in one vertical unit
  bool degrees = false;  ///< the world is laid out in them
};

class UnitsOfGround : public testing::Test {
 protected:
  static constexpr double kDegree_m = 111319.49079327358;  ///< at the equator of WGS 84

  std::string archive_in(const Units& units) {
    test::MemorySource<double> source(SampleType::kFloat64, 60, 48, [&](std::int64_t c, std::int64_t r) {
      const double step = c > 25 ? 60.0 : 0.0;
      return (step + 40.0 * std::sin(static_cast<double>(c) * 0.9) * std::cos(static_cast<double>(r) * 0.7)) /
             units.metres;
    });
    SourceInfo& info = source.mutable_info();
    info.vertical_unit = units.vertical;
    info.metres_per_vertical_unit = units.metres;
    Georeference& place = info.georeference;
    place.registration = Registration::kArea;
    place.unit = units.degrees ? HorizontalUnit::kDegree : HorizontalUnit::kMetre;
    place.spacing_x = place.spacing_y = units.degrees ? 10.0 / kDegree_m : 10.0;
    place.has_origin = true;
    place.origin_x = place.spacing_x * 0.5;
    place.origin_y = place.spacing_y * 23.5;  // the equator in the middle
    if (units.degrees) place.system.semi_major_axis_m = 6378137.0;
    ConvertOptions options;
    options.code_type = CodeType::kF32;
    options.plan.shape = {20, 19};
    options.plan.levels = 1;
    options.filter = Filter::kBilinear;  // continuous: degrees are rounded
    options.plan.ground.projection.is_auto = false;
    options.plan.ground.projection.kind = ProjectionKind::kNone;
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
    return folder / "a.isohf";
  }

  test::TemporaryFolder folder;
};

TEST_F(UnitsOfGround, LeaveNormalsAndShadowsAsTheyAre) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x_of(0.0, 590.0);
  std::uniform_real_distribution<double> z_of(0.0, 470.0);
  std::vector<WorldPoint> places;
  for (int i = 0; i < 2000; ++i) places.push_back({x_of(random), z_of(random)});
  std::vector<SurfaceSample> wanted;
  std::vector<SunSample> wanted_suns;
  for (const Units& units : {Units{"metre"}, Units{"foot", 0.3048}, Units{"US survey foot", 1200.0 / 3937.0},
                             Units{"kilometre", 1000.0}, Units{"metre", 1.0, true}, Units{"foot", 0.3048, true}}) {
    SCOPED_TRACE(units.vertical + (units.degrees ? " over degrees" : " over metres"));
    const ArchiveReader archive(archive_in(units));
    Surface surface(archive);
    std::vector<WorldPoint> points = places;
    if (units.degrees) {
      for (WorldPoint& point : points) point = {point.x / kDegree_m, point.z / kDegree_m};
    }
    std::vector<SurfaceSample> found(points.size());
    std::vector<SunSample> suns(points.size());
    surface.sample(points, found);
    surface.sample(points, Sun{300.0, 25.0, {}}, 0.0, suns);
    if (wanted.empty()) {
      wanted = found;
      wanted_suns = suns;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(found[i].state, wanted[i].state) << i;
      // Codes are floats of 24 bits, of up to 330 units: 1e-5 m in heights that are 5 m apart.
      EXPECT_NEAR(found[i].elevation * units.metres, wanted[i].elevation, 1e-4) << i;
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(found[i].normal[k], wanted[i].normal[k], 1e-4) << i;
      EXPECT_NEAR(suns[i].shadow_height * units.metres, wanted_suns[i].shadow_height, 1e-3) << i;
      EXPECT_NEAR(suns[i].share, wanted_suns[i].share, 1e-2) << i;
    }
  }
}

}  // namespace
}  // namespace isohf
