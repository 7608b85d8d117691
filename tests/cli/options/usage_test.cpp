/// The command line: what is wrong use, which of two words counts, and who gets them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "commands/command.h"
#include "options/command_line.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;
using Words = std::vector<std::string>;

/// Exit code 2, no result, and one line that holds `why`.
void expect_refused(const Words& arguments, const std::string& why) {
  SCOPED_TRACE(testing::PrintToString(arguments));
  const RunResult result = run_isohf(arguments);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, testing::StartsWith("isohf"));
  EXPECT_THAT(result.err, HasSubstr(why));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

std::string out_of(const Words& arguments, const RunOptions& options = {}) {
  SCOPED_TRACE(testing::PrintToString(arguments));
  const RunResult result = run_isohf(arguments, options);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  return result.out;
}

TEST(Usage, WrongUseIsOneLine) {
  expect_refused({}, "no command given");
  expect_refused({"frmats"}, "unknown command 'frmats'; did you mean formats?");
  expect_refused({"formats", "all"}, "'all' is one argument too many");
  expect_refused({"plan", "--shap", "20x20"}, "unknown option --shap; did you mean --shape?");
  expect_refused({"extract", "a.isohf", "--outptu=b.isohf"}, "unknown option --outptu; did you mean --output?");
  expect_refused({"plan", "-z"}, "unknown option -z");
  expect_refused({"plan", "--shape"}, "--shape lacks its value (isohf plan --help lists the options)");
  expect_refused({"plan", "--shape="}, "--shape: found '', must be a value");
  expect_refused({"plan", "--shape", "--strict"}, "--shape: found '--strict', must be a value");
  expect_refused({"convert", "a", "--overwrite=maybe"}, "--overwrite takes no value");
  expect_refused({"extract", "a.isohf"}, "no OUTPUT given");
  expect_refused({"extract", "a", "b", "--bbox", "0,0,1,1", "--tiles", "0:1,0:1"}, "excludes");
  expect_refused({"sample", "a", "--time", "3"}, "--time requires --date");
  expect_refused({"convert", "a", "--sun-min", "3"}, "--sun-min requires --shadow-seeds");
  expect_refused({"formats", "--config", "none.toml"}, "--config: none.toml: cannot be read");
}

