/// isohf export --like: grids of other rasters, through projections and beside them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "support/rasters/degree_grid.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::vector<std::string> kWarpedKinds = {"local",
                                               "transverse-mercator:9,0.9996",
                                               "utm",
                                               "lambert-conformal",
                                               "lambert-conformal:-30,30,5",
                                               "polar-stereographic:45"};

double land(double longitude, double latitude) {
  return 800.0 + 400.0 * std::sin(0.7 * longitude) * std::cos(0.8 * latitude);
}

class ExportLike : public testing::Test {
 protected:
  ExportLike() { write_degrees(folder / "wide", 240, 160, 2.0, 42.0, 0.05, land); }

  void convert(const std::string& name, const std::string& kind, const std::vector<std::string>& more = {}) const {
    const RunResult result = run_isohf(with_more(
        {"convert", folder / name, folder / "a.isohf", "--overwrite", "--to-crs", kind, "--type", "f32", "-q"}, more));
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  [[nodiscard]] RunResult run(const std::string& output, const std::vector<std::string>& more) const {
    return run_isohf(with_more({"export", folder / "a.isohf", folder / output}, more));
  }

  /// Exports onto the grid of a raster of the folder.
  [[nodiscard]] Raster like(const std::string& name, const std::string& output = "like.tif",
                            std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--like", folder / name, "--overwrite", "-q"});
    const RunResult result = run(output, more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out + result.err, "");
    return result.exit_code == 0 ? read_raster(folder / output) : Raster{};
  }

  void refuses(const std::string& name, const std::string& why, const std::vector<std::string>& more = {}) const {
    const RunResult result = run("none.tif", with_more({"--like", folder / name}, more));
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "none.tif"));
  }

  /// What isohf sample finds at every sample of a raster in degrees; NaN where it finds nothing.
  [[nodiscard]] std::vector<float> sampled(const SourceInfo& info) const {
    const Georeference& place = info.georeference;
    RunOptions options;
    for (std::int64_t row = 0; row < info.height; ++row) {
      for (std::int64_t column = 0; column < info.width; ++column) {
        std::ostringstream line;
        line.precision(17);
        line << place.origin_x + static_cast<double>(column) * place.spacing_x << ' '
             << place.origin_y - static_cast<double>(row) * place.spacing_y << '\n';
        options.input += line.str();
      }
    }
    const RunResult result = run_isohf({"sample", folder / "a.isohf", "--in", "lonlat"}, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<float> heights;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      heights.push_back(line == "void" || line == "outside" ? std::nanf("") : std::stof(line));
    }
    return heights;
  }

  TemporaryFolder folder;
};

/// What verify measures on the triangles at the source's samples is what comes back there.
TEST_F(ExportLike, ErrsAtTheSourcesSamplesByWhatVerifyMeasures) {
  const Raster source = read_raster(folder / "wide.flt");
  for (const std::string& kind : kWarpedKinds) {
    SCOPED_TRACE(kind);
    convert("wide.flt", kind);
    const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "wide.flt", "--json"});
    ASSERT_EQ(verified.exit_code, 0) << verified.err;
    const json against = json::parse(verified.out).at("against");
    const Raster back = like("wide.flt");
    ASSERT_EQ(back.elevations.size(), source.elevations.size());
    double worst = 0.0;
    double squares = 0.0;
    for (std::size_t i = 0; i < back.elevations.size(); ++i) {
      const double error =
          std::abs(static_cast<double>(back.elevations[i]) - static_cast<double>(source.elevations[i]));
      worst = error <= worst ? worst : error;  // a NaN becomes the worst, and stays
      squares += error * error;
    }
    // Floats of 1200 are rounded by up to 0.00006.
    EXPECT_NEAR(worst, against.at("max").get<double>(), 1e-4);
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(source.elevations.size())), against.at("rms").get<double>(),
                1e-4);
    // Triangles of 4 km on waves of 500 a square degree: 0.05 * 0.05 * 500 / 8 is 0.16.
    EXPECT_LT(worst, 0.6);
    EXPECT_EQ(back.info.georeference.unit, HorizontalUnit::kDegree);
    EXPECT_EQ(back.info.georeference.registration, Registration::kArea);
    EXPECT_DOUBLE_EQ(back.info.georeference.origin_x, source.info.georeference.origin_x);
    EXPECT_DOUBLE_EQ(back.info.georeference.origin_y, source.info.georeference.origin_y);
    EXPECT_DOUBLE_EQ(back.info.georeference.spacing_x, source.info.georeference.spacing_x);
    EXPECT_EQ(back.info.georeference.system.semi_major_axis_m, source.info.georeference.system.semi_major_axis_m);
  }
}

