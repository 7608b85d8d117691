#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> samples_of(const std::string& path) {
  return test::read_whole(*open_raster(path, {}));
}

std::set<std::string> rasters_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".tif" || extension == ".exr" || extension == ".png")
      names.insert(entry.path().filename().string());
  }
  return names;
}

TEST(Testdata, IsWhatMakeTestdataMakesSampleForSample) {
  const fs::path kept = ISOHF_SOURCE_DIR "/testdata";
  const test::TemporaryFolder made;
  const std::string command = "MAKE_TERRAIN='" ISOHF_BIN_DIR "/make_terrain' '" ISOHF_SOURCE_DIR
                              "/testdata/make_testdata' '" +
                              made.path() + "' >/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto names = rasters_in(kept);
  EXPECT_EQ(names, rasters_in(made.path()));
  EXPECT_FALSE(names.empty());
  for (const std::string& name : names) EXPECT_TRUE(samples_of(kept / name) == samples_of(made / name)) << name;
}

}  // namespace
}  // namespace isohf