TEST(Usage, ErrorsBeforeTheCommandRunsAreDocumentsToo) {
  for (const Words& words : {Words{"frmats", "--json"}, {"--json", "plan", "--shap"}, {"plan", "--shape", "--json"}}) {
    const RunResult result = run_isohf(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(nlohmann::json::parse(result.out).at("error").at("exit_code"), 2);
  }
}

TEST(Usage, TheLastOfTwoEqualOptionsCounts) {
  EXPECT_EQ(out_of({"plan", "--shape", "20x20", "--shape=212x243"}), out_of({"plan", "--shape", "212x243"}));
  EXPECT_EQ(out_of({"plan", "--type", "u8", "--type", "f32"}), out_of({"plan", "--type=f32"}));
}

TEST(Usage, CommonOptionsStandAnywhere) {
  const TemporaryFolder folder;
  EXPECT_THAT(out_of({"--json", "formats"}), testing::StartsWith("{"));
  EXPECT_EQ(out_of({"--json", "formats"}), out_of({"formats", "--json"}));
  EXPECT_EQ(out_of({"-qv", "formats"}), out_of({"formats", "-v", "-q"}));
  write_file(folder / "options.toml", "json = true\n");
  EXPECT_EQ(out_of({"--config", folder / "options.toml", "formats"}), out_of({"formats", "--json"}));
  EXPECT_EQ(out_of({"formats", "--config=" + (folder / "options.toml")}), out_of({"formats", "--json"}));
}

/// Names of files that look like words of the command line.
TEST(Usage, FilesHaveAnyName) {
  const TemporaryFolder folder;
  RunOptions here;
  here.folder = folder.path();
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";
  for (const char* name : {"info", "[1]", "[a,b]", "{}", "%%", "++", "a b", "=", "x=y"}) {
    SCOPED_TRACE(name);
    std::filesystem::copy_file(raster, folder / name);
    EXPECT_EQ(run_isohf({"info", name, "-q"}, here).exit_code, 0);
    EXPECT_EQ(run_isohf({"convert", name, "-o", "a.isohf", "-q", "--overwrite"}, here).exit_code, 0);
  }
  std::filesystem::copy_file(raster, folder / "-q");
  std::filesystem::copy_file(raster, folder / "--json");
  const RunResult result = run_isohf({"info", "info", "-q", "--", "-q", "--json"}, here);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
}

TEST(Usage, ValuesMayBeNegativeAttachedOrOptional) {
  const TemporaryFolder folder;
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";
  out_of({"convert", raster, folder / "a.isohf", "-q", "-j1", "--z-offset", "-5"});
  out_of({"convert", raster, folder / "b.isohf", "-qj2", "--z-offset=-5"});
  EXPECT_TRUE(read_file(folder / "a.isohf") == read_file(folder / "b.isohf"));
  // Followed by a word that is no value of the flag.
  out_of({"convert", "--fill", raster, folder / "c.isohf", "-q"});
  out_of({"convert", "--fill=50", raster, folder / "d.isohf", "-q"});
  expect_refused({"convert", "--fill=x", raster, folder / "e.isohf"}, "--fill: found 'x'");
}

TEST(Usage, HelpIsPrintedWhateverElseIsWrong) {
  for (const cli::Command& declared : cli::kIsohf.commands) {
    if (declared.program != nullptr) continue;
    const std::string command = declared.name;
    const std::string help = out_of({command, "--help"});
    EXPECT_THAT(help, testing::StartsWith("Usage: isohf " + command));
    EXPECT_EQ(out_of({"help", command}), help);
    EXPECT_EQ(out_of({"--help", command}), help);
    EXPECT_EQ(out_of({command, "-h", "--help"}), help);
    EXPECT_EQ(out_of({command, "a", "b", "--nonsense", "--shape", "x", "--help"}), help);
    EXPECT_EQ(out_of({command, "--nonsense", "-h"}), out_of({command, "-h"}));
  }
  EXPECT_EQ(out_of({"help"}), out_of({"--help"}));
  // Every argument has a line of its own, in the short help as well.
  EXPECT_THAT(out_of({"convert", "-h"}), HasSubstr("\n  INPUT... OUTPUT.isohf"));
}

/// Counts from the declarations; a slot is an option of a command. Those that all commands have are counted once.
TEST(Usage, EveryOptionIsDescribed) {
  cli::Common common;
  CLI::App root(cli::kIsohf.summary, cli::kIsohf.name);
  cli::declare(cli::kIsohf, root, common);
  std::set<std::string> names;
  std::size_t slots = 0;
  std::vector<const CLI::App*> lines = {&root};
  for (const CLI::App* command : root.get_subcommands({})) lines.push_back(command);
  for (const CLI::App* line : lines) {
    for (const CLI::Option* option : line->get_options()) {
      if (line != &root && (option == line->get_help_ptr() || option == line->get_help_all_ptr())) continue;
      const std::string text = option->get_description();
      EXPECT_NE(text, "") << line->get_name() << " " << option->get_name();
      EXPECT_TRUE(text.find("[default") == std::string::npos || text.ends_with(']')) << text;
      if (option->get_lnames().empty()) continue;
      names.insert(cli::long_name(*option));
      ++slots;
    }
  }
  std::cout << cli::kIsohf.commands.size() << " commands, " << names.size() << " options, " << slots << " slots\n";
}

TEST(Usage, VersionIsOneLineOrADocument) {
  for (const Words& words : {Words{"--version"}, {"-V"}, {"info", "-V"}, {"convert", "a.tif", "--version"}})
    EXPECT_TRUE(std::regex_match(out_of(words), std::regex("isohf [0-9]+\\.[0-9]+\\.[0-9]+\n")));
  for (const Words& words : {Words{"--json", "--version"}, {"info", "--json", "-V"}}) {
    const nlohmann::json document = nlohmann::json::parse(out_of(words));
    EXPECT_EQ("isohf " + document.at("version").get<std::string>() + "\n", out_of({"-V"}));
  }
}

TEST(Usage, ReaderThatLeavesIsNoMessage) {
  RunOptions closed;
  closed.close_output = true;
  const RunResult result = run_isohf({"plan"}, closed);
  EXPECT_EQ(result.exit_code, 128 + SIGPIPE);
  EXPECT_EQ(result.err, "");
}

/// A program in place of isohf-view, which prints its words.
TEST(Usage, ViewGetsAllOtherWords) {
  const TemporaryFolder folder;
  const std::string isohf = folder / "isohf";
  std::filesystem::copy_file(isohf_path(), isohf);
  write_file(folder / "isohf-view", "#!/bin/sh\nprintf '%s\\n' \"$@\"\nexit 3\n");
  std::filesystem::permissions(folder / "isohf-view", std::filesystem::perms::owner_all);
  const auto words_of = [&](Words words) {
    words.insert(words.begin(), isohf);
    const RunResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(result.err, "");
    return result.out;
  };
  EXPECT_EQ(words_of({"view", "x", "--bogus", "--size=", "a", "--", "-b", "[1]"}),
            "x\n--bogus\n--size=\na\n--\n-b\n[1]\n");
  EXPECT_EQ(words_of({"-q", "--config", "view", "view", "view"}), "-q\n--config\nview\nview\n");
  EXPECT_EQ(words_of({"view", "--help"}), "--help\n");
  EXPECT_EQ(words_of({"help", "view"}), "--help\n");
  std::filesystem::remove(folder / "isohf-view");
  const RunResult missing = run_program({"/usr/bin/env", "PATH=/nowhere", isohf, "view"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_EQ(missing.err, "isohf: isohf-view: is not installed, neither beside isohf nor on the path\n");
}

}  // namespace
}  // namespace isohf::test
