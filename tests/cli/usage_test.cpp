/// What the program says about itself, and what it says to a wrong command line.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kCommands = {"plan",   "convert", "info", "verify",  "restore",   "export",
                                            "sample", "shade",   "view", "formats", "experiment"};

std::set<std::string> long_options_in(const std::string& text) {
  std::set<std::string> found;
  const std::regex option("--[a-z][a-z0-9-]+");
  for (std::sregex_iterator at(text.begin(), text.end(), option), end; at != end; ++at) found.insert(at->str());
  return found;
}

/// Expects exit code 2, one line on standard error that holds `message`, and nothing on standard output.
void expect_usage_error(const std::vector<std::string>& arguments, const std::string& message) {
  const RunResult result = run_isohf(arguments);
  SCOPED_TRACE(testing::PrintToString(arguments));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, testing::StartsWith("isohf: "));
  EXPECT_THAT(result.err, HasSubstr(message));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST(Usage, HelpListsEveryCommandAndTheExitCodes) {
  for (const char* argument : {"--help", "-h", "help"}) {
    const RunResult result = run_isohf({argument});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    for (const std::string& command : kCommands) EXPECT_THAT(result.out, HasSubstr("\n  " + command + " "));
    EXPECT_THAT(result.out, HasSubstr("Exit codes: 0 done, 1 failed, 2 wrong usage, 3 "));
  }
}

TEST(Usage, VersionIsOneLineEverywhere) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"--version"}, {"-V"}, {"info", "-V"}, {"convert", "a.tif", "--version"}}) {
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_TRUE(std::regex_match(result.out, std::regex("isohf [0-9]+\\.[0-9]+\\.[0-9]+\n"))) << result.out;
  }
}

TEST(Usage, CommonOptionsMayStandBeforeTheCommand) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_isohf({"--json", "formats"}).out, run_isohf({"formats", "--json"}).out);
  EXPECT_EQ(run_isohf({"-q", "-v", "formats"}).out, "");
  EXPECT_EQ(run_isohf({"-q", "--help"}).out, run_isohf({"--help"}).out);
  write_file(folder / "options.toml", "json = true\n");
  EXPECT_THAT(run_isohf({"--config", folder / "options.toml", "formats"}).out, testing::StartsWith("{"));
  EXPECT_THAT(run_isohf({"--config=" + (folder / "options.toml"), "formats"}).out, testing::StartsWith("{"));
  expect_usage_error({"--jsn", "info", "a.isohf"}, "found --jsn before the command; did you mean --json?");
  expect_usage_error({"--density", "1", "convert"}, "found --density before the command; only common options");
  expect_usage_error({"-q"}, "no command given");
}

