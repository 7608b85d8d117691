/// What a terminal changes: widths and colours, and never a byte of a pipe.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "support/run_program.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kEscape = "\x1b[";

/// isohf in an environment of its own, behind pipes.
RunResult run_with(const std::vector<std::string>& environment, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {"/usr/bin/env", "-u", "NO_COLOR", "-u", "CLICOLOR_FORCE", "-u", "COLUMNS"};
  command.insert(command.end(), environment.begin(), environment.end());
  command.push_back(isohf_path());
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program(command);
}

/// The same on a terminal, where both streams come back as one.
std::string on_terminal(const std::string& environment, const std::string& arguments, int columns) {
  const std::string inner = "stty cols " + std::to_string(columns) + "; env -u NO_COLOR -u CLICOLOR_FORCE -u COLUMNS " +
                            environment + " " + isohf_path() + " " + arguments;
  return run_program({"/usr/bin/script", "-qec", inner, "/dev/null"}).out;
}

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  isohf ") || line.starts_with("  for ")) continue;  // examples stay whole
    longest = std::max(longest, line.size());
  }
  return longest;
}

TEST(Terminal, PipesGetNoEscapeCodesUnlessForced) {
  for (const std::string setting : {"TERM=xterm", "CLICOLOR_FORCE=0", "TERM=dumb"}) {
    EXPECT_THAT(run_with({setting}, {"convert", "--help"}).out, Not(HasSubstr(kEscape)));
    EXPECT_THAT(run_with({setting}, {"info", "none.tif"}).err, testing::StartsWith("isohf info: none.tif"));
  }
  EXPECT_THAT(run_with({"CLICOLOR_FORCE=1"}, {"convert", "--help"}).out, HasSubstr("\x1b[1mUsage:\x1b[0m"));
  EXPECT_THAT(run_with({"CLICOLOR_FORCE=1"}, {"info", "none.tif"}).err,
              HasSubstr("\x1b[1;31misohf info:\x1b[0m none.tif"));
  EXPECT_THAT(run_with({"CLICOLOR_FORCE=1", "NO_COLOR=1"}, {"convert", "--help"}).out, Not(HasSubstr(kEscape)));
}

TEST(Terminal, HelpIsAsWideAsColumnsSayWithin80And120) {
  const auto width = [](const std::string& columns) {
    return longest_line(run_with({"COLUMNS=" + columns}, {"convert", "--help"}).out);
  };
  EXPECT_LE(width("80"), 80U);
  EXPECT_EQ(width("40"), width("80"));
  EXPECT_GT(width("120"), 110U);
  EXPECT_EQ(width("400"), width("120"));
  EXPECT_EQ(width("0"), width("80"));
  EXPECT_EQ(width("many"), width("80"));
}

TEST(Terminal, ColoursAndWidthAreTheTerminals) {
  if (std::system("command -v script >/dev/null 2>&1") != 0) GTEST_SKIP() << "script is not installed";
  EXPECT_THAT(on_terminal("TERM=xterm", "convert --help", 90), HasSubstr("\x1b[1mUsage:\x1b[0m"));
  EXPECT_THAT(on_terminal("TERM=dumb", "convert --help", 90), Not(HasSubstr(kEscape)));
  EXPECT_THAT(on_terminal("TERM=xterm NO_COLOR=1", "convert --help", 90), Not(HasSubstr(kEscape)));
  EXPECT_THAT(on_terminal("TERM=xterm", "info none.tif", 90), HasSubstr("\x1b[1;31misohf info:\x1b[0m none.tif"));
  EXPECT_LE(longest_line(on_terminal("TERM=dumb", "convert --help", 90)), 91U);  // with the carriage return
}

TEST(Terminal, ProgressIsABarOnATerminalThatCanMoveItsCursor) {
  if (std::system("command -v script >/dev/null 2>&1") != 0) GTEST_SKIP() << "script is not installed";
  const std::string plan = "info " ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif --stats";
  EXPECT_THAT(on_terminal("TERM=xterm", plan, 60), HasSubstr("\x1b[K"));
  EXPECT_THAT(on_terminal("TERM=dumb", plan, 60), Not(HasSubstr(kEscape)));
  EXPECT_THAT(on_terminal("TERM=xterm", plan + " -q", 60), Not(HasSubstr(kEscape)));
}

}  // namespace
}  // namespace isohf::test
