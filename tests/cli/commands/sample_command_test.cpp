#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;

constexpr double kSlopeX = 0.25;  // rise per metre
constexpr double kSlopeZ = -0.125;
constexpr double kSpacing = 10.0;  // metres

/// A plane over 200 x 150 samples on posts; its North-West quarter of 40 x 40 samples is void.
class SampleCommand : public testing::Test {
 protected:
  SampleCommand() {
    write_float_tiff(folder / "plane.tif", 200, 150, [](std::int64_t c, std::int64_t r) {
      if (c < 40 && r < 40) return std::numeric_limits<float>::quiet_NaN();
      return static_cast<float>(1000.0 + kSlopeX * kSpacing * static_cast<double>(c) +
                                kSlopeZ * kSpacing * static_cast<double>(r));
    });
    const RunResult result =
        run_isohf({"convert", folder / "plane.tif", folder / "plane.isohf", "--sample-spacing", "10", "--registration",
                   "point", "--type", "f32", "--shape", "28x35", "--levels", "2"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  TemporaryFolder folder;
};

/// The plane's edge in the East shadows all of it from a sun there that stands lower than it rises.
TEST_F(SampleCommand, ShadowsReachAsHighAsTheEdgeTowardsTheSunLetsThem) {
  const std::string archive = folder / "plane.isohf";
  const double surface = 1000.0 + kSlopeX * 1000.0 + kSlopeZ * 1000.0;
  const double edge = surface + kSlopeX * 990.0 - 990.0 * std::tan(8.0 * 0.017453292519943295);
  const std::vector<std::string> sun = {"sample", archive, "--at", "1000,1000", "--shadow", "--sun", "90,8"};
  const auto with = [&](const std::vector<std::string>& more) { return run_isohf(with_more(sun, more)); };
  double numbers[8] = {};
  std::istringstream text(with({}).out);
  for (double& number : numbers) text >> number;
  EXPECT_NEAR(numbers[0], surface, 1e-3);
  EXPECT_NEAR(numbers[6], edge, kSlopeX * 3.0 * kSpacing);  // the surface is level from a lattice step before the edge
  EXPECT_EQ(numbers[7], 0.0);
  const double above = numbers[6] - numbers[0];
  // As much is seen as of the sun's disc stands above the edge.
  constexpr double kDegree = 0.017453292519943295;
  for (const double higher_deg : {-0.4, -0.2, 0.0, 0.1, 0.4}) {
    const double height = above + 990.0 * (std::tan(8.0 * kDegree) - std::tan((8.0 + higher_deg) * kDegree));
    const json line = json::parse(with({"--json", "--above", std::to_string(height)}).out);
    EXPECT_NEAR(line.at("shadow").at("sun_share").get<double>(),
                std::clamp(0.5 - higher_deg / (2.0 * 959.63 / 3600.0), 0.0, 1.0), 0.02)
        << higher_deg;
  }
  EXPECT_EQ(run_isohf({"sample", archive, "--at", "50,50", "--shadow"}).out, "void\n");
}

TEST_F(SampleCommand, RefusesASunThatCastsNoShadow) {
  const std::string archive = folder / "plane.isohf";
  const auto refused = [&](const std::vector<std::string>& more) {
    const RunResult result = run_isohf(with_more({"sample", archive, "--at", "1000,1000"}, more));
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  using testing::HasSubstr;
  EXPECT_THAT(refused({"--above", "3"}), HasSubstr("--above requires --shadow"));
  EXPECT_THAT(refused({"--time", "3"}), HasSubstr("--time requires --date"));
  EXPECT_THAT(refused({"--shadow", "--time", "3"}), HasSubstr("--time requires --date"));
  EXPECT_THAT(refused({"--shadow", "--above", "-3"}), HasSubstr("must be a number from 0"));
  EXPECT_THAT(refused({"--shadow", "--sun", "270,90"}), HasSubstr("the sun must stand above 0 and below 90 degrees"));
  EXPECT_THAT(refused({"--shadow", "--sun", "NW,8"}), HasSubstr("--sun: found 'NW,8'"));
  EXPECT_THAT(refused({"--shadow", "--date", "2026-06-21"}), HasSubstr("date"));
}

TEST_F(SampleCommand, VoidOutsideCommentsAndBlankLines) {
  RunOptions input;
  input.input = "# places\n\n100 100\r\n\t 1000 ,  1000 \n-1 5\n5 1e9\n1000 1000";
  const RunResult result = run_isohf({"sample", folder / "plane.isohf"}, input);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::istringstream stream(result.out);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0], "void");
  EXPECT_NEAR(std::stod(lines[1]), 1125.0, 5e-4);  // floats of 1125 lie 1.2e-4 apart
  EXPECT_EQ(lines[2], "outside");
  EXPECT_EQ(lines[3], "outside");
  EXPECT_EQ(lines[4], lines[1]);
}

TEST_F(SampleCommand, BadLineIsNamedAfterTheAnswersBeforeIt) {
  for (const char* bad : {"1000", "1000 abc", "1000 1000 1000", "nan 5", "1000,,1000", "1000 1000x"}) {
    RunOptions input;
    input.input = std::string("1000 1000\n# comment\n") + bad + "\n1000 1000\n";
    const RunResult result = run_isohf({"sample", folder / "plane.isohf"}, input);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.err,
              std::string("isohf sample: standard input, line 3: found '") + bad + "', must be 'x z', two numbers\n");
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1);
  }
}

