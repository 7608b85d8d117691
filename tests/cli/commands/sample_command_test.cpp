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
  const std::vector<std::string> sun = {"sample", archive,           "--at", "1000", "1000", "--shadow", "--azimuth",
                                        "E",      "--sun-elevation", "8"};
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
  EXPECT_EQ(run_isohf({"sample", archive, "--at", "50", "50", "--shadow"}).out, "void\n");
}

TEST_F(SampleCommand, RefusesASunThatCastsNoShadow) {
  const std::string archive = folder / "plane.isohf";
  const auto refused = [&](const std::vector<std::string>& more) {
    const RunResult result = run_isohf(with_more({"sample", archive, "--at", "1000", "1000"}, more));
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  using testing::HasSubstr;
  EXPECT_THAT(refused({"--above", "3"}), HasSubstr("--above is for --shadow, which is not given"));
  EXPECT_THAT(refused({"--shadow", "--above", "-3"}), HasSubstr("must be 0 or more"));
  EXPECT_THAT(refused({"--shadow", "--sun-elevation", "90"}),
              HasSubstr("the sun must stand above 0 and below 90 degrees"));
  EXPECT_THAT(refused({"--shadow", "--azimuth", "NW"}), HasSubstr("must be degrees from 0 to 360, or N, E, S, W"));
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
              std::string("isohf: standard input, line 3: found '") + bad + "', must be 'x z', two numbers\n");
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1);
  }
}

TEST_F(SampleCommand, PlacesTakeACommaAsWellAsABlank) {
  const RunResult apart = run_isohf({"sample", folder / "plane.isohf", "--at", "1000", "900", "--at", "-5", "7"});
  ASSERT_EQ(apart.exit_code, 0) << apart.err;
  for (const std::vector<std::string>& places :
       std::vector<std::vector<std::string>>{{"--at", "1000,900", "--at", "-5,7"},
                                             {"--at=1000,900", "--at", "-5,", "7"},
                                             {"--at", "1000", "900", "--at=-5,7"}}) {
    const RunResult result = run_isohf(with_more(with_more({"sample"}, places), {folder / "plane.isohf"}));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, apart.out);
  }
  EXPECT_EQ(run_isohf({"sample", folder / "plane.isohf", "--at", "1,2,3"}).exit_code, 2);
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