TEST_F(ExportLike, GivesWhatSampleFindsAtFinerCoarserAndShiftedGrids) {
  // With a hole, and ground on all sides that the archive does not have; the last one is counted on from 361.
  const auto holed = [](double longitude, double latitude) {
    return std::hypot(longitude - 8.0, latitude - 46.0) < 0.6 ? -9999.0 : land(longitude, latitude);
  };
  write_degrees(folder / "holed", 240, 160, 2.0, 42.0, 0.05, holed);
  write_degrees(folder / "finer", 130, 110, 7.003, 45.007, 0.0173, land);
  write_degrees(folder / "coarser", 19, 14, 0.3, 40.1, 0.81, land);
  write_degrees(folder / "turned", 80, 60, 361.03, 43.011, 0.107, land);
  for (const std::string& kind : kWarpedKinds) {
    convert("holed.flt", kind);
    for (const std::string name : {"finer.flt", "coarser.flt", "turned.flt"}) {
      SCOPED_TRACE(kind + " " + name);
      const Raster found = like(name, "like.tif", {"--method", "barycentric"});
      const SourceInfo info = read_raster(folder / name).info;
      std::vector<float> expected = sampled(info);
      ASSERT_EQ(found.elevations.size(), expected.size());
      std::size_t voids = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        // Tiles go on beyond the input, and are sampled as they are drawn; rasters end where it does.
        const auto sample = static_cast<std::int64_t>(i);
        const double longitude = std::remainder(
            info.georeference.origin_x + static_cast<double>(sample % info.width) * info.georeference.spacing_x, 360.0);
        const double latitude =
            info.georeference.origin_y - static_cast<double>(sample / info.width) * info.georeference.spacing_y;
        if (longitude < 2.0 || longitude > 14.0 || latitude < 42.0 || latitude > 50.0) expected[i] = std::nanf("");
        ASSERT_EQ(std::isnan(found.elevations[i]), std::isnan(expected[i])) << i;
        voids += std::isnan(expected[i]) ? 1U : 0U;
        // Nine digits are printed, and both are rounded to floats, which lie 0.00012 apart there.
        if (!std::isnan(expected[i])) {
          ASSERT_NEAR(found.elevations[i], expected[i], 2e-4) << i;
        }
      }
      EXPECT_GT(voids, expected.size() / 40);
      EXPECT_LT(voids, expected.size() * 3 / 4);
    }
  }
}

TEST_F(ExportLike, BytesDoNotDependOnThreads) {
  convert("wide.flt", "lambert-conformal");
  (void)like("wide.flt", "one.tif", {"-j", "1"});
  (void)like("wide.flt", "five.tif", {"-j", "5"});
  EXPECT_TRUE(read_file(folder / "one.tif") == read_file(folder / "five.tif"));
}

TEST_F(ExportLike, SaysInWordsAndJsonWhereTheSamplesLie) {
  convert("wide.flt", "utm");
  EXPECT_EQ(run("said.tif", {"--like", folder / "wide.flt"}).out,
            "raster       " + folder / "said.tif" + ": 240 x 160 samples of float32\nspacing      0.05 x 0.05\n");
  const json said = json::parse(run("json.tif", {"--like", folder / "wide.flt", "--json"}).out);
  EXPECT_EQ(said.at("method"), "barycentric");
  EXPECT_EQ(said.at("width"), 240);
  EXPECT_DOUBLE_EQ(said.at("first_sample").at("x"), 2.025);
  EXPECT_DOUBLE_EQ(said.at("first_sample").at("z"), 49.975);
  EXPECT_DOUBLE_EQ(said.at("spacing").at("x"), 0.05);
  EXPECT_DOUBLE_EQ(said.at("spacing").at("z"), 0.05);
}