TEST_F(SampleCommand, PlacesAreTwoNumbers) {
  const RunResult apart = run_isohf({"sample", folder / "plane.isohf", "--at", "1000,900", "--at", "-5,7"});
  ASSERT_EQ(apart.exit_code, 0) << apart.err;
  EXPECT_EQ(run_isohf({"sample", "--at=1000 900", folder / "plane.isohf", "--at=-5 , 7"}).out, apart.out);
  for (const char* wrong : {"1,2,3", "1", "1,x", "1,", "inf,2", ""}) {
    EXPECT_EQ(run_isohf({"sample", folder / "plane.isohf", "--at", wrong}).exit_code, 2) << wrong;
  }
}

/// One place, in every kind of coordinates: the archive lies in UTM zone 32N.
TEST_F(SampleCommand, PlacesAreReadAndPrintedInAnyCoordinates) {
  std::string grid = "ncols 60\nnrows 50\nxllcorner 399000\nyllcorner 5000000\ncellsize 20\n";
  for (int i = 0; i < 60 * 50; ++i) grid += std::to_string(i % 60) + ' ';
  write_file(folder / "utm.asc", grid);
  ASSERT_EQ(run_isohf({"convert", folder / "utm.asc", folder / "utm.isohf", "--crs", "EPSG:32632", "-q"}).exit_code, 0);
  const auto sample = [&](const std::vector<std::string>& more) {
    return run_isohf(with_more({"sample", folder / "utm.isohf"}, more));
  };
  const std::vector<std::string> way_there = {"--at",   "399500,5000600", "--in",   "crs",
                                              "--with", "EPSG:2056",      "--with", "lonlat"};
  const RunResult answer = sample(with_more(way_there, {"--json"}));
  ASSERT_EQ(answer.exit_code, 0) << answer.err;
  const json there = json::parse(answer.out);
  EXPECT_EQ(there.at("x"), 500.0);
  EXPECT_EQ(there.at("z"), 400.0);
  EXPECT_EQ(there.at("crs").at("x"), 399500.0);
  const double longitude = there.at("lonlat").at("longitude").get<double>();
  const double latitude = there.at("lonlat").at("latitude").get<double>();
  EXPECT_NEAR(longitude, 7.7275, 0.01);
  const double east = there.at("with").at("EPSG:2056").at("x").get<double>();
  const double north = there.at("with").at("EPSG:2056").at("y").get<double>();
  EXPECT_GT(east, 2.0e6);
  // The text has the same, in the order in which it was asked for.
  std::istringstream words(sample(way_there).out);
  double numbers[10] = {};
  for (double& number : numbers) words >> number;
  EXPECT_NEAR(numbers[0], there.at("elevation").get<double>(), 1e-6);
  EXPECT_NEAR(numbers[6], east, 1e-4);
  EXPECT_NEAR(numbers[8], longitude, 1e-9);
  // And back from each of them.
  write_file(folder / "swiss.prj",
             "+proj=somerc +lat_0=46.9524055555556 +lon_0=7.43958333333333 +k_0=1 +x_0=2600000 "
             "+y_0=1200000 +ellps=bessel +towgs84=674.374,15.056,405.346,0,0,0,0 +units=m");
  for (const auto& [system, place] :
       std::vector<std::pair<std::string, std::string>>{{"lonlat", fmt::format("{},{}", longitude, latitude)},
                                                        {"EPSG:4326", fmt::format("{},{}", longitude, latitude)},
                                                        {"EPSG:2056", fmt::format("{},{}", east, north)},
                                                        {folder / "swiss.prj", fmt::format("{},{}", east, north)}}) {
    const RunResult back = sample({"--at", place, "--in", system, "--json"});
    ASSERT_EQ(back.exit_code, 0) << back.err;
    EXPECT_NEAR(json::parse(back.out).at("x").get<double>(), 500.0, 2.0) << system;
    EXPECT_NEAR(json::parse(back.out).at("z").get<double>(), 400.0, 2.0) << system;
  }
  EXPECT_THAT(sample({"--at", "1,1", "--in", "lonlta"}).err, testing::HasSubstr("lonlta"));
  // An archive that does not say where it lies has world coordinates alone.
  const RunResult nowhere = run_isohf({"sample", folder / "plane.isohf", "--at", "1,1", "--in", "EPSG:2056"});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_EQ(nowhere.out, "");
}

