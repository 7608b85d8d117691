#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gl_test.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {

/// The real programs: what convert stores, the viewer draws.
class ProgramFixture : public GlTest {
 protected:
  void convert(const std::vector<std::string>& options, const std::string& source = "coast_512x384_int16.tif") const {
    std::vector<std::string> command{"convert", ISOHF_SOURCE_DIR "/testdata/" + source, archive()};
    command.insert(command.end(), {"--overwrite", "--quiet", "--density", "0.1", "--shape", "52x59", "--levels", "3"});
    command.insert(command.end(), options.begin(), options.end());
    const RunResult result = run_isohf(command);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  [[nodiscard]] RunResult view(const std::vector<std::string>& options) const {
    std::vector<std::string> command{ISOHF_BIN_DIR "/isohf-view", archive()};
    command.insert(command.end(), options.begin(), options.end());
    return run_program(command);
  }
  [[nodiscard]] std::string picture(const std::vector<std::string>& options) const {
    std::vector<std::string> all{"--screenshot", folder_ / "a.png", "--overwrite", "--size", "200x150"};
    all.insert(all.end(), options.begin(), options.end());
    const RunResult result = view(all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return read_file(folder_ / "a.png");
  }
  [[nodiscard]] std::string archive() const { return folder_ / "a.isohf"; }

  const TemporaryFolder folder_;
};

}  // namespace isohf::test
