/// What once passed in silence: exit code 0 and a wrong result, or a plan for what the run refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "formats/zip_archive.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kVoids = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";

class SilentFailures : public ::testing::Test {
 protected:
  RunResult run(const std::vector<std::string>& arguments, int exit_code = 0) {
    RunOptions options;
    options.folder = folder.path();
    RunResult result = run_isohf(arguments, options);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    return result;
  }
  TemporaryFolder folder;
};

TEST_F(SilentFailures, AGeoTiffThatIsCutIsRefusedByName) {
  const std::string whole = read_file(kVoids);
  for (const std::size_t cut : {1U, 8U, 50U, 100U, 200U}) {
    write_file(folder / "cut.tif", whole.substr(0, whole.size() - cut));
    for (const std::string command : {"convert", "info"}) {
      std::vector<std::string> arguments = {command, "cut.tif", "-q"};
      if (command == "convert") arguments.emplace_back("x.isohf");
      EXPECT_THAT(run(arguments, 1).err, HasSubstr("isohf: cut.tif: ")) << cut;
    }
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"cut.tif"});
}

TEST_F(SilentFailures, ADryRunRefusesTheMemoryThatTheRunRefuses) {
  const std::string memory = "1M";
  const RunResult run_of_it = run({"convert", kVoids, "x.isohf", "--memory", memory, "-j", "2"}, 1);
  const RunResult dry = run({"convert", kVoids, "x.isohf", "--memory", memory, "-j", "2", "--dry-run"}, 1);
  EXPECT_EQ(dry.err, run_of_it.err);
  EXPECT_EQ(dry.out, "");
}

TEST_F(SilentFailures, ASingleTileIsNamedLikeItsLikes) {
  run({"convert", kVoids, "a.isohf", "-q"});
  run({"export", "a.isohf", "one.npy", "--tile-size", "200x150", "-q"});
  run({"export", "a.isohf", "two.npy", "--tiles", "1x1", "-q"});
  run({"export", "a.isohf", "whole.npy", "-q"});
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.isohf", "one_x0_y0.npy", "two_x0_y0.npy", "whole.npy"}));
  EXPECT_EQ(read_file(folder / "one_x0_y0.npy"), read_file(folder / "whole.npy"));
}

TEST_F(SilentFailures, TheValidRangeCountsWhatItRemovesAndWarnsOfNothing) {
  std::ostringstream grid;
  grid << "ncols 40\nnrows 40\nxllcorner 0\nyllcorner 0\ncellsize 10\n";
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) grid << (row == column ? -9999 : 100 + row * 3 + column) << ' ';
    grid << '\n';
  }
  write_file(folder / "a.asc", grid.str());
  const RunResult result = run({"convert", "a.asc", "a.isohf", "--valid-range", "0:5000"});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("40 samples of the input, 40 by --valid-range"));
  // Where the range lets it pass, it is as suspicious as ever.
  EXPECT_THAT(run({"convert", "a.asc", "b.isohf", "--valid-range", "-10000:5000"}).err, HasSubstr("--nodata -9999"));
}

TEST_F(SilentFailures, AFolderHoldsRastersInZipFilesOfAnyName) {
  std::filesystem::create_directory(folder / "tiles");
  for (const std::string name : {"n44e006", "n44e007"}) {
    std::vector<std::byte> samples(2 * 1201 * 1201);
    for (std::size_t i = 1; i < samples.size(); i += 2) samples[i] = std::byte{static_cast<unsigned char>(i / 9000)};
    write_file(folder / ("tiles/NASADEM_HGT_" + name + ".zip"),
               zip_archive({{name + ".num", {}}, {name + ".hgt", samples}}, true));
  }
  write_file(folder / "tiles/other.zip", zip_archive({{"readme.txt", {}}}, true));
  EXPECT_THAT(run({"plan", "tiles"}).out, HasSubstr("mosaic of 2 files"));
}

TEST_F(SilentFailures, LikeAGridWithoutAReferenceSystemKeepsItsPlace) {
  run({"convert", kVoids, "a.isohf", "-q"});
  run({"export", "a.isohf", "part.asc", "--bbox", "301500,5297000,304500,5299000", "-q"});
  run({"restore", "a.isohf", "with.npy", "--like", "part.asc", "-q"});
  std::filesystem::remove(folder / "part.prj");
  const RunResult result = run({"restore", "a.isohf", "without.npy", "--like", "part.asc"});
  EXPECT_THAT(result.err,
              HasSubstr("part.asc: does not say what its coordinates count (a .prj would); they are taken"));
  EXPECT_EQ(read_file(folder / "without.npy"), read_file(folder / "with.npy"));
  write_file(folder / "far.asc", "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n1 2 3\n4 5 6\n");
  EXPECT_THAT(run({"restore", "a.isohf", "far.npy", "--like", "far.asc"}).err, HasSubstr("North-West corner"));
}

}  // namespace
}  // namespace isohf::test