TEST_F(ExportLike, HasNothingBeyondAPole) {
  write_degrees(folder / "cap", 360, 40, -180.0, 50.0, 1.0,
                [](double, double latitude) { return 50.0 * (90.0 - latitude); });
  convert("cap.flt", "auto");
  write_degrees(folder / "beyond", 36, 8, 0.0, 84.0, 1.0, land);
  const Raster found = like("beyond.flt");
  ASSERT_EQ(found.elevations.size(), 36U * 8U);
  for (std::size_t i = 0; i < found.elevations.size(); ++i) {
    const double latitude = 91.5 - static_cast<double>(i / 36);
    EXPECT_EQ(std::isnan(found.elevations[i]), latitude > 90.0) << latitude;
    // A cone, whose slope changes at the pole: flat over a sample of 50 m there.
    if (latitude < 90.0) {
      EXPECT_NEAR(found.elevations[i], 50.0 * (90.0 - latitude), 25.0) << latitude;
    }
  }
}

/// A raster of the map is one of the archive's own grids, whichever format it went through.
TEST_F(ExportLike, TakesRastersOfTheArchivesOwnMap) {
  for (const std::string& kind : kWarpedKinds) {
    convert("wide.flt", kind);
    for (const std::string extension : {".tif", ".png", ".flt", ".r32"}) {
      SCOPED_TRACE(kind + extension);
      // So many that no column lies on vertices, where the last bit of its place decides whether a void is near.
      const std::string map = "map" + std::to_string(kind.size()) + extension.substr(1) + extension;
      ASSERT_EQ(run(map, {"--to-crs", "none", "--size", "128x64", "--overwrite", "-q"}).exit_code, 0);
      const Raster back = like(map, "like.exr");
      ASSERT_EQ(run("direct.exr", {"--to-crs", "none", "--size", "128x64", "--overwrite", "-q"}).exit_code, 0);
      const Raster direct = read_raster(folder / "direct.exr");
      ASSERT_EQ(back.elevations.size(), direct.elevations.size());
      for (std::size_t i = 0; i < back.elevations.size(); ++i) {
        ASSERT_EQ(std::isnan(back.elevations[i]), std::isnan(direct.elevations[i])) << i;
        // The place is written in 12 digits or more: a tenth of a millimetre, on slopes of less than 1 in 100.
        if (!std::isnan(direct.elevations[i])) {
          ASSERT_NEAR(back.elevations[i], direct.elevations[i], 2e-4) << i;
        }
      }
    }
  }
}

TEST_F(ExportLike, RefusesWhatHasNoPlaceOnTheMap) {
  convert("wide.flt", "utm:32N");
  ASSERT_EQ(run("utm.tif", {"--to-crs", "none", "-q"}).exit_code, 0);
  convert("wide.flt", "lambert-conformal");
  ASSERT_EQ(run("cone.tif", {"--to-crs", "none", "-q"}).exit_code, 0);
  refuses("utm.tif", "is in metres of EPSG:32632; the archive's input was in degrees and was projected");
  refuses("wide.flt", "--method hex goes along rows", {"--method", "hex"});
  convert("wide.flt", "lambert-conformal:44,48,8");
  refuses("cone.tif", "a place there; bring it to degrees (gdalwarp)");
  write_degrees(folder / "nowhere", 20, 20, 0.0, 0.0, 1.0, land);
  std::filesystem::remove(folder / "nowhere.prj");
  refuses("nowhere.flt", "is in an unknown unit");
  std::filesystem::copy_file(ISOHF_SOURCE_DIR "/testdata/peaks_256x256_uint16.png", folder / "peaks.png");
  refuses("peaks.png", "does not say where it lies");
  write_degrees(folder / "mars", 20, 20, 5.0, 45.0, 0.1, land);
  std::ofstream(folder / "mars.prj") << "GEOGCS[\"GCS_Mars_2000\",DATUM[\"D_Mars_2000\",SPHEROID[\"Mars_2000_IAU_IAG\","
                                        "3396190,169.894447223612]],PRIMEM[\"Reference_Meridian\",0],"
                                        "UNIT[\"degree\",0.0174532925199433]]";
  refuses("mars.flt", "is of Mars, the archive of Earth");
  write_degrees(folder / "old", 20, 20, 5.0, 45.0, 0.1, land);
  std::ofstream(folder / "old.prj") << "GEOGCS[\"NAD27\",DATUM[\"D_North_American_1927\",SPHEROID[\"Clarke_1866\","
                                       "6378206.4,294.9786982]],PRIMEM[\"Greenwich\",0],"
                                       "UNIT[\"degree\",0.0174532925199433]]";
  refuses("old.flt", "is in EPSG:4267 with an equatorial radius of 6378206.4 m, the archive's source in EPSG:4326");
}

