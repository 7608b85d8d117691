/// --config: one TOML file for all commands.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

class ConfigFile : public testing::Test {
 protected:
  [[nodiscard]] RunResult run(const std::string& content, std::vector<std::string> arguments) const {
    write_file(path_, content);
    arguments.insert(arguments.end(), {"--config", path_});
    return run_isohf(arguments);
  }
  /// The file does what these words do.
  void expect_same(const std::string& content, const std::vector<std::string>& arguments,
                   const std::vector<std::string>& words) const {
    SCOPED_TRACE(content);
    const RunResult result = run(content, arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, run_isohf(with_more(arguments, words)).out);
  }
  /// Exit code 2 and one line that names file and line.
  void expect_refused(const std::string& content, const std::vector<std::string>& arguments, int line,
                      const std::string& message) const {
    SCOPED_TRACE(content);
    const RunResult result = run(content, arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, testing::HasSubstr(path_ + ":" + std::to_string(line) + ": " + message));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "options.toml";
  const std::string coast_ = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
};

TEST_F(ConfigFile, TopLevelHoldsForEveryCommandThatKnowsTheKeyAndSectionsForTheirs) {
  const std::string content =
      "# for all\njson = true\nsurface = true\nlevels = 3\n\n[plan]\nlevels = 2\n\n[info]\nstats = true\n"
      "[view]\nsize = '640x480'\n";
  expect_same(content, {"plan"}, {"--json", "--levels", "2"});
  expect_same(content, {"info", coast_}, {"--json", "--stats"});
}

TEST_F(ConfigFile, CommandLineGoesBeforeSectionsAndThoseBeforeTheTopLevel) {
  expect_same("levels = 3\n", {"plan", "--levels", "1"}, {});
  expect_same("json = true\n[plan]\njson = false\n", {"plan"}, {});
  // What contradicts it gives way too.
  expect_same("density = 0.5\n", {"plan", coast_, "--spacing", "60"}, {});
  expect_same("density = 0.5\n[plan]\nspacing = 60\n", {"plan", coast_}, {"--spacing", "60"});
  EXPECT_EQ(run("density = 0.5\nspacing = 60\n", {"plan", coast_}).exit_code, 2);
}

TEST_F(ConfigFile, ArraysServeListsAndOptionsThatRepeat) {
  const std::string archive = folder_ / "a.isohf";
  ASSERT_EQ(run("[convert]\nfill = 50\nquiet = true\n", {"convert", coast_, archive}).err, "");
  expect_same("[sample]\nat = ['1000,2000.5', '3000,1']\n", {"sample", archive},
              {"--at", "1000,2000.5", "--at", "3000,1"});
}

TEST_F(ConfigFile, MistakesAreNamedWithTheirLine) {
  expect_refused("json = true\nlevelss = 3\n", {"plan"}, 2, "no option is called 'levelss'; did you mean --levels?");
  expect_refused("[sample]\nresume = true\n", {"plan"}, 2, "sample has no option 'resume'");
  expect_refused("[convert]\n\ndensty = 1\n", {"plan"}, 3, "convert has no option 'densty'; did you mean --density?");
  expect_refused("[convrt]\nlevel = 3\n", {"plan"}, 2, "no command is called [convrt]; did you mean convert?");
  for (const char* key : {"help", "version", "config"})
    expect_refused(std::string(key) + " = true\n", {"plan"}, 1, "no option is called '" + std::string(key) + "'");
  expect_refused("overwrite = \"yes\"\n", {"convert", "a", "b"}, 1, "overwrite: found 'yes', must be true or false");
  expect_refused("\ndensity = [1, 2]\n", {"plan", coast_}, 2, "density: found an array, must be ");
  expect_refused("density = 1979-05-27\n", {"plan", coast_}, 1, "density: found ");
  expect_refused("density = -1\n", {"plan", coast_}, 1, "density: found '-1', must be a number greater than 0");
  expect_refused("levels = 3\ntype = u8\n", {"plan"}, 2, "not TOML: ");
  expect_refused("levels = 1\nlevels = 2\n", {"plan"}, 2, "not TOML: ");
}

}  // namespace
}  // namespace isohf::test
