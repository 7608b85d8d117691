/// What isohf export writes of projected archives, placed by GDAL.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

constexpr const char* kEarth =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
    "UNIT[\"degree\",0.0174532925199433]]";
constexpr const char* kMars =
    "GEOGCS[\"GCS_Mars_2000\",DATUM[\"D_Mars_2000\",SPHEROID[\"Mars_2000_IAU_IAG\",3396190,169.894447223612]],"
    "PRIMEM[\"Reference_Meridian\",0],UNIT[\"degree\",0.0174532925199433]]";

double land(double longitude, double latitude) {
  return 5000.0 + 900.0 * (longitude - 10.0) - 700.0 * (latitude - 46.0);
}

/// A plane over 8 to 12 East and 44 to 48 North, as GridFloat in a reference system.
void write_plane(const std::string& stem, const char* system) {
  constexpr int kSide = 80;
  constexpr double kCell = 0.05;
  std::ofstream samples(stem + ".flt", std::ios::binary);
  for (int r = 0; r < kSide; ++r) {
    for (int c = 0; c < kSide; ++c) {
      const auto height = static_cast<float>(land(8.0 + (c + 0.5) * kCell, 48.0 - (r + 0.5) * kCell));
      samples.write(reinterpret_cast<const char*>(&height), sizeof height);
    }
  }
  std::ofstream(stem + ".hdr") << "ncols 80\nnrows 80\nxllcorner 8\nyllcorner 44\ncellsize 0.05\nNODATA_value -9999\n"
                                  "byteorder LSBFIRST\n";
  std::ofstream(stem + ".prj") << system;
}

TEST(ProjectedExport, GdalFindsEverySampleWhereItsElevationBelongs) {
  if (run_program({"/bin/sh", "-c", "command -v gdaltransform >/dev/null"}).exit_code != 0) {
    GTEST_SKIP() << "gdal-bin is not here";
  }
  const TemporaryFolder folder;
  for (const char* body : {kEarth, kMars}) {
    write_plane(folder / "plane", body);
    for (const std::string kind : {"equirectangular", "local", "transverse-mercator:9.5,0.9996", "utm:32N",
                                   "lambert-conformal", "lambert-conformal:-20,20,9", "polar-stereographic:46"}) {
      if (body == kMars && kind == "utm:32N") continue;  // of the Earth
      for (const bool box : {false, true}) {
        SCOPED_TRACE(kind + (body == kMars ? " Mars" : " Earth") + (box ? " bbox" : ""));
        const RunResult made = run_isohf({"convert", folder / "plane.flt", folder / "a.isohf", "--overwrite",
                                          "--projection", kind, "--type", "f32"});
        ASSERT_EQ(made.exit_code, 0) << made.err;
        std::vector<std::string> command = {"export", folder / "a.isohf", folder / "a.tif", "--overwrite"};
        if (box) command.insert(command.end(), {"--bbox", "8.8,44.7,11.1,47.2"});
        const RunResult exported = run_isohf(command);
        ASSERT_EQ(exported.exit_code, 0) << exported.err;
        const auto raster = open_source(folder / "a.tif", {});
        const std::int64_t width = raster->info().width;
        const std::int64_t height = raster->info().height;
        std::vector<float> samples(static_cast<std::size_t>(width * height));
        raster->read_window({0, 0, width, height}, std::as_writable_bytes(std::span(samples)));
        RunOptions options;
        std::vector<float> elevations;
        for (std::int64_t r = 1; r < height; r += 5) {
          for (std::int64_t c = 1; c < width; c += 5) {
            options.input += std::to_string(static_cast<double>(c) + 0.5) + " " +
                             std::to_string(static_cast<double>(r) + 0.5) + "\n";
            elevations.push_back(samples[static_cast<std::size_t>(r * width + c)]);
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
        EXPECT_GT(compared, box ? 60 : 100);
      }
    }
  }
}

}  // namespace
}  // namespace isohf::test
