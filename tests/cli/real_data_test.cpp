/// Real elevation files become archives that pass every check and lie close to their source.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

/// What the formats of this task hold of the shared data; absent from a bare checkout.
std::vector<std::string> real_files() {
  std::vector<std::string> found;
  const std::string root = ISOHF_SOURCE_DIR "/../shared/data";
  for (const std::string& folder : {root, root + "/derived"}) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename();
      for (const char* ending : {".tif", ".TIF", ".exr", ".png", ".hgt", ".hgt.zip"}) {
        if (name.ends_with(ending)) found.push_back(entry.path());
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

TEST(RealData, ConvertsAndPassesEveryCheck) {
  const std::vector<std::string> files = real_files();
  if (files.empty()) GTEST_SKIP() << "the shared data folder is not here";
  const TemporaryFolder folder;
  // Every fourth file under the sanitizers.
  for (std::size_t i = 0; i < files.size(); i += kSanitized ? 4 : 1) {
    const std::string& file = files[i];
    SCOPED_TRACE(file);
    const RunResult converted = run_isohf({"convert", file, folder / "a.isohf", "--overwrite", "--quiet"});
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    EXPECT_EQ(converted.err, "");
    const RunResult verified = run_isohf(
        {"verify", folder / "a.isohf", "--against", file, "--random", "0", "--no-ortho", "--json", "--quiet"});
    ASSERT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const nlohmann::json report = nlohmann::json::parse(verified.out);
    EXPECT_GT(report.at("against").at("samples_compared").get<std::int64_t>(), 0);
    EXPECT_EQ(report.at("against").at("lost_inside"), 0);
    EXPECT_EQ(report.at("against").at("invented_inside"), 0);
  }
}

}  // namespace
}  // namespace isohf::test
