/// Globes on maps of the whole body, and rasters of these in the globe's own degrees.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "support/rasters/degree_grid.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

double hills(double longitude, double latitude) {
  return 1000.0 + 400.0 * std::sin(longitude * M_PI / 60.0) * std::cos(latitude * M_PI / 180.0);
}

double share_of_voids(const Raster& raster) {
  std::int64_t voids = 0;
  for (std::int64_t r = 0; r < raster.info.height; ++r) {
    for (std::int64_t c = 0; c < raster.info.width; ++c) voids += std::isnan(raster.at(c, r)) ? 1 : 0;
  }
  return static_cast<double>(voids) / static_cast<double>(raster.info.width * raster.info.height);
}

// Outlines fill so much of their rectangles; PROJ goes round again beyond those of the first and the last.
TEST(WorldMap, AGlobeIsShownOnceWhereverItsLongitudesBegin) {
  const TemporaryFolder folder;
  struct Case {
    const char* map;
    double shown;
  };
  for (const Case& of : {Case{"ESRI:54008", 2.0 / M_PI}, Case{"ESRI:54009", M_PI / 4.0},
                         Case{"+proj=moll +lon_0=180 +type=crs", M_PI / 4.0}, Case{"EPSG:8857", 0.881}}) {
    for (const double west : {0.0, -180.0, -100.0}) {
      SCOPED_TRACE(std::string(of.map) + " from " + std::to_string(west));
      write_degrees(folder / "globe", 360, 180, west, -90.0, 1.0, hills);
      const RunResult made = run_isohf(
          {"convert", folder / "globe.flt", folder / "a.isohf", "--overwrite", "--to-crs", of.map, "--type", "f32"});
      ASSERT_EQ(made.exit_code, 0) << made.err;
      const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "globe.flt"});
      EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
      const RunResult own =
          run_isohf({"export", folder / "a.isohf", folder / "a.tif", "--to-crs", "none", "--overwrite", "-q"});
      ASSERT_EQ(own.exit_code, 0) << own.err;
      const Raster raster = read_raster(folder / "a.tif");
      EXPECT_NEAR(static_cast<double>(raster.info.width) / static_cast<double>(raster.info.height), 2.0, 0.1);
      EXPECT_NEAR(share_of_voids(raster), 1.0 - of.shown, 0.02);
    }
  }
}

// Eastings of 19.5 to 20.6 million metres: the map's cut is at 20.04.
TEST(WorldMap, ARasterAcrossTheCutOfItsOwnMapIsWholeOnAnother) {
  const TemporaryFolder folder;
  const auto sample = [](std::int64_t c, std::int64_t r) {
    return static_cast<float>(100.0 + 2.0 * double(c) + double(r));
  };
  write_gridfloat(folder / "a", 110, 50, 19500000.0, 1000000.0, 10000.0, sample, "");
  std::filesystem::remove(folder / "a.prj");
  const RunResult made = run_isohf({"convert", folder / "a.flt", folder / "a.isohf", "--crs", "EPSG:4087", "--to-crs",
                                    "transverse-mercator", "--type", "f32"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.flt", "--json"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_NE(verified.out.find("\"samples_compared\": 5500"), std::string::npos) << verified.out;
}

