/// Inputs in degrees through the program: projections, joined globes, geoids, and every command that meets them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/degree_grid.h"
#include "support/rasters/small_geoid.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
namespace fs = std::filesystem;

double land(double longitude, double latitude) {
  return 800.0 + 400.0 * std::sin(0.7 * longitude) * std::cos(0.8 * latitude);
}

class ProjectionCommand : public testing::Test {
 protected:
  ProjectionCommand() { write_degrees(folder / "wide", 240, 160, 2.0, 42.0, 0.05, land); }

  RunResult isohf(const std::vector<std::string>& arguments) { return run_isohf(arguments); }
  void converts(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"convert", folder / "wide.flt", folder / "a.isohf", "--overwrite"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult result = run_isohf(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
  }
  void refuses(const std::vector<std::string>& arguments, const std::string& why, int exit_code = 2) {
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.out;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(folder / "b.isohf"));
  }

  TemporaryFolder folder;
};

TEST_F(ProjectionCommand, PlanConvertAndInfoSayWhatWasTakenWhyAndHowFarLengthsErr) {
  for (const RunResult& result :
       {isohf({"plan", folder / "wide.flt"}), isohf({"convert", folder / "wide.flt", folder / "a.isohf"}),
        isohf({"info", folder / "a.isohf"})}) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out,
                HasSubstr("projection   lambert-conformal around longitude 8, true at latitudes 43.3333 and "
                          "48.6667; lengths err by up to 0."));
    EXPECT_THAT(result.out, HasSubstr("errs least among the conformal kinds; equirectangular would err by"));
  }
  const json plan = json::parse(isohf({"plan", folder / "wide.flt", "--json"}).out);
  const json info = json::parse(isohf({"info", folder / "a.isohf", "--json"}).out);
  EXPECT_EQ(plan.at("projection"), info.at("metadata").at("projection"));
  EXPECT_EQ(plan.at("projection").at("kind"), "lambert-conformal");
  EXPECT_EQ(plan.at("wraps_x"), false);
}

TEST_F(ProjectionCommand, EveryKindPassesEveryCheckAndHasItsPlacesInDegrees) {
  for (const std::string kind :
       {"equirectangular", "local", "local:8.5,46", "transverse-mercator", "transverse-mercator:9,0.9996", "utm",
        "utm:32N", "lambert-conformal", "lambert-conformal:44,48,8", "polar-stereographic:45"}) {
    SCOPED_TRACE(kind);
    converts({"--projection", kind, "--step", "0.02"});
    const RunResult verified = isohf({"verify", folder / "a.isohf", "--against", folder / "wide.flt", "--json"});
    ASSERT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const json against = json::parse(verified.out).at("against");
    EXPECT_EQ(against.at("samples"), 240 * 160);
    EXPECT_EQ(against.at("samples_lost"), 0);
    EXPECT_EQ(against.at("vertices").at("wrong"), 0);
    const RunResult sampled = isohf({"sample", folder / "a.isohf", "--at-lonlat", "3.3", "43.7", "--at-lonlat", "12.9",
                                     "48.4", "--at-lonlat", "367.1", "45.2", "--json"});
    ASSERT_EQ(sampled.exit_code, 0) << sampled.err;
    std::istringstream lines(sampled.out);
    for (const auto& [longitude, latitude] : {std::pair{3.3, 43.7}, std::pair{12.9, 48.4}, std::pair{7.1, 45.2}}) {
      std::string line;
      ASSERT_TRUE(std::getline(lines, line));
      const json at = json::parse(line);
      ASSERT_EQ(at.at("state"), "surface") << line;
      // Triangles of 4 km on waves of 280 a degree and 500 a square degree: 0.05 * 0.05 * 500 / 8 is 0.16.
      EXPECT_NEAR(at.at("elevation").get<double>(), land(longitude, latitude), 0.6) << line;
    }
    EXPECT_EQ(isohf({"sample", folder / "a.isohf", "--at-lonlat", "-170", "10"}).out, "outside\n");
  }
}

TEST_F(ProjectionCommand, SampleReadsDegreesFromStandardInput) {
  converts({"--projection", "utm"});
  RunOptions options;
  options.input = "7.5 45.5\n# beside\n7.5,45.5\n";
  const RunResult result = run_isohf({"sample", folder / "a.isohf", "--lonlat"}, options);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string first = result.out.substr(0, result.out.find('\n'));
  EXPECT_EQ(result.out, first + "\n" + first + "\n");
  EXPECT_NEAR(std::stod(first), land(7.5, 45.5), 1.0);
}