TEST_F(ExportLike, NeverTakesDegreesForMetresBesideAMap) {
  const std::string coast = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  ASSERT_EQ(run_isohf({"convert", coast, folder / "a.isohf"}).exit_code, 0);
  refuses("wide.flt", "is in degrees, the archive's source in metres");
  convert("wide.flt", "equirectangular");
  std::filesystem::copy_file(coast, folder / "coast.tif");
  refuses("coast.tif",
          "is in metres, the archive's source in degrees; bring it to the source's reference system, EPSG:4326");
}

TEST_F(ExportLike, CountsLongitudesRoundTheBodyWhereRowsStayRows) {
  convert("wide.flt", "equirectangular");
  write_degrees(folder / "turned", 60, 50, 363.0, 43.0, 0.11, land);
  write_degrees(folder / "plain", 60, 50, 3.0, 43.0, 0.11, land);
  const Raster turned = like("turned.flt", "turned.tif");
  const Raster plain = like("plain.flt", "plain.tif");
  ASSERT_EQ(turned.elevations.size(), plain.elevations.size());
  for (std::size_t i = 0; i < plain.elevations.size(); ++i)
    ASSERT_NEAR(turned.elevations[i], plain.elevations[i], 1e-3) << i;
}

double hills(double longitude, double latitude) {
  return 800.0 + 400.0 * std::sin(longitude * M_PI / 60.0) * std::cos(latitude * M_PI / 60.0);
}

TEST_F(ExportLike, FindsAllColumnsOfAGlobeThatCountsFromTheOtherSide) {
  write_degrees(folder / "from_0", 144, 72, 0.0, -90.0, 2.5, hills);
  write_degrees(folder / "around_0", 144, 72, -180.0, -90.0, 2.5, hills);
  write_degrees(folder / "box", 24, 16, -30.0, -20.0, 2.5, hills);
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--no-wrap"}}) {
    convert("from_0.flt", "equirectangular", more);
    for (const std::string name : {"around_0.flt", "box.flt"}) {
      for (const std::string method : {"hex", "barycentric"}) {
        SCOPED_TRACE(name + " " + method);
        const Raster found = like(name, "like.tif", {"--method", method});
        const Raster expected = read_raster(folder / name);
        ASSERT_EQ(found.elevations.size(), expected.elevations.size());
        EXPECT_DOUBLE_EQ(found.info.georeference.origin_x, expected.info.georeference.origin_x);
        for (std::size_t i = 0; i < found.elevations.size(); ++i)
          ASSERT_NEAR(found.elevations[i], expected.elevations[i], 12.0) << i;
      }
    }
  }
}

TEST_F(ExportLike, CrsOfTheArchiveItselfGivesTheSourcesGrid) {
  for (const std::string& kind : {std::string("equirectangular"), std::string("lambert-conformal")}) {
    SCOPED_TRACE(kind);
    convert("wide.flt", kind);
    ASSERT_EQ(run("own.tif", {"--to-crs", "EPSG:4326", "-q", "--overwrite"}).exit_code, 0);
    const Raster own = read_raster(folder / "own.tif");
    const Raster beside = like("wide.flt");
    EXPECT_EQ(own.info.width, 240);
    EXPECT_EQ(own.info.height, 160);
    EXPECT_NEAR(own.info.georeference.origin_x, 2.025, 1e-12);
    EXPECT_NEAR(own.info.georeference.spacing_x, 0.05, 1e-12);
    ASSERT_EQ(own.elevations.size(), beside.elevations.size());
    for (std::size_t i = 0; i < own.elevations.size(); ++i)
      ASSERT_NEAR(own.elevations[i], beside.elevations[i], 1e-3) << i;
  }
}

