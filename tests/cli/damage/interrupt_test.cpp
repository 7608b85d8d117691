/// Conversions that are stopped half-way leave nothing under the final name.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

class Interrupt : public testing::Test {
 protected:
  /// Its tiles take half a second, however fast: the signal must arrive before they are done.
  Interrupt() { write_sparse_tiff(folder / "big.tif", 7000, kSanitized ? 5000 : 20000); }

  std::vector<std::string> command(const std::string& output, const std::vector<std::string>& more = {}) const {
    return with_more(
        {isohf_path(), "convert", folder / "big.tif", folder / output, "--z-range", "0:100", "--progress", "json"},
        more);
  }

  /// Starts a conversion, sends the signal once tiles are written, and returns how it ended.
  RunResult stopped_by(int signal) {
    RunningProgram program(command("big.isohf"));
    EXPECT_TRUE(program.wait_for_error_text("\"progress\":\"tiles\""));
    program.send(signal);
    return program.wait();
  }

  [[nodiscard]] bool exists(const std::string& name) const {
    const std::vector<std::string> names = folder.names();
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  TemporaryFolder folder;
};

TEST_F(Interrupt, SigintIsExit130AndResumingGivesTheSameBytes) {
  const RunResult stopped = stopped_by(SIGINT);
  ASSERT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_EQ(stopped.out, "");
  EXPECT_FALSE(exists("big.isohf"));
  EXPECT_TRUE(exists("big.isohf.part"));

  const RunResult resumed = run_program(command("big.isohf", {"--resume"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  const RunResult straight = run_program(command("straight.isohf"));
  EXPECT_EQ(straight.exit_code, 0) << straight.err;
  EXPECT_TRUE(read_file(folder / "big.isohf") == read_file(folder / "straight.isohf"));
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"big.isohf", "big.tif", "straight.isohf"}));
}

TEST_F(Interrupt, SigtermIsExit130) {
  EXPECT_EQ(stopped_by(SIGTERM).exit_code, 130);
  EXPECT_FALSE(exists("big.isohf"));
}

TEST_F(Interrupt, ASecondSigintEndsAtOnce) {
  RunningProgram program(command("big.isohf"));
  EXPECT_TRUE(program.wait_for_error_text("\"progress\":\"tiles\""));
  program.send(SIGINT);
  program.send(SIGINT);
  EXPECT_EQ(program.wait().exit_code, 130);
  EXPECT_FALSE(exists("big.isohf"));
}

TEST_F(Interrupt, KillLeavesNothingUnderTheFinalNameAndTheNextRunWorks) {
  EXPECT_EQ(stopped_by(SIGKILL).exit_code, 128 + SIGKILL);
  EXPECT_FALSE(exists("big.isohf"));
  EXPECT_TRUE(exists("big.isohf.part"));
  // A part file without --resume is started anew.
  write_int16_tiff(folder / "big.tif", 80, 80,
                   [](std::int64_t c, std::int64_t) { return static_cast<std::int16_t>(c); });
  const RunResult next = run_program(command("big.isohf"));
  EXPECT_EQ(next.exit_code, 0) << next.err;
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"big.isohf", "big.tif"}));
}

}  // namespace
}  // namespace isohf::test
