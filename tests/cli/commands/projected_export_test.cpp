/// What isohf export writes of projected archives, placed by GDAL.

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "support/rasters/degree_grid.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

constexpr const char* kMars =
    "GEOGCS[\"GCS_Mars_2000\",DATUM[\"D_Mars_2000\",SPHEROID[\"Mars_2000_IAU_IAG\",3396190,169.894447223612]],"
    "PRIMEM[\"Reference_Meridian\",0],UNIT[\"degree\",0.0174532925199433]]";

double land(double longitude, double latitude) {
  return 5000.0 + 900.0 * (longitude - 10.0) - 700.0 * (latitude - 46.0);
}

TEST(ProjectedRasters, GdalFindsEverySampleWhereItsElevationBelongs) {
  if (run_program({"/bin/sh", "-c", "command -v gdaltransform >/dev/null"}).exit_code != 0) {
    GTEST_SKIP() << "gdal-bin is not here";
  }
  const TemporaryFolder folder;
  for (const char* body : {kWgs84, kMars}) {
    write_degrees(folder / "plane", 80, 80, 8.0, 44.0, 0.05, land, body);  // 8 to 12 East, 44 to 48 North
    for (const std::string kind : {"equirectangular", "local", "transverse-mercator:9.5,0.9996", "utm:32N",
                                   "lambert-conformal", "lambert-conformal:-20,20,9", "polar-stereographic:46"}) {
      if (body == kMars && kind == "utm:32N") continue;  // of the Earth
      const RunResult made = run_isohf(
          {"convert", folder / "plane.flt", folder / "a.isohf", "--overwrite", "--to-crs", kind, "--type", "f32"});
      ASSERT_EQ(made.exit_code, 0) << made.err;
      for (const std::vector<std::string>& way : {std::vector<std::string>{"export"},
                                                  {"export", "--to-crs", "none"},
                                                  {"export", "--bbox", "8.8,44.7,11.1,47.2"},
                                                  {"export", "--to-crs", "none", "--bbox", "8.8,44.7,11.1,47.2"}}) {
        SCOPED_TRACE(kind + (body == kMars ? " Mars " : " Earth ") + testing::PrintToString(way));
        std::vector<std::string> command = way;
        command.insert(command.begin() + 1, {folder / "a.isohf", folder / "a.tif", "--overwrite", "-q"});
        const RunResult written = run_isohf(command);
        ASSERT_EQ(written.exit_code, 0) << written.err;
        const Raster raster = read_raster(folder / "a.tif");
        RunOptions options;
        std::vector<float> elevations;
        for (std::int64_t r = 1; r < raster.info.height; r += 5) {
          for (std::int64_t c = 1; c < raster.info.width; c += 5) {
            options.input += std::to_string(static_cast<double>(c) + 0.5) + " " +
                             std::to_string(static_cast<double>(r) + 0.5) + "\n";
            elevations.push_back(raster.at(c, r));
          }
        }
        // Longitude before latitude, whatever the authority says.
        const RunResult placed =
            run_program({"/bin/sh", "-c",
                         "GDAL_PAM_ENABLED=NO OSR_DEFAULT_AXIS_MAPPING_STRATEGY=TRADITIONAL_GIS_ORDER "
                         "gdaltransform -output_xy -t_srs '" +
                             std::string(body) + "' " + (folder / "a.tif")},
                        options);
        ASSERT_EQ(placed.exit_code, 0) << placed.err;
        std::istringstream places(placed.out);
        int compared = 0;
        for (const float elevation : elevations) {
          double longitude = 0.0;
          double latitude = 0.0;
          ASSERT_TRUE(places >> longitude >> latitude) << placed.out.substr(0, 200) << placed.err;
          if (longitude < 8.3 || longitude > 11.7 || latitude < 44.3 || latitude > 47.7) continue;
          ++compared;
          // A twentieth of a sample, where the plane falls by 45 or 35 m from one to the next.
          ASSERT_NEAR(elevation, land(longitude, latitude), 2.0) << longitude << " " << latitude;
        }
        EXPECT_GT(compared, 60);
      }
    }
  }
}

}  // namespace
}  // namespace isohf::test