TEST_F(ProjectionCommand, WhatDoesNotGoTogetherIsRefusedInOneLine) {
  const std::string wide = folder / "wide.flt";
  const std::string out = folder / "b.isohf";
  refuses({"convert", wide, out, "--projection", "mercator"}, "--projection: found 'mercator', must be one of auto");
  refuses({"convert", wide, out, "--projection", "polar-stereographic:-60"}, "--projection lambert-conformal works");
  refuses({"convert", wide, out, "--wrap-x"}, "240 columns 0.05 apart make 12");
  refuses({"convert", wide, out, "--geoid", "egm.tif"}, "must be a geoid's FILE.pgm");
  refuses({"convert", wide, out, "--geoid", folder / "egm.pgm"}, "egm.pgm: no such file", 1);
  refuses({"convert", wide, out, "--geoid", folder / "egm.pgm", "--lossless"}, "give one of the two");
  converts({"--projection", "utm"});
  write_degrees(folder / "small", 40, 30, 2.0, 42.0, 0.05, land);
  refuses({"verify", folder / "a.isohf", "--against", folder / "small.flt"}, "40x30 samples");
  fs::remove(folder / "wide.prj");
  write_degrees(folder / "metres", 20, 20, 0.0, 0.0, 30.0, land);
  fs::remove(folder / "metres.prj");
  refuses({"convert", folder / "metres.flt", out, "--projection", "utm"}, "needs an input in degrees");
}

TEST_F(ProjectionCommand, LosslessGivesTheInputBackThroughEveryKind) {
  const std::string input = read_file(folder / "wide.flt");
  const std::string plain = [&] {
    converts({"--projection", "equirectangular", "--lossless"});
    return read_file(folder / "a.isohf");
  }();
  for (const std::string kind :
       {"auto", "local", "transverse-mercator", "utm", "lambert-conformal", "polar-stereographic:45"}) {
    SCOPED_TRACE(kind);
    converts({"--projection", kind, "--lossless", "-j", "1"});
    const std::string one = read_file(folder / "a.isohf");
    converts({"--projection", kind, "--lossless", "-j", "3"});
    EXPECT_TRUE(read_file(folder / "a.isohf") == one);
    EXPECT_LT(one.size(), 2 * plain.size());
    EXPECT_EQ(isohf({"verify", folder / "a.isohf"}).exit_code, 0);
    const RunResult restored = isohf({"export", folder / "a.isohf", folder / "back.flt", "--overwrite"});
    ASSERT_EQ(restored.exit_code, 0) << restored.err;
    EXPECT_THAT(restored.out, HasSubstr(", the source's own, SHA-256 as stated"));
    EXPECT_TRUE(read_file(folder / "back.flt") == input);
    // In degrees, where they were.
    const auto back = open_raster(folder / "back.flt", {});
    EXPECT_EQ(back->info().georeference.unit, HorizontalUnit::kDegree);
    EXPECT_NEAR(back->info().georeference.origin_x, 2.025, 1e-9);
    EXPECT_NEAR(back->info().georeference.origin_y, 49.975, 1e-9);
    EXPECT_DOUBLE_EQ(back->info().georeference.spacing_x, 0.05);
    // What else is asked for is a raster of the map.
    ASSERT_EQ(isohf({"export", folder / "a.isohf", folder / "map.tif", "--overwrite", "--method", "hex"}).exit_code, 0);
    EXPECT_EQ(open_raster(folder / "map.tif", {})->info().georeference.unit, HorizontalUnit::kMetre);
  }
}