TEST(WorldMap, ItsOwnDegreesGiveAllColumnsAndTheBoxThatIsAsked) {
  const TemporaryFolder folder;
  for (const double west : {0.0, 90.0, -180.0}) {
    write_degrees(folder / "cap", 360, 30, west, -90.0, 1.0, hills);
    const RunResult made =
        run_isohf({"convert", folder / "cap.flt", folder / "a.isohf", "--overwrite", "--type", "f32"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const RunResult restored =
        run_isohf({"export", folder / "a.isohf", folder / "a.tif", "--to-crs", "EPSG:4326", "--overwrite", "-q"});
    ASSERT_EQ(restored.exit_code, 0) << restored.err;
    const Raster whole = read_raster(folder / "a.tif");
    EXPECT_EQ(whole.info.width, 360);
    EXPECT_EQ(whole.info.height, 30);
    EXPECT_EQ(share_of_voids(whole), 0.0);
    struct Case {
      const char* box;
      double west;
      int columns;
    };
    for (const Case& of :
         {Case{"170,-80,190,-70", 170.0, 20}, Case{"350,-80,10,-70", 350.0, 20}, Case{"200,-80,250,-70", 200.0, 50}}) {
      SCOPED_TRACE(std::string(of.box) + " of columns from " + std::to_string(west));
      const RunResult cut = run_isohf({"export", folder / "a.isohf", folder / "b.tif", "--to-crs", "EPSG:4326",
                                       std::string("--bbox=") + of.box, "--overwrite", "-q"});
      ASSERT_EQ(cut.exit_code, 0) << cut.err;
      const Raster part = read_raster(folder / "b.tif");
      ASSERT_EQ(part.info.width, of.columns);
      ASSERT_EQ(part.info.height, 10);
      EXPECT_NEAR(std::remainder(part.info.georeference.origin_x - 0.5 - of.west, 360.0), 0.0, 1e-9);
      EXPECT_NEAR(part.at(3, 4), hills(of.west + 3.5, -74.5), 1.0);
    }
  }
}

TEST(ReferenceSystemOption, TakesNoWordForAName) {
  const TemporaryFolder folder;
  write_degrees(folder / "a", 20, 20, 10.0, 40.0, 0.01, hills);
  const std::string nowhere = folder / "b.isohf";
  const auto convert = [&](const std::string& system) {
    return run_isohf({"convert", folder / "a.flt", nowhere, "--overwrite", "--crs", system});
  };
  for (const char* const word : {"foo", "bar", "New", "Swiss", "missing.prj"}) {
    const RunResult refused = convert(word);
    EXPECT_NE(refused.exit_code, 0) << word;
    EXPECT_NE(refused.err.find(word), std::string::npos) << refused.err;
  }
  for (const char* const name : {"WGS84", "WGS 84", "EPSG:4326"}) EXPECT_EQ(convert(name).exit_code, 0) << name;
  std::filesystem::remove(folder / "a.prj");
  for (const char* const name : {"ETRS89", "EPSG:4258"}) EXPECT_EQ(convert(name).exit_code, 0) << name;
}

// The middle column and row of this grid are edges of tiles: both extracts have them, and no nodata.
TEST(Extract, SamplesOnAnEdgeOfTilesAreInBothExtracts) {
  const TemporaryFolder folder;
  const auto sample = [](std::int64_t c, std::int64_t r) { return static_cast<float>(c % 7 + r % 5); };
  write_gridfloat(folder / "a", 121, 121, 500000.0, 4000000.0, 30.0, sample, "");
  std::filesystem::remove(folder / "a.prj");
  const RunResult made = run_isohf({"convert", folder / "a.flt", folder / "a.isohf", "--registration", "point",
                                    "--shape", "52x67", "--fit", "--lossless"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::int64_t samples = 0;
  for (const char* const tiles : {"0:1,0:1", "1:2,0:1", "0:1,1:2", "1:2,1:2"}) {
    ASSERT_EQ(
        run_isohf({"extract", folder / "a.isohf", "-o", folder / "p.isohf", "--tiles", tiles, "--overwrite"}).exit_code,
        0);
    const RunResult restored = run_isohf({"export", folder / "p.isohf", folder / "p.tif", "--overwrite"});
    ASSERT_EQ(restored.exit_code, 0) << restored.err;
    const Raster part = read_raster(folder / "p.tif");
    samples += part.info.width * part.info.height;
    EXPECT_EQ(share_of_voids(part), 0.0) << tiles;
  }
  EXPECT_EQ(samples, 122 * 122);
}

}  // namespace
}  // namespace isohf::test
