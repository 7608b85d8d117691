/// --crs says what an input's coordinates are in.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/options/small_grid.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using Words = std::vector<std::string>;

class CrsOption : public testing::Test {
 protected:
  CrsOption() { write_text(grid_, small_grid()); }

  [[nodiscard]] RunResult convert(const std::string& system, const Words& more = {}) const {
    return run_isohf(with_more({"convert", grid_, archive_, "--crs", system, "--quiet", "--overwrite"}, more));
  }
  [[nodiscard]] json crs() const {
    return json::parse(run_isohf({"info", archive_, "--json"}).out).at("metadata").at("source").at("crs");
  }

  TemporaryFolder folder_;
  std::string grid_ = folder_ / "grid.asc";
  std::string archive_ = folder_ / "a.isohf";
};

TEST_F(CrsOption, TakesACodeWktAProjStringAndAFile) {
  const std::string mine = "+proj=laea +lat_0=47 +lon_0=11 +ellps=GRS80 +units=us-ft";
  write_text(folder_ / "mine.txt", mine + "\n");
  ASSERT_EQ(convert("EPSG:2263").err, "");
  EXPECT_EQ(crs().at("epsg"), 2263);
  EXPECT_NEAR(crs().at("metres_per_unit").get<double>(), 1200.0 / 3937.0, 1e-15);
  ASSERT_EQ(convert(mine).exit_code, 0);
  const json by_string = crs();
  EXPECT_EQ(by_string.at("epsg"), nullptr);
  EXPECT_THAT(by_string.at("wkt").get<std::string>(), HasSubstr("Lambert Azimuthal Equal Area"));
  EXPECT_NEAR(by_string.at("metres_per_unit").get<double>(), 1200.0 / 3937.0, 1e-15);
  ASSERT_EQ(convert(folder_ / "mine.txt").exit_code, 0);
  EXPECT_EQ(crs(), by_string);
  ASSERT_EQ(convert(by_string.at("wkt")).exit_code, 0);
  EXPECT_EQ(crs().at("wkt"), by_string.at("wkt"));
}