TEST_F(ProjectionCommand, LosslessKeepsVoidsAndGroundBeyondTheMap) {
  // To the pole, all the way round, with holes that are filled.
  write_degrees(folder / "cap", 360, 40, -180.0, 50.0, 1.0, [](double longitude, double latitude) {
    if (std::hypot(longitude - 30.0, latitude - 70.0) < 4.0) return -9999.0;
    return 50.0 * (90.0 - latitude) * (1.0 + 0.2 * std::cos(longitude * M_PI / 180.0));
  });
  const RunResult made = isohf({"convert", folder / "cap.flt", folder / "a.isohf", "--lossless", "--fill"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("polar-stereographic"));
  ASSERT_EQ(isohf({"export", folder / "a.isohf", folder / "back.flt"}).exit_code, 0);
  EXPECT_TRUE(read_file(folder / "back.flt") == read_file(folder / "cap.flt"));
}

TEST_F(ProjectionCommand, ShadowsAndPicturesOfAMapAreMade) {
  converts({"--projection", "transverse-mercator", "--shadow-seeds"});
  ASSERT_EQ(isohf({"shade", folder / "a.isohf", "-o", folder / "a.tif", "--size", "300x200"}).exit_code, 0);
  ASSERT_EQ(isohf({"export", folder / "a.isohf", folder / "b.tif", "--size", "300x200"}).exit_code, 0);
  OpenOptions green;
  green.channel = "1";
  const Georeference drawn = open_raster(folder / "a.tif", green)->info().georeference;
  const Georeference exported = open_raster(folder / "b.tif", {})->info().georeference;
  EXPECT_NEAR(drawn.origin_x, exported.origin_x, 1e-6);
  EXPECT_NEAR(drawn.origin_y, exported.origin_y, 1e-6);
  EXPECT_NEAR(drawn.spacing_x, exported.spacing_x, 1e-9);
  EXPECT_EQ(isohf({"verify", folder / "a.isohf"}).exit_code, 0);
}

TEST_F(ProjectionCommand, AnInputAcrossTheAntimeridianLandsRight) {
  // The same ground, counted on from 179.5 and from -180.5.
  for (const double west : {179.0, -181.0}) {
    write_degrees(folder / "across", 200, 150, west, 60.0, 0.01, [](double longitude, double latitude) {
      return 10.0 * (std::fmod(longitude + 720.0, 360.0) - 180.0) + 3.0 * latitude;
    });
    for (const char* kind : {"equirectangular", "transverse-mercator", "lambert-conformal"}) {
      const RunResult result = isohf({"convert", folder / "across.flt", folder / "a.isohf", "--overwrite",
                                      "--projection", kind, "--step", "0.001"});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      for (const double longitude : {179.5, 180.0, -179.5}) {
        const std::string text = std::to_string(longitude);
        const RunResult sampled = isohf({"sample", folder / "a.isohf", "--at-lonlat", text, "60.75"});
        const double expected = 10.0 * (std::fmod(longitude + 720.0, 360.0) - 180.0) + 3.0 * 60.75;
        EXPECT_NEAR(std::stod(sampled.out), expected, 0.01) << kind << " " << west << " " << longitude;
      }
    }
  }
}

TEST_F(ProjectionCommand, APolarCapIsWholeToThePole) {
  write_degrees(folder / "cap", 720, 60, -180.0, 60.0, 0.5, [](double longitude, double latitude) {
    return 50.0 * (90.0 - latitude) * (1.0 + 0.2 * std::cos(longitude * M_PI / 180.0));
  });
  const RunResult result = isohf({"convert", folder / "cap.flt", folder / "a.isohf", "--step", "0.05"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("polar-stereographic"));
  const RunResult verified = isohf({"verify", folder / "a.isohf", "--against", folder / "cap.flt"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  for (const char* longitude : {"-180", "-179.8", "-90", "0", "45", "179.9"}) {
    const RunResult sampled = isohf({"sample", folder / "a.isohf", "--at-lonlat", longitude, "75.25"});
    const double expected = 50.0 * 14.75 * (1.0 + 0.2 * std::cos(std::stod(longitude) * M_PI / 180.0));
    EXPECT_NEAR(std::stod(sampled.out), expected, 3.0) << longitude;
  }
  EXPECT_NEAR(std::stod(isohf({"sample", folder / "a.isohf", "--at-lonlat", "0", "90"}).out), 0.0, 12.0);
}

TEST_F(ProjectionCommand, ARepeatedColumnIsLeftOutOfAJoinedGlobe) {
  const auto round = [](double longitude, double latitude) {
    return 100.0 * std::cos(longitude * M_PI / 180.0) * std::cos(latitude * M_PI / 180.0);
  };
  write_degrees(folder / "globe", 72, 36, -180.0, -90.0, 5.0, round);
  write_degrees(folder / "again", 73, 36, -180.0, -90.0, 5.0, round);
  const RunResult globe = isohf({"convert", folder / "globe.flt", folder / "g.isohf", "--wrap-x"});
  EXPECT_EQ(globe.exit_code, 0) << globe.err;
  EXPECT_EQ(globe.err, "");
  const RunResult again = isohf({"convert", folder / "again.flt", folder / "h.isohf", "--wrap-x"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("column 72 is the first one again"));
  const auto metadata = [&](const char* name) {
    return json::parse(isohf({"info", folder / name, "--json"}).out)["metadata"];
  };
  EXPECT_EQ(metadata("g.isohf").at("content_sha256"), metadata("h.isohf").at("content_sha256"));
  EXPECT_EQ(metadata("g.isohf").at("wraps_x"), true);
  for (const char* input : {"globe.flt", "again.flt"}) {
    const RunResult verified = isohf({"verify", folder / "h.isohf", "--against", folder / input});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  }
}

TEST_F(ProjectionCommand, AGeoidMovesElevationsAndTheirDatum) {
  write_geoid(folder / "egm96-test.pgm", 72, 37, [](double, double) { return 47.0; });
  converts({"--geoid", folder / "egm96-test.pgm", "--projection", "equirectangular"});
  const json info = json::parse(isohf({"info", folder / "a.isohf", "--json"}).out).at("metadata");
  EXPECT_EQ(info.at("source").at("vertical_datum").at("name"), "the ellipsoid, by egm96-test");
  EXPECT_NEAR(std::stod(isohf({"sample", folder / "a.isohf", "--at-lonlat", "7.5", "45.5"}).out),
              land(7.5, 45.5) + 47.0, 1.0);
  write_geoid(folder / "other.pgm", 72, 37, [](double, double) { return 52.0; });
  EXPECT_EQ(isohf({"verify", folder / "a.isohf", "--against", folder / "wide.flt", "--geoid", folder / "other.pgm"})
                .exit_code,
            3);
  const RunResult moved = isohf({"verify", folder / "a.isohf", "--against", folder / "wide.flt"});
  EXPECT_EQ(moved.exit_code, 0) << moved.out;
}

TEST(MarsMegdr, LandsAtItsRadiusAndLongitude) {
  const std::string label = real_data() / "megt90n000cb.lbl";
  if (!fs::exists(label)) GTEST_SKIP() << kNoRealFiles;
  const TemporaryFolder folder;
  const auto source = open_raster(label, {});
  const Georeference& place = source->info().georeference;
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, std::vector<std::string>{"--wrap-x", "--filter", "bspline3"}}) {
    std::vector<std::string> arguments = {"convert", label, folder / "mars.isohf", "--overwrite"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(run_isohf(arguments).exit_code, 0);
    const json metadata = json::parse(run_isohf({"info", folder / "mars.isohf", "--json"}).out).at("metadata");
    EXPECT_EQ(metadata.at("source").at("body").at("name"), "Mars");
    EXPECT_EQ(metadata.at("projection").at("semi_major_axis_m"), 3396000.0);
    // Once round the equator.
    EXPECT_NEAR(metadata.at("valid").at("x1").get<double>(), 2.0 * M_PI * 3396000.0, 1.0);
    // Olympus Mons, Hellas, Elysium, and places at the join of the map at longitude 0, by the samples there.
    for (const auto& [longitude, latitude] : {std::pair{226.2, 18.65}, std::pair{70.0, -42.4}, std::pair{147.2, 25.0},
                                              std::pair{0.3, 10.0}, std::pair{359.7, 10.0}}) {
      const auto column = std::llround((longitude - place.origin_x) / place.spacing_x);
      const auto row = std::llround((place.origin_y - latitude) / place.spacing_y);
      // The nine samples around; over the join of the map it is six.
      const std::int64_t first = std::clamp<std::int64_t>(column - 1, 0, source->info().width - 3);
      std::int16_t raw[9];
      source->read_window({first, row - 1, 3, 3}, std::as_writable_bytes(std::span(raw)));
      const auto [least, most] = std::minmax_element(std::begin(raw), std::end(raw));
      const double at_longitude = place.origin_x + static_cast<double>(column) * place.spacing_x;
      const double at_latitude = place.origin_y - static_cast<double>(row) * place.spacing_y;
      const RunResult sampled = run_isohf(
          {"sample", folder / "mars.isohf", "--at-lonlat", std::to_string(at_longitude), std::to_string(at_latitude)});
      EXPECT_GE(std::stod(sampled.out), *least - 20.0) << longitude << "," << latitude;
      EXPECT_LE(std::stod(sampled.out), *most + 20.0) << longitude << "," << latitude;
    }
  }
  const double summit = std::stod(run_isohf({"sample", folder / "mars.isohf", "--at-lonlat", "226.2", "18.4"}).out);
  EXPECT_GT(summit, 17000.0);
}

}  // namespace
}  // namespace isohf::test