TEST_F(SampleCommand, AWarningSaysHowAPlaceOutsideMayHaveBeenMeant) {
  std::string grid = "ncols 60\nnrows 50\nxllcorner 7\nyllcorner 46\ncellsize 0.001\n";
  for (int i = 0; i < 60 * 50; ++i) grid += "1 ";
  write_file(folder / "alps.asc", grid);
  ASSERT_EQ(run_isohf({"convert", folder / "alps.asc", folder / "alps.isohf", "--crs", "EPSG:4326", "-q"}).exit_code,
            0);
  const auto hint = [&](const std::string& place, const std::string& in) {
    const RunResult result = run_isohf({"sample", folder / "alps.isohf", "--at", place, "--in", in});
    EXPECT_EQ(result.out, "outside\n");
    EXPECT_EQ(result.exit_code, 0);
    return result.err;
  };
  using testing::HasSubstr;
  EXPECT_THAT(hint("46.02,7.03", "lonlat"), HasSubstr("read as latitude, longitude it lies inside"));
  EXPECT_THAT(hint("347500,5098500", "crs"), HasSubstr("easting, northing in UTM zone 32N"));
  EXPECT_EQ(hint("-20,-30", "lonlat"), "");
}

TEST_F(SampleCommand, ALineIsAnsweredBeforeTheNextIsSent) {
  // A shell that sends the second line only once it has read the first answer: would wait for ever if that came late.
  const std::string script = "coproc isohf sample " + (folder / "plane.isohf") +
                             "; echo '1000 1000' >&${COPROC[1]}; read -t 20 -u ${COPROC[0]} first || exit 9; "
                             "echo '1000,900' >&${COPROC[1]}; read -t 20 -u ${COPROC[0]} second || exit 9; "
                             "echo \"$first\"; echo \"$second\"";
  const std::string path = isohf_path();
  const RunResult result =
      run_program({"/bin/bash", "-c", "PATH=" + path.substr(0, path.rfind('/')) + ":$PATH; " + script});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, run_isohf({"sample", folder / "plane.isohf", "--at", "1000,1000", "--at", "1000,900"}).out);
}

TEST_F(SampleCommand, AnswersComeBeforeMoreIsAskedFor) {
  // A closed output is noticed although more input would follow.
  RunOptions closed;
  closed.close_output = true;
  for (int i = 0; i < 1000; ++i) closed.input += "1000 1000\n";
  const RunResult result = run_isohf({"sample", folder / "plane.isohf"}, closed);
  EXPECT_EQ(result.exit_code, 141);  // SIGPIPE
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace isohf::test
