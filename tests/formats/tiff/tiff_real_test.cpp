#include <gtest/gtest.h>

#include "formats/raster_reference.h"
#include "formats/readers.h"
#include "isohf/raster.h"
#include "support/real_files.h"

namespace isohf {
namespace {

TEST(TiffRealFiles, AreDeliveredAsInTheReference) {
  const auto files = test::real_files({".tif", ".TIF"});
  if (files.empty()) GTEST_SKIP() << test::kNoRealFiles;
  set_module_folder(ISOHF_BIN_DIR);  // one of them lies on ETRS89 by keys
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    const auto source = open_tiff(file.string(), {});
    test::expect_as_reference(*source, test::reference_of(file));
    EXPECT_TRUE(source->info().warnings.empty()) << source->info().warnings.front();
    EXPECT_EQ(source->info().format, "GeoTIFF");
  }
}

TEST(TiffRealFiles, TellTheirBodies) {
  if (test::real_files({".tif"}).empty()) GTEST_SKIP() << test::kNoRealFiles;
  const auto system = [](const std::string& name) {
    return open_tiff((test::real_data() / name).string(), {})->info().georeference.system;
  };
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").body, "Mars");
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").semi_major_axis_m, 3396190.0);
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").inverse_flattening, 0.0);
  EXPECT_EQ(system("derived/mola_4ppd_lon360.tif").body, "Mars");
  EXPECT_EQ(system("derived/mola_4ppd_lon360.tif").name, "GCS_Mars_2000_Sphere");
  EXPECT_EQ(system("N2000000E3000000_noepsg.tif").body, "Earth");
  EXPECT_FALSE(system("N2000000E3000000_noepsg.tif").epsg);
  EXPECT_EQ(system("mt_fuji_90m.tif").body, "Earth");
  EXPECT_EQ(system("N00E010_utm32.tif").name, "UTM Zone 32, Northern Hemisphere");
}

}  // namespace
}  // namespace isohf