TEST_F(CrsOption, CompletesTheFileAndMovesNoSample) {
  // It names the ellipsoid alone.
  write_text(folder_ / "grid.prj", "+proj=utm +zone=11 +ellps=WGS72");
  ASSERT_EQ(run_isohf({"convert", grid_, archive_, "--quiet"}).err, "");
  const json as_filed = crs();
  for (const char* const other : {"EPSG:32611", "EPSG:32212", "EPSG:4322"}) {
    const RunResult refused = convert(other);
    EXPECT_EQ(refused.exit_code, 2) << other;
    EXPECT_THAT(refused.err, HasSubstr(std::string("which --crs ") + other + " contradicts"));
  }
  ASSERT_EQ(convert("EPSG:32211").err, "");
  EXPECT_EQ(crs().at("epsg"), 32211);
  EXPECT_EQ(crs().at("origin_x"), as_filed.at("origin_x"));
  EXPECT_EQ(crs().at("spacing_x"), as_filed.at("spacing_x"));
  // The archive records it, as all that was said of the input.
  const RunResult verified = run_isohf({"verify", archive_, "--against", grid_, "--json", "--quiet"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
}

TEST_F(CrsOption, PlacesRastersWithoutASystem) {
  ASSERT_EQ(convert("EPSG:32611").err, "");
  const RunResult answer = run_isohf({"sample", archive_, "--at", "600,600", "--in", "crs", "--with", "lonlat"});
  EXPECT_EQ(answer.exit_code, 0) << answer.err;
  EXPECT_THAT(answer.out, HasSubstr(" -121.48")) << "half a million metres West of the zone's meridian, 117 W";
  ASSERT_EQ(run_isohf({"export", archive_, folder_ / "back.flt", "--quiet"}).err, "");
  EXPECT_THAT(read_text(folder_ / "back.prj"), HasSubstr("WGS_1984_UTM_Zone_11N"));
  ASSERT_EQ(run_isohf({"export", archive_, folder_ / "back.exr", "--quiet"}).err, "");
  EXPECT_THAT(read_text(folder_ / "back.erw"), HasSubstr("30\n0\n0\n-30\n15\n1185\n"));
  EXPECT_THAT(read_text(folder_ / "back.exr.aux.xml"), HasSubstr("32611"));
  ASSERT_EQ(run_isohf({"convert", folder_ / "back.exr", folder_ / "b.isohf", "--quiet"}).err, "");
  const json back =
      json::parse(run_isohf({"info", folder_ / "b.isohf", "--json"}).out).at("metadata").at("source").at("crs");
  EXPECT_EQ(back.at("origin_x"), 15.0);
  EXPECT_EQ(back.at("epsg"), 32611);
}

TEST_F(CrsOption, ReplacesNoForeignSidecar) {
  ASSERT_EQ(convert("EPSG:32611").err, "");
  write_text(folder_ / "x.exr.aux.xml", "<svg/>");
  const RunResult refused = run_isohf({"export", archive_, folder_ / "x.exr", "--quiet", "--overwrite"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("x.exr.aux.xml"));
  EXPECT_EQ(read_text(folder_ / "x.exr.aux.xml"), "<svg/>");
}

TEST_F(CrsOption, RefusesInOneLineWhatIsNoSystemOrHasNoPlace) {
  write_text(folder_ / "zero.prj", std::string(3, '\0'));
  const auto expect = [&](const RunResult& result, const char* why) {
    EXPECT_NE(result.exit_code, 0);
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(result.err.find('\n'), result.err.size() - 1) << result.err;
  };
  expect(convert("nonsense"), "grid.asc: the reference system nonsense: PROJ does not understand it");
  expect(convert("EPSG:5773"), "no projected or geographic");
  expect(convert("EPSG:4807"), "Greenwich");
  expect(convert(""), "--crs");
  expect(convert(folder_ / "zero.prj"), "must hold WKT or a PROJ string");
  expect(convert("EPSG:32611", {"--sample-spacing", "3"}), "--sample-spacing");
  const std::string picture = std::string(ISOHF_SOURCE_DIR) + "/testdata/peaks_256x256_uint16.png";
  expect(run_isohf({"convert", picture, folder_ / "b.isohf", "--crs", "EPSG:32611"}),
         "no coordinates that --crs could be about");
}

TEST_F(CrsOption, RowsThatPassThePoleMakeAWholeArchive) {
  // Posts at the poles and the 180th meridian on plate carree: half of an area lies beyond.
  std::string text = "ncols 36\nnrows 19\nxllcorner -20037508\nyllcorner -10575351\ncellsize 1113194.9\n";
  for (int i = 0; i < 36 * 19; ++i) text += std::to_string(i % 36 * 10 + i / 36) + (i % 36 == 35 ? "\n" : " ");
  write_text(grid_, text);
  ASSERT_EQ(convert("EPSG:4087").err, "");
  EXPECT_EQ(run_isohf({"verify", archive_, "--quiet"}).exit_code, 0);
  const json ground = json::parse(run_isohf({"info", archive_, "--json"}).out).at("metadata").at("source").at("ground");
  EXPECT_EQ(ground.at("bounds").at("north"), 90.0);
  EXPECT_EQ(ground.at("bounds").at("south"), -90.0);
}

TEST_F(CrsOption, GroundBesideAPoleThatIsALineKeepsItsLongitudes) {
  std::string text = "ncols 4\nnrows 4\nxllcorner 0\nyllcorner 9900000\ncellsize 50000\n";
  for (int i = 0; i < 16; ++i) text += std::to_string(i * i) + (i % 4 == 3 ? "\n" : " ");
  write_text(grid_, text);
  ASSERT_EQ(convert("EPSG:4087").err, "");
  const json bounds =
      json::parse(run_isohf({"info", archive_, "--json"}).out).at("metadata").at("source").at("ground").at("bounds");
  EXPECT_EQ(bounds.at("north"), 90.0);
  EXPECT_NEAR(bounds.at("west").get<double>(), 0.0, 1e-6);
  EXPECT_NEAR(bounds.at("east").get<double>(), 200000.0 / 111319.49, 1e-4);
}

TEST_F(CrsOption, ExportToTheArchivesOwnSystemAddsNoBorder) {
  ASSERT_EQ(convert("EPSG:32611").err, "");
  ASSERT_EQ(run_isohf({"export", archive_, folder_ / "plain.asc", "--method", "hex", "--quiet"}).err, "");
  ASSERT_EQ(run_isohf({"export", archive_, folder_ / "own.asc", "--to-crs", "EPSG:32611", "--quiet"}).err, "");
  EXPECT_EQ(read_text(folder_ / "own.asc"), read_text(folder_ / "plain.asc"));
}

/// Of degrees that have no code, in words of other programs: the same, without a datum's name, by the ellipsoid alone.
TEST_F(CrsOption, ExportToTheArchivesOwnDegreesAddsNoBorderHoweverTheyAreSpelled) {
  const auto degrees = [](const std::string& name, const std::string& datum, const std::string& ellipsoid) {
    return "GEOGCS[\"" + name + "\",DATUM[\"" + datum + "\",SPHEROID[\"s\"," + ellipsoid +
           "]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
  };
  struct Case {
    std::string own;
    std::vector<std::string> also;
    std::string other;
  };
  const Case cases[] = {{degrees("GCS_Tachikawa", "D_Tachikawa", "6377397.155,299.1528128"),
                         {degrees("Tachikawa", "Tachikawa", "6377397.155,299.1528128"), "+proj=longlat +ellps=bessel"},
                         "+proj=longlat +ellps=intl"},
                        {degrees("GCS_Mars", "D_Mars", "3396190,0"),
                         {"IAU_2015:49900", "+proj=longlat +R=3396190"},
                         "+proj=longlat +a=3396190 +b=3376200"}};
  std::string small = small_grid();
  small.replace(small.find("cellsize"), small.find('\n', small.find("cellsize")) - small.find("cellsize"),
                "cellsize 0.001");
  write_text(grid_, small);
  for (const Case& of : cases) {
    ASSERT_EQ(convert(of.own, {"--to-crs", "transverse-mercator"}).exit_code, 0);
    const auto size_in = [&](const std::string& system) {
      const RunResult result =
          run_isohf({"export", archive_, folder_ / "own.tif", "--to-crs", system, "--quiet", "--overwrite", "--json"});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      const json said = json::parse(result.out);
      return std::pair(said.at("width").get<int>(), said.at("voids").get<int>());
    };
    const auto own = size_in(of.own);
    EXPECT_EQ(own.second, 0);
    for (const std::string& system : of.also) EXPECT_EQ(size_in(system), own) << system;
    EXPECT_NE(size_in(of.other), own);
  }
}

}  // namespace
}  // namespace isohf::test
