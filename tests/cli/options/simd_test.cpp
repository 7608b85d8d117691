/// ISOHF_SIMD: the plain twins of vectorised code give the same archives.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

const std::string kData = ISOHF_SOURCE_DIR "/testdata";

RunResult run_with_simd(const std::string& setting, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"/usr/bin/env", "ISOHF_SIMD=" + setting, isohf_path()});
  return run_program(arguments);
}

void convert_with_simd(const std::string& setting, const std::string& input, const std::string& output,
                       const std::vector<std::string>& options) {
  std::vector<std::string> arguments{"convert", kData + "/" + input, output, "-q"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const RunResult result = run_with_simd(setting, arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_EQ(result.err, "");
}

TEST(SimdSwitch, ArchivesAreTheSameByteForByte) {
  const TemporaryFolder folder;
  std::vector<std::vector<std::string>> jobs = {{"--type", "u8"}, {"--type", "f32"}, {"--lossless", "--shadow-seeds"}};
  for (const char* filter : {"nearest", "bilinear", "limited-cubic", "bspline3"}) {
    jobs.push_back({"--filter", filter});
  }
  for (const char* input : {"coast_512x384_int16.tif", "ridges_161x161_float.exr", "voids_200x150_int16.tif"}) {
    for (const std::vector<std::string>& options : jobs) {
      SCOPED_TRACE(input + (" " + options.back()));
      convert_with_simd("on", input, folder / "on.isohf", options);
      convert_with_simd("off", input, folder / "off.isohf", options);
      EXPECT_TRUE(read_file(folder / "on.isohf") == read_file(folder / "off.isohf"));
      std::filesystem::remove(folder / "on.isohf");
      std::filesystem::remove(folder / "off.isohf");
    }
  }
}

TEST(SimdSwitch, VerifiesWhatTheOtherWrote) {
  const TemporaryFolder folder;
  convert_with_simd("on", "coast_512x384_int16.tif", folder / "coast.isohf", {});
  const RunResult result =
      run_with_simd("off", {"verify", folder / "coast.isohf", "--against", kData + "/coast_512x384_int16.tif"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

}  // namespace
}  // namespace isohf::test
