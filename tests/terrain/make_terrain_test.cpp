#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "support/sanitizers.h"
#include "support/temporary_folder.h"
#include "terrain.h"

namespace isohf::terrain {
namespace {

namespace fs = std::filesystem;

class MakeTerrain : public testing::Test {
 protected:
  /// Exit code of make_terrain; its standard error goes to the file "stderr".
  int run(const std::string& arguments) {
    const std::string command =
        "cd '" + folder_.path() + "' && '" ISOHF_BIN_DIR "/make_terrain' " + arguments + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string bytes(const std::string& name) const { return test::read_file(folder_ / name); }

  /// Of a NumPy file, without its header.
  std::string samples_of(const std::string& name) const {
    const std::string all = bytes(name);
    return all.substr(10 + static_cast<unsigned char>(all[8]));
  }

  const test::TemporaryFolder folder_;
};

TEST_F(MakeTerrain, GivesTheSameBytesForAnyNumberOfThreads) {
  const std::string size = test::kSanitized ? "100x1300" : "600x1300";
  for (const std::string name : {"a.tif", "a.exr", "a.npy"}) {
    const std::string options =
        "--size " + size + " --voids 0.05 --type " + std::string(name == "a.npy" ? "int16" : "float32") + " -o ";
    ASSERT_EQ(run(options + name + " --threads 1"), 0) << bytes("stderr");
    const std::string one = bytes(name);
    for (const int threads : {2, 3, 8}) {
      ASSERT_EQ(run(options + name + " --threads " + std::to_string(threads)), 0);
      EXPECT_TRUE(bytes(name) == one) << name << " with " << threads << " threads";
    }
  }
}

TEST_F(MakeTerrain, FilesHoldTheRoundedHeightsRowByRow) {
  ASSERT_EQ(run("--size 130x300 --seed 9 -o a.npy"), 0) << bytes("stderr");
  EXPECT_EQ(bytes("stderr"), "");
  const std::string raw = samples_of("a.npy");
  ASSERT_EQ(raw.size(), 130U * 300U * 2U);
  TerrainOptions options;
  options.seed = 9;
  const Terrain terrain(options);
  std::vector<float> heights(130);
  for (std::size_t r = 0; r < 300; ++r) {
    terrain.row(0, static_cast<std::int64_t>(r), heights);
    for (std::size_t c = 0; c < 130; ++c) {
      std::int16_t sample = 0;
      std::memcpy(&sample, raw.data() + 2 * (r * 130 + c), 2);
      ASSERT_EQ(sample, std::lround(heights[c])) << c << " " << r;
    }
  }
}

TEST_F(MakeTerrain, HgtIsBigEndianWithTheSrtmVoid) {
  ASSERT_EQ(run("--size 1201x1201 --voids 0.2 -o N10E010.hgt"), 0) << bytes("stderr");
  ASSERT_EQ(run("--size 1201x1201 --voids 0.2 -o same.npy"), 0);
  std::string hgt = bytes("N10E010.hgt");
  for (std::size_t i = 0; i + 1 < hgt.size(); i += 2) std::swap(hgt[i], hgt[i + 1]);
  EXPECT_TRUE(hgt == samples_of("same.npy"));
  EXPECT_NE(hgt.find(std::string("\x00\x80", 2)), std::string::npos);
}

TEST_F(MakeTerrain, RefusesWhatAFormatCannotHoldAndLeavesNoFile) {
  const char* refused[] = {
      "--size 8x8 -o a.png",
      "--size 8x8 -o a.exr",
      "--size 8x8 -o a.raw",
      "--size 8x8 -o a.hgt",
      "--size 8x8 -o a.xyz",
      "--size 8x8 -o a",
      "--size 8 -o a.tif",
      "--size 0x8 -o a.tif",
      "--size 8x8x8 -o a.tif",
      "--size 8x8 --voids 0.9 -o a.tif",
      "--size 8x8 --relief 20000 --base 12000 -o a.tif",
      "--size 8x8",
  };
  for (const char* arguments : refused) {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_NE(bytes("stderr"), "") << arguments;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_TRUE(entry.path().filename() == "stdout" || entry.path().filename() == "stderr") << arguments << entry;
    }
  }
}

TEST_F(MakeTerrain, SaysWhenTheFolderIsMissing) {
  EXPECT_EQ(run("--size 8x8 -o missing/a.npy"), 1);
  EXPECT_NE(bytes("stderr").find("missing/a.npy"), std::string::npos);
}

}  // namespace
}  // namespace isohf::terrain
