/// convert --out-dir: one archive of each input, in one run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/options/small_grid.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<json> lines_of(const std::string& text) {
  std::vector<json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(json::parse(line));
  return lines;
}

class ConvertEach : public testing::Test {
 protected:
  ConvertEach() {
    fs::create_directories(in_ + "/deep/er");
    for (int i = 0; i < 6; ++i)
      write_text(in_ + "/" + std::string(1, static_cast<char>('a' + i)) + ".asc", small_grid(i));
    write_text(in_ + "/deep/er/a.asc", small_grid(6));
  }
  /// Names of the archives below the output folder.
  [[nodiscard]] std::vector<std::string> archives() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(out_)) {
      if (entry.is_regular_file()) found.push_back(entry.path().lexically_relative(out_).string());
    }
    std::sort(found.begin(), found.end());
    return found;
  }
  RunResult each(std::vector<std::string> more = {}) const {
    return run_isohf(with_more({"convert", in_, "--out-dir", out_}, more));
  }

  TemporaryFolder folder_;
  std::string in_ = folder_ / "in";
  std::string out_ = folder_ / "out";
};

TEST_F(ConvertEach, MakesTheBytesOfSingleRuns) {
  const std::string single = folder_ / "single.isohf";
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"-j", "1"}, {"-j", "4"}, {"-j", "3", "--memory", "150M"}}) {
    const RunResult result = each(more);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_THAT(result.out, testing::StartsWith("converted    " + out_ + "/a.isohf: "));
    EXPECT_THAT(result.out, HasSubstr("\nfiles        6: 6 converted in "));
    EXPECT_THAT(archives(), ElementsAre("a.isohf", "b.isohf", "c.isohf", "d.isohf", "e.isohf", "f.isohf"));
    for (const char* name : {"a", "f"}) {
      ASSERT_EQ(run_isohf({"convert", in_ + "/" + name + ".asc", single, "--overwrite"}).exit_code, 0);
      EXPECT_EQ(read_text(out_ + "/" + name + ".isohf"), read_text(single));
    }
    fs::remove_all(out_);
  }
}

TEST_F(ConvertEach, KeepsFoldersBelowAFolder) {
  EXPECT_EQ(each({"--recursive"}).exit_code, 0);
  EXPECT_THAT(archives(), testing::Contains("deep/er/a.isohf"));
  EXPECT_EQ(archives().size(), 7U);
}

TEST_F(ConvertEach, RefusesTwoInputsOfOneNameBeforeAnyWork) {
  const RunResult result = run_isohf({"convert", in_, in_ + "/deep/er/a.asc", "--out-dir", out_});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(in_ + "/a.asc and " + in_ + "/deep/er/a.asc would both be this archive"));
  EXPECT_FALSE(fs::exists(out_));
}

TEST_F(ConvertEach, TellsOfEveryFileInTheOrderOfTheInputs) {
  const RunResult result = each({"--json", "-j", "4"});
  EXPECT_EQ(result.exit_code, 0);
  const std::vector<json> lines = lines_of(result.out);
  ASSERT_EQ(lines.size(), 7U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(lines[i].at("input"), in_ + "/" + std::string(1, static_cast<char>('a' + i)) + ".asc");
    EXPECT_EQ(lines[i].at("status"), "converted");
    EXPECT_GE(lines[i].at("tiles_written"), 1);
  }
  EXPECT_EQ(lines[6].at("summary").at("converted"), 6);
}

TEST_F(ConvertEach, LeavesExistingArchivesUnlessToldWhatToDo) {
  ASSERT_EQ(each().exit_code, 0);
  const std::string before = read_text(out_ + "/a.isohf");
  const RunResult refused = each();
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("exists, and 5 more; --resume"));
  fs::remove(out_ + "/c.isohf");
  const RunResult resumed = each({"--resume"});
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.out, HasSubstr("files        6: 1 converted, 5 complete before in "));
  EXPECT_EQ(read_text(out_ + "/a.isohf"), before);
  EXPECT_THAT(each({"--resume"}).out, HasSubstr("files        6: 0 converted, 6 complete before in "));
  EXPECT_THAT(each({"--overwrite"}).out, HasSubstr("files        6: 6 converted in "));
}