TEST_F(ExportLike, CrsTakesGroundAcrossThe180thMeridianAndWholeGlobes) {
  write_degrees(folder / "fiji", 40, 30, 170.0, -20.0, 0.5, hills);
  write_degrees(folder / "globe", 144, 72, 0.0, -90.0, 2.5, hills);
  convert("fiji.flt", "lambert-conformal");
  const auto in_system = [&](const std::string& system) {
    const RunResult result = run("there.tif", {"--to-crs", system, "-q", "--overwrite"});
    EXPECT_EQ(result.exit_code, 0) << system << ": " << result.err;
    return read_raster(folder / "there.tif");
  };
  const auto voids = [](const Raster& raster) {
    return std::count_if(raster.elevations.begin(), raster.elevations.end(),
                         [](float height) { return std::isnan(height); });
  };
  EXPECT_NEAR(in_system("EPSG:4326").info.georeference.origin_x, 170.25, 1e-9);
  const Raster other = in_system("EPSG:4258");
  EXPECT_GT(other.info.georeference.origin_x, 169.0);
  EXPECT_LT(other.info.width, 50);
  convert("globe.flt", "equirectangular");
  EXPECT_EQ(in_system("EPSG:4326").info.width, 144);
  const Raster turned = in_system("EPSG:4258");
  EXPECT_EQ(turned.info.width, 144);
  EXPECT_EQ(turned.info.height, 72);
  EXPECT_EQ(voids(turned), 0);
  // On plate carree cut open at 180 degrees, where the source is not; Mercator's square; an ellipse in a rectangle.
  const Raster flat = in_system("EPSG:4087");
  EXPECT_NEAR(flat.info.georeference.origin_x, -20037508.0, 1.5 * flat.info.georeference.spacing_x);
  EXPECT_NEAR(static_cast<double>(flat.info.width) * flat.info.georeference.spacing_x, 2.0 * 20037508.0,
              2.0 * flat.info.georeference.spacing_x);
  EXPECT_LT(voids(flat), 2 * (flat.info.width + flat.info.height));
  const Raster mercator = in_system("EPSG:3857");
  EXPECT_NEAR(mercator.info.georeference.origin_y, 20037508.0, mercator.info.georeference.spacing_y);
  // The same ground in other units.
  write_degrees(folder / "north", 40, 30, 9.0, 60.0, 0.01, hills);
  convert("north.flt", "lambert-conformal");
  const Raster metres = in_system("+proj=utm +zone=32 +datum=WGS84");
  const Raster feet = in_system("+proj=utm +zone=32 +datum=WGS84 +units=us-ft");
  EXPECT_NEAR(static_cast<double>(feet.info.height) * feet.info.georeference.spacing_y * 1200.0 / 3937.0,
              static_cast<double>(metres.info.height) * metres.info.georeference.spacing_y,
              3.0 * metres.info.georeference.spacing_y);
  convert("globe.flt", "equirectangular");
  // Round a pole, as far as half the way round the body, where maps go on for ever.
  for (const char* system :
       {"EPSG:3413", "EPSG:3031", "EPSG:2154", "+proj=gnom +lat_0=90", "+proj=tmerc", "EPSG:3035"}) {
    const Raster polar = in_system(system);
    const Georeference& place = polar.info.georeference;
    const double width = static_cast<double>(polar.info.width) * place.spacing_x;
    const double height = static_cast<double>(polar.info.height) * place.spacing_y;
    EXPECT_EQ(place.spacing_x, place.spacing_y) << system;
    EXPECT_LT(std::max(width, height), 2.1 * 20037508.0) << system;
    EXPECT_GT(std::min(width, height), 15e6) << system;
    EXPECT_LT(voids(polar), static_cast<std::int64_t>(polar.elevations.size()) * 8 / 10) << system;
  }
  const Raster ellipse = in_system("+proj=moll +datum=WGS84");
  EXPECT_NEAR(static_cast<double>(voids(ellipse)) / static_cast<double>(ellipse.elevations.size()), 1.0 - M_PI / 4.0,
              0.05);
}

TEST_F(ExportLike, SaysByWhatSystemsDiffer) {
  write_degrees(folder / "mars", 40, 30, 5.0, 40.0, 0.1, land);
  write_degrees(folder / "round", 40, 30, 5.0, 40.0, 0.1, land);
  const auto prj = [&](const std::string& name, const std::string& radius) {
    std::ofstream(folder / name) << "GEOGCS[\"GCS_Mars\",DATUM[\"D_Mars\",SPHEROID[\"Mars\"," + radius +
                                        ",0]],PRIMEM[\"Reference_Meridian\",0],UNIT[\"degree\",0.0174532925199433]]";
  };
  prj("mars.prj", "3396000");
  prj("round.prj", "3396190");
  convert("mars.flt", "none");
  refuses("round.flt", "with an equatorial radius of 3396190 m");
  refuses("round.flt", "one of 3396000 m");
}

}  // namespace
}  // namespace isohf::test
