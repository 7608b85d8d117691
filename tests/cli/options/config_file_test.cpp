/// --config: one TOML file for all commands.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;

class ConfigFile : public testing::Test {
 protected:
  [[nodiscard]] RunResult run(const std::string& content, std::vector<std::string> arguments) const {
    write_file(path_, content);
    arguments.insert(arguments.end(), {"--config", path_});
    return run_isohf(arguments);
  }
  [[nodiscard]] std::string out_of(const std::string& content, const std::vector<std::string>& arguments) const {
    const RunResult result = run(content, arguments);
    EXPECT_EQ(result.exit_code, 0) << content;
    EXPECT_EQ(result.err, "") << content;
    return result.out;
  }
  /// Exit code 2 and one line that names file and line.
  void expect_refused(const std::string& content, const std::vector<std::string>& arguments, int line,
                      const std::string& message) const {
    const RunResult result = run(content, arguments);
    SCOPED_TRACE(content);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(result.err.substr(0, result.err.find(path_)), "isohf: " + arguments.front() + ": ");
    EXPECT_THAT(result.err, HasSubstr(path_ + ":" + std::to_string(line) + ": " + message));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "options.toml";
  const std::string coast_ = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
};

TEST_F(ConfigFile, TopLevelHoldsForEveryCommandThatKnowsTheKeyAndSectionsForTheirs) {
  const std::string content =
      "# for all\njson = true\nlevels = 3\n\n[plan]\nlevels = 2\n\n[info]\nstats = true\n[sample]\nlonlat = true\n";
  EXPECT_EQ(out_of(content, {"plan"}), run_isohf({"plan", "--json", "--levels", "2"}).out);
  EXPECT_EQ(out_of(content, {"info", coast_}), run_isohf({"info", coast_, "--json", "--stats"}).out);
}

TEST_F(ConfigFile, KeysOfTheTopLevelThatDoNotFitACommandAreNoMistake) {
  // plan without an input refuses --density that is typed; a file for all commands may hold it.
  EXPECT_EQ(out_of("density = 0.5\nresume = true\n", {"plan"}), run_isohf({"plan"}).out);
  expect_refused("[plan]\nresume = true\n", {"plan"}, 2, "plan has no option 'resume'; it belongs to convert");
}

TEST_F(ConfigFile, CommandLineGoesBeforeSectionsAndThoseBeforeTheTopLevel) {
  EXPECT_EQ(out_of("levels = 3\n", {"plan", "--levels", "1"}), run_isohf({"plan", "--levels", "1"}).out);
  EXPECT_EQ(out_of("json = true\n", {"plan", "--json=false"}), run_isohf({"plan"}).out);
  EXPECT_EQ(out_of("json = true\n[plan]\njson = false\n", {"plan"}), run_isohf({"plan"}).out);
  // What contradicts it gives way too.
  EXPECT_EQ(out_of("density = 0.5\n", {"plan", coast_, "--tiles", "2x2"}),
            run_isohf({"plan", coast_, "--tiles", "2x2"}).out);
  EXPECT_EQ(out_of("density = 0.5\n[plan]\nspacing = 60\n", {"plan", coast_}),
            run_isohf({"plan", coast_, "--spacing", "60"}).out);
  expect_refused("density = 0.5\nspacing = 60\n", {"plan", coast_}, 1, "density excludes ");
}

TEST_F(ConfigFile, ArraysServeListsPairsAndOptionsThatRepeat) {
  const std::string archive = folder_ / "a.isohf";
  ASSERT_EQ(
      run("[convert]\nnodata = [-9999, -32768]\nshadow-seeds = true\nquiet = true\n", {"convert", coast_, archive}).err,
      "");
  EXPECT_EQ(out_of("[sample]\nat = [[1000, 2000.5], [3000, 1]]\n", {"sample", archive}),
            run_isohf({"sample", archive, "--at", "1000", "2000.5", "--at", "3000", "1"}).out);
  EXPECT_EQ(out_of("at = [1000, 2000]\n", {"sample", archive}),
            run_isohf({"sample", archive, "--at", "1000", "2000"}).out);
  EXPECT_EQ(run("[verify]\nagainst = ['" + coast_ + "']\nmax-rms = 1e9\n", {"verify", archive}).exit_code, 0);
}

TEST_F(ConfigFile, WrongKeysAndSectionsAreNamedWithTheirLineAndTheNearest) {
  expect_refused("json = true\nlevelss = 3\n", {"plan"}, 2, "no option is named 'levelss'; did you mean levels?");
  expect_refused("[convert]\ndensty = 1\n", {"plan"}, 2, "convert has no option 'densty'; did you mean density?");
  expect_refused("[convert]\n\ntile-size = 3\n", {"info"}, 3,
                 "convert has no option 'tile-size'; it belongs to export");
  expect_refused("[convrt]\nlevel = 3\n", {"convert"}, 2, "no command is called [convrt]; did you mean convert?");
  expect_refused("help = true\n", {"plan"}, 1, "no option is named 'help'");
  expect_refused("config = 'a'\n", {"plan"}, 1, "no option is named 'config'");
}

TEST_F(ConfigFile, WrongTypesAndValuesAreNamedWithTheirLine) {
  expect_refused("overwrite = \"yes\"\n", {"convert", "a", "b"}, 1, "overwrite: found \"yes\", must be true or false");
  expect_refused("overwrite = 1\n", {"convert", "a", "b"}, 1, "overwrite: found 1, must be true or false");
  expect_refused("\ndensity = [1, 2]\n", {"plan"}, 2, "density: found an array, must be one value");
  expect_refused("density = true\n", {"plan"}, 1, "density: found true, must be RATIO");
  expect_refused("density = -1\n", {"plan"}, 1, "density: found '-1', must be a number greater than 0");
  expect_refused("density = 1979-05-27\n", {"plan"}, 1, "density: is a date, a time or a table");
  expect_refused("at = [1]\n", {"sample", "a"}, 1, "at: found an array, must be an array of 2 values");
  expect_refused("type = \"u17\"\n", {"plan"}, 1, "type: found 'u17', must be u16, u8 or f32; did you mean u16?");
}

TEST_F(ConfigFile, WhatIsNoTomlIsRefusedWithItsLine) {
  expect_refused("levels = 3\ntype = u8\n", {"plan"}, 2, "TOML wants text in quotes: type = \"u8\"");
  expect_refused("shape = 212x243\n", {"plan"}, 1, "TOML wants text in quotes: shape = \"212x243\"");
  expect_refused("[plan\n", {"plan"}, 1, "is no TOML: ");
  expect_refused("levels = 1\nlevels = 2\n", {"plan"}, 2, "is no TOML: ");
  const RunResult missing = run_isohf({"plan", "--config", folder_ / "missing.toml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(missing.err, "isohf: plan: --config: " + (folder_ / "missing.toml") + ": No such file or directory\n");
}

}  // namespace
}  // namespace isohf::test
