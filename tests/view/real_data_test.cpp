/// Real elevation files, converted with shadow seeds, pass isohf-view --verify.

#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "gl_test.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

struct RealFile {
  std::string name;
  std::vector<std::string> options;
};

class RealDataViewTest : public GlTest {};

TEST_F(RealDataViewTest, PassesVerify) {
  // Small ones of different kinds: floats in an archive of codes, of floats, of bytes; seeds of angles; voids.
  const std::vector<RealFile> files{
      {"olinda_dem_utm25s.tif", {"--shadow-seeds"}},
      {"missionDEM_gale_hirise.tif", {"--shadow-seeds", "--type", "f32"}},
      {"ETOPO1_1deg.tif", {"--shadow-seeds=5,15", "--type", "u8"}},
      {"N41E002.hgt", {"--shadow-seeds", "--sun-min", "4", "--density", "0.02"}},
      {"mt_fuji_90m.tif", {"--shadow-seeds", "--density", "0.02", "--shape", "52x59", "--levels", "3"}}};
  const TemporaryFolder folder;
  int checked = 0;
  for (const RealFile& file : files) {
    if (kSanitized && checked == 2) break;
    const std::string source = real_data() / file.name;
    if (!std::filesystem::exists(source)) continue;
    SCOPED_TRACE(file.name);
    std::vector<std::string> command{"convert", source, folder / "a.isohf", "--overwrite", "--quiet"};
    command.insert(command.end(), file.options.begin(), file.options.end());
    const RunResult converted = run_isohf(command);
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    const RunResult verified = run_program({ISOHF_BIN_DIR "/isohf-view", folder / "a.isohf", "--verify"});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    EXPECT_NE(verified.out.find("\nshadows: suns of "), std::string::npos) << verified.out;
    EXPECT_EQ(verified.err, "");
    ++checked;
  }
  if (checked == 0) GTEST_SKIP() << kNoRealFiles;
}

}  // namespace
}  // namespace isohf::test