TEST_F(ConvertEach, TakesAnIncompleteFileOfThatNameForAnError) {
  ASSERT_EQ(each().exit_code, 0);
  fs::resize_file(out_ + "/b.isohf", fs::file_size(out_ + "/b.isohf") / 2);
  const RunResult result = each({"--resume", "--keep-going"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("files        6: 0 converted, 5 complete before, 1 failed in "));
  // The file's name need not be said twice.
  const std::size_t name = result.err.find("b.isohf: is not a complete archive: ");
  ASSERT_NE(name, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("b.isohf", name + 1), std::string::npos) << result.err;
}

TEST_F(ConvertEach, SaysThatItKeepsAnInterruptedRunAsASingleRunDoes) {
  fs::create_directories(out_);
  const std::string told = "isohf convert: " + out_ +
                           "/b.isohf.part: keeping 4 bytes of an interrupted run until this one is complete. "
                           "--resume would continue it\n";
  const auto leave = [&] {
    write_text(out_ + "/b.isohf.part", "left");
    write_text(out_ + "/b.isohf.part.journal", std::string(100, 'x'));
  };
  leave();
  EXPECT_EQ(each().err, told);
  leave();
  EXPECT_EQ(run_isohf({"convert", in_ + "/b.asc", out_ + "/b.isohf", "--overwrite"}).err, told);
  leave();
  EXPECT_EQ(each({"--overwrite", "-q"}).err, "");
  EXPECT_EQ(archives().size(), 6U);
}

TEST_F(ConvertEach, StopsAtABadFileOrKeepsGoing) {
  write_text(in_ + "/b.asc", "ncols 2\nnrows 2\ncellsize 1\n1 2 three 4\n");
  const RunResult stopped = each({"-j", "1"});
  EXPECT_EQ(stopped.exit_code, 1);
  EXPECT_THAT(stopped.out, HasSubstr("files        6: 1 converted, 1 failed, 4 not done in "));
  EXPECT_THAT(archives(), ElementsAre("a.isohf"));
  const RunResult going = each({"--resume", "--keep-going", "--json"});
  EXPECT_EQ(going.exit_code, 1);
  EXPECT_THAT(going.err, testing::StartsWith("isohf convert: " + in_ + "/b.asc: "));
  const std::vector<json> lines = lines_of(going.out);
  ASSERT_EQ(lines.size(), 7U);
  EXPECT_EQ(lines[0].at("status"), "complete");
  EXPECT_EQ(lines[1].at("status"), "failed");
  EXPECT_EQ(lines[1].at("error").at("where"), in_ + "/b.asc");
  EXPECT_EQ(lines[6].at("summary").at("failed"), 1);
  EXPECT_EQ(archives().size(), 5U);
}

TEST_F(ConvertEach, GoesOnPastAFileOfNodata) {
  write_text(in_ + "/b.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9\n-9 -9\n-9 -9\n");
  const RunResult result = each({"--json", "-j", "1"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_THAT(result.err, testing::StartsWith("isohf convert: " + in_ + "/b.asc: all 4 samples"));
  const std::vector<json> lines = lines_of(result.out);
  ASSERT_EQ(lines.size(), 7U);
  EXPECT_EQ(lines[1].at("status"), "nodata");
  EXPECT_EQ(lines[6].at("summary").at("nodata"), 1);
  EXPECT_EQ(lines[6].at("summary").at("converted"), 5);
  EXPECT_EQ(archives().size(), 5U);
  EXPECT_THAT(each({"--resume", "-q"}).err, "");
  EXPECT_THAT(run_isohf({"convert", in_ + "/b.asc", folder_ / "b.isohf"}).exit_code, 1);
}

TEST_F(ConvertEach, TellsOnceOfAFolderThatMayNotBeWrittenTo) {
  fs::create_directories(out_);
  ASSERT_EQ(::chmod(out_.c_str(), 0555), 0);
  ASSERT_EQ(::chmod(folder_.path().c_str(), 0755), 0);
  RunOptions plain_user;
  plain_user.without_privileges = true;
  if (run_isohf({"--version"}, plain_user).exit_code != 0) GTEST_SKIP() << "other users cannot run the program";
  const RunResult result = run_isohf({"convert", in_, "--out-dir", out_, "--keep-going"}, plain_user);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "isohf convert: cannot write into folder " + out_ + ": Permission denied\n");
}

TEST_F(ConvertEach, AnInterruptLeavesWhatResumeGoesOnWith) {
  std::string list;
  for (int i = 0; i < 400; ++i) {
    const std::string name = folder_ / ("n" + std::to_string(i) + ".asc");
    fs::create_hard_link(in_ + "/a.asc", name);
    list += name + "\n";
  }
  write_text(folder_ / "list.txt", list);
  const std::vector<std::string> command = {"convert", "@" + (folder_ / "list.txt"), "--out-dir", out_};
  std::vector<std::string> begun = {isohf_path()};
  begun.insert(begun.end(), command.begin(), command.end());
  begun.insert(begun.end(), {"--progress", "json"});
  RunningProgram program(begun);
  ASSERT_TRUE(program.wait_for_error_text("\"progress\":\"files\""));
  program.send(SIGINT);
  const RunResult result = program.wait();
  ASSERT_EQ(result.exit_code, 130) << result.err;
  EXPECT_THAT(result.err, HasSubstr("--resume"));
  EXPECT_THAT(result.out, HasSubstr(" not done"));
  std::vector<std::string> again = command;
  again.push_back("--resume");
  const RunResult resumed = run_isohf(again);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(archives().size(), 400U);
  for (const std::string& name : archives()) EXPECT_THAT(name, testing::EndsWith(".isohf"));
}

TEST_F(ConvertEach, SaysWhichOptionsAreForOneArchive) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--output", "x.isohf"}, {"--shard", "1/2"}, {"--on-top", "first"}}) {
    const RunResult result = each(more);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(more.front() + " cannot be combined with --out-dir"));
  }
  EXPECT_THAT(run_isohf({"convert", "a", "b", "--keep-going"}).err, HasSubstr("--keep-going needs --out-dir"));
}

TEST_F(ConvertEach, SaysWhyAFolderCannotBeMade) {
  write_text(folder_ / "file", "");
  const RunResult result = run_isohf({"convert", in_, "--out-dir", folder_ / "file/new"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("cannot make the folder " + (folder_ / "file/new") + ": Not a directory"));
}

}  // namespace
}  // namespace isohf::test
