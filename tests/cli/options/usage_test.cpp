/// What the program says about itself, and what it says to a wrong command line.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kCommands = {"plan",   "convert", "info", "verify", "export",
                                            "sample", "shade",   "view", "formats"};

std::set<std::string> long_options_in(const std::string& text) {
  std::set<std::string> found;
  const std::regex option("--[a-z][a-z0-9-]+");
  for (std::sregex_iterator at(text.begin(), text.end(), option), end; at != end; ++at) found.insert(at->str());
  return found;
}

TEST(Usage, HelpIsAskedForInThreeWays) {
  for (const char* argument : {"--help", "-h", "help"}) {
    const RunResult result = run_isohf({argument});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, run_isohf({"--help"}).out);
    EXPECT_NE(result.out, "");
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
    named.insert("--output");
    named.merge(options_in_section(manual, command));
    if (const auto others = also.find(command); others != also.end()) {
      for (const std::string& heading : others->second) named.merge(options_in_section(manual, heading));
    }
    for (const std::string& option : options_described_in(run_isohf({command, "--help"}).out)) {
      EXPECT_TRUE(named.contains(option)) << command << " " << option;
    }
  }
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
  EXPECT_EQ(completions_of(" sample --at", 2), "--at --at-lonlat --at-crs\n");
  EXPECT_EQ(completions_of(" --js", 1), "--json\n");
  EXPECT_EQ(completions_of(" --json co", 2), "convert\n");
  EXPECT_EQ(completions_of(" --config my.toml co", 3), "convert\n");
  EXPECT_EQ(completions_of(" help co", 2), "convert\n");
  EXPECT_EQ(completions_of(" view --mode t", 3), "texture\n");
  EXPECT_EQ(completions_of(" convert --filter bs", 3), "bspline3\n");
  EXPECT_EQ(completions_of(" info " ISOHF_SOURCE_DIR "/READ", 2), ISOHF_SOURCE_DIR "/README.md\n");
}

TEST(Usage, BashCompletesEveryCommandOptionAndWord) {
  const std::string commands = " " + completions_of(" ''", 1);
  for (const std::string& command : kCommands) {
    EXPECT_THAT(commands, HasSubstr(" " + command + " "));
    const std::string help = run_isohf({command, "--help"}).out;
    const std::set<std::string> offered = long_options_in(completions_of(" " + command + " --", 2));
    EXPECT_EQ(offered, options_described_in(help)) << command;
  }
  EXPECT_EQ(completions_of(" export --method h", 3), "hex\n");
  EXPECT_EQ(completions_of(" shade --palette g", 3), "gray\n");
  // Of convert and plan it is a flag.
  EXPECT_EQ(completions_of(" convert --fit interpol", 3), "\n");
}

TEST(Usage, ReaderThatLeavesIsNoMessage) {
  RunOptions closed;
  closed.close_output = true;
  const RunResult result = run_isohf({"plan"}, closed);
  EXPECT_EQ(result.exit_code, 128 + SIGPIPE);
  EXPECT_EQ(result.err, "");
}

TEST(Usage, VersionAndHelpAreDocumentsWhereTheseAreAskedFor) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--json", "--version"}, {"info", "--json", "-V"}}) {
    const nlohmann::json document = nlohmann::json::parse(run_isohf(arguments).out);
    EXPECT_EQ(document.at("name"), "isohf");
    EXPECT_EQ("isohf " + document.at("version").get<std::string>() + "\n", run_isohf({"-V"}).out);
  }
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--help"}, {"convert", "--help"}, {"help", "convert"}}) {
    std::vector<std::string> asked = arguments;
    asked.push_back("--json");
    EXPECT_EQ(nlohmann::json::parse(run_isohf(asked).out).at("help"), run_isohf(arguments).out);
  }
}

}  // namespace
}  // namespace isohf::test