TEST(Usage, EveryCommandHasHelpWithExamplesAndNoLineIsTooLong) {
  for (const std::string& command : kCommands) {
    const RunResult result = run_isohf({command, "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_THAT(result.out, HasSubstr("Usage: isohf " + command));
    EXPECT_THAT(result.out, HasSubstr("Examples:\n  isohf " + command));
    EXPECT_EQ(run_isohf({"help", command}).out, result.out);
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 110U) << line;
  }
}

TEST(Usage, HelpKnowsTheOptionsOfTheTask) {
  const std::set<std::string> convert = long_options_in(run_isohf({"convert", "--help"}).out);
  for (const char* option :
       {"--input",   "--output",      "--overwrite",      "--resume",      "--channel",  "--registration", "--nodata",
        "--z-scale", "--z-offset",    "--sample-spacing", "--density",     "--spacing",  "--tiles",        "--fit",
        "--outside", "--shape",       "--levels",         "--triangles",   "--vertices", "--type",         "--z-range",
        "--step",    "--clamp-range", "--filter",         "--acquisition", "--level",    "--threads",      "--progress",
        "--memory",  "--json",        "--quiet",          "--verbose",     "--config",   "--help"}) {
    EXPECT_TRUE(convert.contains(option)) << option;
  }
}

/// The options that --help describes, not those that its text merely names: where a line begins with an option, or with
/// its letter and the option.
std::set<std::string> options_described_in(const std::string& help) {
  std::set<std::string> described;
  const std::regex option("\n +(-[A-Za-z], )?(--[a-z][a-z0-9-]+)");
  for (std::sregex_iterator at(help.begin(), help.end(), option), end; at != end; ++at) described.insert((*at)[2]);
  return described;
}

/// The options that a part of the manual names, from its heading "## ..." to the next such.
std::set<std::string> options_in_section(const std::string& manual, const std::string& heading) {
  const std::size_t begin = manual.find("\n## " + heading + "\n");
  EXPECT_NE(begin, std::string::npos) << heading;
  if (begin == std::string::npos) return {};
  return long_options_in(manual.substr(begin, manual.find("\n## ", begin + 1) - begin));
}

TEST(Usage, TheManualKnowsEveryOptionInTheCommandsOwnPart) {
  const std::string manual = read_file(ISOHF_SOURCE_DIR "/docs/cli.md");
  // What a part says to hold as elsewhere.
  const std::map<std::string, std::vector<std::string>> also = {{"plan", {"Input options", "convert"}},
                                                                {"convert", {"Input options"}},
                                                                {"info", {"Input options"}},
                                                                {"verify", {"Input options"}}};
  for (const std::string& command : kCommands) {
    std::set<std::string> named = options_in_section(manual, "Common options");
    // In the manual's first lines.
    named.insert({"--input", "--output"});
    named.merge(options_in_section(manual, command));
    if (const auto others = also.find(command); others != also.end()) {
      for (const std::string& heading : others->second) named.merge(options_in_section(manual, heading));
    }
    for (const std::string& option : options_described_in(run_isohf({command, "--help"}).out)) {
      EXPECT_TRUE(named.contains(option)) << command << " " << option;
    }
  }
}

TEST(Usage, NearestCommandAndOptionAreNamed) {
  expect_usage_error({}, "no command given");
  expect_usage_error({"plna"}, "unknown command 'plna'; did you mean plan?");
  expect_usage_error({"conv"}, "did you mean convert?");
  expect_usage_error({"xyzzy"}, "unknown command 'xyzzy' (");
  expect_usage_error({"convert", "--densty", "1", "a.tif", "b.isohf"},
                     "unknown option --densty; did you mean --density?");
  expect_usage_error({"convert", "--densty=1", "a.tif", "b.isohf"}, "did you mean --density?");
}

TEST(Usage, MissingAndSuperfluousArgumentsAreNamed) {
  expect_usage_error({"convert"}, "convert: no INPUT given");
  expect_usage_error({"convert", "a.tif"}, "convert: no OUTPUT given");
  expect_usage_error({"sample", "a.isohf", "c"}, "'c' is one argument too many");
  expect_usage_error({"info"}, "no INPUT given");
  expect_usage_error({"verify"}, "no ARCHIVE given");
  expect_usage_error({"sample"}, "no ARCHIVE given");
  expect_usage_error({"convert", "a.tif", "b.isohf", "--density"}, "--density lacks its value");
  expect_usage_error({"sample", "a.isohf", "--at", "1"}, "--at takes 2 values: --at X Z");
  expect_usage_error({"convert", "-o", "a", "-o", "b", "c"}, "--output is given 2 times");
}

struct BadValue {
  const char* option;
  const char* value;
  const char* required;
};

/// The name that the test runner shows; without it the pointers' bytes stand there, other ones in every run.
std::ostream& operator<<(std::ostream& out, const BadValue& bad) {
  return out << bad.option << ' ' << bad.value;
}

class BadValueTest : public testing::TestWithParam<BadValue> {};

TEST_P(BadValueTest, IsRefusedWithWhatWasFoundAndRequired) {
  const BadValue& bad = GetParam();
  const std::string message =
      std::string("convert: ") + bad.option + ": found '" + bad.value + "', must be " + bad.required;
  expect_usage_error({"convert", "a.tif", "b.isohf", bad.option, bad.value}, message);
  expect_usage_error({"convert", "a.tif", "b.isohf", std::string(bad.option) + "=" + bad.value}, message);
}

INSTANTIATE_TEST_SUITE_P(
    Usage, BadValueTest,
    testing::Values(
        BadValue{"--raw", "200x200:u16", "WxH:TYPE"}, BadValue{"--density", "-1", "a number greater than 0"},
        BadValue{"--density", "0", "a number greater than 0"}, BadValue{"--density", "abc", "a number greater than 0"},
        BadValue{"--density", "1x", "a number greater than 0"}, BadValue{"--density", "1 ", "a number greater than 0"},
        BadValue{"--density", "nan", "a number greater than 0"},
        BadValue{"--density", "inf", "a number greater than 0"},
        BadValue{"--density", "1,5", "a number greater than 0"},
        BadValue{"--density", "1e999", "a number greater than 0"},
        BadValue{"--spacing", "-3", "a number greater than 0"},
        BadValue{"--sample-spacing", "0", "a number greater than 0"}, BadValue{"--tiles", "3", "COLUMNSxROWS"},
        BadValue{"--tiles", "0x3", "COLUMNSxROWS"}, BadValue{"--tiles", "3x", "COLUMNSxROWS"},
        BadValue{"--tiles", "-1x3", "COLUMNSxROWS"},
        BadValue{"--shape", "5", "COLUMNSxROWS, two whole numbers from 1 to 32767"},
        BadValue{"--shape", "212x243x4", "COLUMNSxROWS"}, BadValue{"--shape", "99999x5", "COLUMNSxROWS"},
        BadValue{"--levels", "0", "a whole number from 1 to 13"},
        BadValue{"--levels", "14", "a whole number from 1 to 13"},
        BadValue{"--levels", "4.0", "a whole number from 1 to 13"},
        BadValue{"--triangles", "0", "a whole number from 1"}, BadValue{"--vertices", "-5", "a whole number from 1"},
        BadValue{"--threads", "0", "a whole number from 1 to 1024"},
        BadValue{"--threads", "abc", "a whole number from 1 to 1024"},
        BadValue{"--threads", "1025", "a whole number from 1 to 1024"},
        BadValue{"--threads", "99999999999999999999", "a whole number from 1 to 1024"},
        BadValue{"--type", "u17", "u16, u8 or f32"}, BadValue{"--outside", "Void", "cover, clamp or void"},
        BadValue{"--registration", "pixel", "area, point or auto"}, BadValue{"--nodata", "none", "a number or nan"},
        BadValue{"--z-scale", "x", "a finite number"}, BadValue{"--z-offset", "inf", "a finite number"},
        BadValue{"--z-range", "5", "MIN:MAX, two finite numbers"},
        BadValue{"--z-range", "5:1", "MIN:MAX with MIN less than MAX"},
        BadValue{"--z-range", "1:1", "MIN:MAX with MIN less than MAX"},
        BadValue{"--z-range", "nan:1", "MIN:MAX, two finite numbers"},
        BadValue{"--max-rounding", "0", "a number greater than 0"},
        BadValue{"--step", "0", "a number greater than 0, finest or auto"},
        BadValue{"--step", "-1", "a number greater than 0, finest or auto"},
        BadValue{"--step", "fine", "a number greater than 0, finest or auto"},
        BadValue{"--memory", "4X", "a size in bytes such as 400M"},
        BadValue{"--memory", "0", "a size in bytes such as 400M"},
        BadValue{"--memory", "M", "a size in bytes such as 400M"},
        BadValue{"--progress", "bar", "auto, plain, json or none"}));

TEST(Usage, WrongWordsAreAnsweredWithTheNearest) {
  const auto wrong = [](const char* option, const char* value, const char* message) {
    expect_usage_error({"convert", "a.tif", "b.isohf", option, value}, message);
  };
  wrong("--filter", "cubic", "catmull-rom");
  wrong("--filter", "catmul-rom", "; did you mean catmull-rom?");
  wrong("--filter", "Bilinear", "; did you mean bilinear?");
  wrong("--acquisition", "gausian:2", "; did you mean gaussian?");
  wrong("--projection", "lambert", "; did you mean lambert-conformal?");
  wrong("--outside", "vodi", "; did you mean void?");
  expect_usage_error({"restore", "a.isohf", "b.tif", "--method", "bary"}, "; did you mean barycentric?");
  expect_usage_error({"export", "a.isohf", "b.tif", "--type", "u61"}, "; did you mean u16?");
  expect_usage_error({"view", "a.isohf", "--mode", "textures"}, "; did you mean texture?");
  expect_usage_error({"info", "--tile-size", "3"}, "unknown option --tile-size; it belongs to export");
}

TEST(Usage, OptionsThatContradictEachOtherAreRefused) {
  expect_usage_error({"convert", "a", "b.isohf", "--density", "1", "--spacing", "2"}, "excludes");
  expect_usage_error({"convert", "a", "b.isohf", "--shape", "5x5", "--triangles", "200"}, "excludes");
  expect_usage_error({"convert", "a", "b.isohf", "--density", "1", "--density", "1"}, "--density is given 2 times");
  expect_usage_error({"convert", "a", "b.isohf", "--clamp-range"}, "--clamp-range needs --z-range");
  expect_usage_error({"plan", "--density", "1"}, "--density needs an INPUT");
  expect_usage_error({"plan", "--table1", "--levels", "3"}, "--table1 takes no --levels");
  expect_usage_error({"verify", "a", "--max-error", "1"}, "--max-error needs --against");
}

/// What TAB offers after the program's name and `words`, the last of which is begun.
std::string completions_of(const std::string& words, int at) {
  const std::string script = "source " ISOHF_SOURCE_DIR "/apps/isohf/completion.bash; COMP_WORDS=(" + isohf_path() +
                             words + "); COMP_CWORD=" + std::to_string(at) + "; _isohf; echo \"${COMPREPLY[@]}\"";
  return run_program({"/bin/bash", "-c", script}).out;
}

TEST(Usage, BashCompletesCommandsAndOptions) {
  EXPECT_EQ(completions_of(" co", 1), "convert\n");
  EXPECT_EQ(completions_of(" convert --dens", 2), "--density\n");
  EXPECT_EQ(completions_of(" sample --a", 2), "--at --at-lonlat --at-crs\n");
  EXPECT_EQ(completions_of(" --js", 1), "--json\n");
  EXPECT_EQ(completions_of(" --json co", 2), "convert\n");
  EXPECT_EQ(completions_of(" --config my.toml co", 3), "convert\n");
  EXPECT_EQ(completions_of(" help co", 2), "convert\n");
  EXPECT_EQ(completions_of(" view --mode t", 3), "texture\n");
}

TEST(Usage, BashCompletesEveryCommandOptionAndWord) {
  const std::string commands = " " + completions_of(" ''", 1);
  for (const std::string& command : kCommands) {
    EXPECT_THAT(commands, HasSubstr(" " + command + " "));
    const std::string help = run_isohf({command, "--help"}).out;
    const std::set<std::string> offered = long_options_in(completions_of(" " + command + " --", 2));
    EXPECT_EQ(offered, options_described_in(help)) << command;
  }
  EXPECT_EQ(completions_of(" restore --method h", 3), "hex\n");
  EXPECT_EQ(completions_of(" shade --palette g", 3), "gray\n");
  EXPECT_EQ(completions_of(" experiment --fit i", 3), "interpolate\n");
  // Of convert and plan it is a flag.
  EXPECT_EQ(completions_of(" convert --fit interpol", 3), "\n");
}

TEST(Usage, ScriptsEndWithCode2OnWrongOptions) {
  for (const char* script : {"check", "setup", "flight", "accuracy_table"}) {
    const std::string path = std::string(ISOHF_SOURCE_DIR "/scripts/") + script;
    EXPECT_EQ(run_program({"/bin/bash", path, "--bogus"}).exit_code, 2) << script;
    EXPECT_EQ(run_program({"/bin/bash", path, "--help"}).exit_code, 0) << script;
  }
}

TEST(Usage, FailureToWriteStandardOutputIsReported) {
  RunOptions full;
  full.output_path = "/dev/full";
  const RunResult result = run_isohf({"plan"}, full);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "isohf: standard output: No space left on device\n");
}

TEST(Usage, ReaderThatLeavesIsNoMessage) {
  RunOptions closed;
  closed.close_output = true;
  const RunResult result = run_isohf({"plan"}, closed);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace isohf::test
