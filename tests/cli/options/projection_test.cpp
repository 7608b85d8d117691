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

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/degree_grid.h"
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
    const RunResult result =
        run_isohf(with_more({"convert", folder / "wide.flt", folder / "a.isohf", "--overwrite"}, more));
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
    EXPECT_THAT(result.out, HasSubstr(" lambert-conformal around longitude 8, true at latitudes 43.3333 and "
                                      "48.6667; lengths err by up to 0."));
    EXPECT_THAT(result.out, HasSubstr("errs least among the conformal kinds; equirectangular would err by"));
  }
  const json plan = json::parse(isohf({"plan", folder / "wide.flt", "--json"}).out);
  const json info = json::parse(isohf({"info", folder / "a.isohf", "--json"}).out);
  EXPECT_EQ(plan.at("projection"), info.at("metadata").at("projection"));
  EXPECT_EQ(plan.at("projection").at("kind"), "lambert-conformal");
  EXPECT_EQ(plan.at("wraps_x"), false);
}

TEST_F(ProjectionCommand, WhatDoesNotGoTogetherIsRefusedInOneLine) {
  const std::string wide = folder / "wide.flt";
  const std::string out = folder / "b.isohf";
  refuses({"convert", wide, out, "--to-crs", "mercator"}, "--to-crs: found 'mercator', must be one of auto");
  refuses({"convert", wide, out, "--to-crs", "polar-stereographic:-60"}, "--to-crs lambert-conformal works");
  refuses({"convert", wide, out, "--wrap-x"}, "240 columns 0.05 apart make 12");
  refuses({"convert", wide, out, "--geoid", "egm.tif"}, "must be a geoid's FILE.pgm");
  refuses({"convert", wide, out, "--geoid", folder / "egm.pgm"}, "egm.pgm: no such file", 1);
  refuses({"convert", wide, out, "--geoid", folder / "egm.pgm", "--lossless"}, "give one of the two");
  converts({"--to-crs", "utm"});
  write_degrees(folder / "small", 40, 30, 2.0, 42.0, 0.05, land);
  refuses({"verify", folder / "a.isohf", "--against", folder / "small.flt"}, "40x30 samples");
  fs::remove(folder / "wide.prj");
  write_degrees(folder / "metres", 20, 20, 0.0, 0.0, 30.0, land);
  fs::remove(folder / "metres.prj");
  refuses({"convert", folder / "metres.flt", out, "--to-crs", "utm"}, "needs an input in degrees");
}

TEST_F(ProjectionCommand, LosslessGivesTheInputBackThroughEveryKind) {
  const std::string input = read_file(folder / "wide.flt");
  const std::string plain = [&] {
    converts({"--to-crs", "equirectangular", "--lossless"});
    return read_file(folder / "a.isohf");
  }();
  for (const std::string kind :
       {"auto", "local", "transverse-mercator", "utm", "lambert-conformal", "polar-stereographic:45"}) {
    SCOPED_TRACE(kind);
    converts({"--to-crs", kind, "--lossless", "-j", "1"});
    const std::string one = read_file(folder / "a.isohf");
    converts({"--to-crs", kind, "--lossless", "-j", "3"});
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
    ASSERT_EQ(isohf({"export", folder / "a.isohf", folder / "map.tif", "--overwrite", "--to-crs", "none"}).exit_code,
              0);
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
  converts({"--to-crs", "transverse-mercator", "--shadow-seeds"});
  ASSERT_EQ(isohf({"shade", folder / "a.isohf", "-o", folder / "a.tif", "--size", "300x200"}).exit_code, 0);
  ASSERT_EQ(isohf({"export", folder / "a.isohf", folder / "b.tif", "--size", "300x200", "--to-crs", "none"}).exit_code,
            0);
  OpenOptions green;
  green.channel = "1";
  const Georeference drawn = open_raster(folder / "a.tif", green)->info().georeference;
  const Georeference exported = open_raster(folder / "b.tif", {})->info().georeference;
  EXPECT_NEAR(drawn.origin_x, exported.origin_x, 1e-6);
  EXPECT_NEAR(drawn.origin_y, exported.origin_y, 1e-6);
  EXPECT_NEAR(drawn.spacing_x, exported.spacing_x, 1e-9);
  EXPECT_EQ(isohf({"verify", folder / "a.isohf"}).exit_code, 0);
}

TEST(MarsMegdr, LandsAtItsRadiusAndLongitude) {
  const std::string label = real_data() / "megt90n000cb.lbl";
  if (!fs::exists(label)) GTEST_SKIP() << kNoRealFiles;
  const TemporaryFolder folder;
  const auto source = open_raster(label, {});
  const Georeference& place = source->info().georeference;
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, std::vector<std::string>{"--wrap-x", "--filter", "bspline3"}}) {
    ASSERT_EQ(run_isohf(with_more({"convert", label, folder / "mars.isohf", "--overwrite"}, more)).exit_code, 0);
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
      const RunResult sampled = run_isohf({"sample", folder / "mars.isohf", "--in", "lonlat", "--at",
                                           std::to_string(at_longitude) + "," + std::to_string(at_latitude)});
      EXPECT_GE(std::stod(sampled.out), *least - 20.0) << longitude << "," << latitude;
      EXPECT_LE(std::stod(sampled.out), *most + 20.0) << longitude << "," << latitude;
    }
  }
  const double summit =
      std::stod(run_isohf({"sample", folder / "mars.isohf", "--in", "lonlat", "--at", "226.2,18.4"}).out);
  EXPECT_GT(summit, 17000.0);
}

}  // namespace
}  // namespace isohf::test
