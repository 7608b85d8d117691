#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "formats/registry.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> samples_of(const fs::path& path) {
  const auto source = open_source(path.string(), {});
  const SourceInfo& info = source->info();
  std::vector<std::byte> samples(static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height) *
                                 size_bytes(info.sample_type));
  source->read_window({0, 0, info.width, info.height}, samples);
  return samples;
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
  const fs::path made = fs::path(testing::TempDir()) / "isohf_testdata";
  fs::remove_all(made);
  fs::create_directories(made);
  const std::string command = "MAKE_TERRAIN='" ISOHF_BIN_DIR "/make_terrain' '" ISOHF_SOURCE_DIR
                              "/scripts/make_testdata' '" +
                              made.string() + "' >/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto names = rasters_in(kept);
  EXPECT_EQ(names, rasters_in(made));
  EXPECT_FALSE(names.empty());
  for (const std::string& name : names) EXPECT_TRUE(samples_of(kept / name) == samples_of(made / name)) << name;
  fs::remove_all(made);
}

}  // namespace
}  // namespace isohf
