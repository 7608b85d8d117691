#include <gtest/gtest.h>

#include <cmath>

#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/shade.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

class DaySkyTest : public testing::Test {
 protected:
  /// The sky over a place in degrees.
  DaySky over(double longitude, double latitude, const std::string& body = "Earth") {
    test::MemorySource<float> source(SampleType::kFloat32, 20, 20, [](auto, auto) { return 1.0; });
    SourceInfo& info = source.mutable_info();
    info.georeference.unit = HorizontalUnit::kDegree;
    info.georeference.spacing_x = info.georeference.spacing_y = 0.001;
    info.georeference.has_origin = !std::isnan(longitude);
    info.georeference.origin_x = longitude - 0.0095;
    info.georeference.origin_y = latitude + 0.0095;
    info.georeference.system.body = body;
    ConvertOptions options;
    options.overwrite = true;
    (void)convert(source, folder_ / "a.isohf", options);
    return DaySky(ArchiveReader(folder_ / "a.isohf"));
  }
  test::TemporaryFolder folder_;
};

TEST_F(DaySkyTest, KnowsTheSolstices) {
  const DaySky greenwich = over(0.0, 51.4779);
  EXPECT_NEAR(greenwich.sun({2026, 6, 21, 12.03}).elevation_deg, 90.0 - 51.4779 + 23.436, 0.02);
  EXPECT_NEAR(greenwich.sun({2026, 12, 21, 11.97}).elevation_deg, 90.0 - 51.4779 - 23.436, 0.02);
  // The equinox was on 20 March 2026 at 14:46: in the West, an hour's sixth from where it would stand.
  const SunPlace spring = over(0.0, 0.0).sun({2026, 3, 20, 14.77});
  EXPECT_NEAR(spring.azimuth_deg, 270.0, 0.02);
  EXPECT_NEAR(spring.elevation_deg, 90.0 - (2.77 * 15.0 - 7.4 / 60.0 * 15.0), 0.1);
}

// 16 minutes early in November, 14 late in February.
TEST_F(DaySkyTest, KnowsTheEquationOfTime) {
  const DaySky alps = over(7.0, 46.0);
  EXPECT_NEAR(alps.sun({2026, 11, 3, 12.0 - 16.4 / 60.0}).azimuth_deg, 180.0, 0.1);
  EXPECT_NEAR(alps.sun({2026, 2, 11, 12.0 + 14.2 / 60.0}).azimuth_deg, 180.0, 0.1);
  EXPECT_NEAR(alps.place().latitude, 46.0, 0.001);
  EXPECT_GT(alps.sun({2026, 6, 21, 18.0}).azimuth_deg, 270.0);
  EXPECT_LT(alps.sun({2026, 6, 21, 0.0}).elevation_deg, 0.0);
}

// Allison and McEwen's example: 6 January 2000, solar longitude 277.19 degrees, the sun 5.19 degrees behind.
TEST_F(DaySkyTest, KnowsMars) {
  const SunPlace noon = over(0.0, 10.0, "Mars").sun({2000, 1, 6, 12.0 + 5.19 / 15.0});
  EXPECT_NEAR(noon.azimuth_deg, 180.0, 0.5);
  EXPECT_NEAR(noon.elevation_deg, 80.0 - 25.2, 0.1);
}

TEST_F(DaySkyTest, RefusesWhereNothingIsKnown) {
  EXPECT_THROW(over(0.0, 10.0, "Moon"), Error);
  EXPECT_THROW(over(0.0, 10.0, ""), Error);
  EXPECT_THROW(over(std::nan(""), 10.0), Error);
}

}  // namespace
}  // namespace isohf
