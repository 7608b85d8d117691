/// convert --resume where the archive is finished already.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/options/small_grid.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ResumeComplete : public testing::Test {
 protected:
  ResumeComplete() {
    write_text(input_, small_grid());
    EXPECT_EQ(run_isohf({"convert", input_, output_, "--filter", "nearest"}).exit_code, 0);
    before_ = read_text(output_);
  }
  RunResult resume(std::vector<std::string> more = {"--filter", "nearest"}) const {
    return run_isohf(with_more({"convert", input_, output_, "--resume"}, more));
  }
  void expect_refused(const std::vector<std::string>& more, const std::string& why) const {
    const RunResult result = resume(more);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(read_text(output_), before_);
  }

  TemporaryFolder folder_;
  std::string input_ = folder_ / "a.asc";
  std::string output_ = folder_ / "a.isohf";
  std::string before_;
};

TEST_F(ResumeComplete, IsDoneInOneLine) {
  const RunResult result = resume();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out, "archive      " + output_ + ": complete already\n");
  EXPECT_EQ(read_text(output_), before_);
  const nlohmann::json document = nlohmann::json::parse(resume({"--filter", "nearest", "--json"}).out);
  EXPECT_EQ(document.at("status"), "complete");
  // What changes no byte changes nothing.
  EXPECT_EQ(resume({"--filter", "nearest", "-j", "1", "--memory", "300M"}).exit_code, 0);
}

TEST_F(ResumeComplete, TakesAwayTheJournalOfARunThatWasKilledAtItsEnd) {
  write_text(output_ + ".part.journal", "left");
  EXPECT_EQ(resume().exit_code, 0);
  EXPECT_FALSE(fs::exists(output_ + ".part.journal"));
}

TEST_F(ResumeComplete, SaysWhatDiffers) {
  expect_refused({"--filter", "bspline3"}, R"(was made otherwise: filter "nearest", not "bspline3"; --overwrite)");
  expect_refused({"--filter", "nearest", "--effort", "fast"}, "level 5, not 2");
  expect_refused({"--filter", "nearest", "--type", "u8"}, R"(samples.type "u16", not "u8")");
  expect_refused({"--filter", "nearest", "--z-range", "0:500"}, "other elevation codes, ");
  expect_refused({"--filter", "nearest", "--lossless"}, "residuals");
}

TEST_F(ResumeComplete, NoticesAnInputThatChanged) {
  fs::last_write_time(input_, fs::last_write_time(output_) + std::chrono::seconds(5));
  expect_refused({"--filter", "nearest"}, input_ + " was changed after it was written");
  EXPECT_EQ(resume({"--filter", "nearest", "--overwrite"}).exit_code, 0);
}

TEST_F(ResumeComplete, NoticesAFileThatIsNoArchive) {
  write_text(output_, "mine");
  before_ = "mine";
  expect_refused({"--filter", "nearest"}, "exists and is no isohf archive; an archive replaces only archives");
}

}  // namespace
}  // namespace isohf::test
