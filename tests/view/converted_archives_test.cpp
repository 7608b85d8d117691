// The real programs: what convert stores, the viewer draws and checks.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "gl_test.h"
#include "support/rasters/memory_photo.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

/// The real programs: what convert stores, the viewer draws.
class ConvertedArchiveTest : public GlTest {
 protected:
  void convert(const std::vector<std::string>& options, const std::string& source = "coast_512x384_int16.tif") const {
    std::vector<std::string> command{"convert", ISOHF_SOURCE_DIR "/testdata/" + source, archive()};
    command.insert(command.end(), {"--overwrite", "--quiet", "--density", "0.1", "--shape", "52x59", "--levels", "3"});
    command.insert(command.end(), options.begin(), options.end());
    const RunResult result = run_isohf(command);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  void convert_peaks(const std::vector<std::string>& options) const {
    const std::string source = ISOHF_SOURCE_DIR "/testdata/peaks_256x256_uint16.png";
    const RunResult result =
        run_isohf(with_more({"convert", source, archive(), "--overwrite", "--quiet", "--levels", "3"}, options));
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

class TexturedArchiveTest : public ConvertedArchiveTest {
 protected:
  TexturedArchiveTest() {
    std::string pixels = "P6\n512 384\n255\n";
    for (int i = 0; i < 512 * 384; ++i) {
      for (int c = 0; c < 3; ++c) pixels.push_back(static_cast<char>(noise(i % 512 / 16, i / 512 / 16, c)));
    }
    write_file(folder_ / "photo.ppm", pixels);
  }
};

TEST_F(TexturedArchiveTest, ShowsTexturesUnlessAskedForOtherColours) {
  convert({"--texture", folder_ / "photo.ppm"});
  const std::string textured = picture({});
  EXPECT_EQ(picture({"--mode", "texture"}), textured);
  EXPECT_EQ(picture({"--memory", "16M", "--threads", "3"}), textured);
  EXPECT_EQ(view({"--verify"}).exit_code, 0);
  const std::string elevation = picture({"--mode", "elevation"});
  EXPECT_NE(elevation, textured);
  convert({});
  EXPECT_EQ(picture({}), elevation);
  const RunResult refused = view({"--mode", "texture", "--screenshot", folder_ / "b.png"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  EXPECT_NE(refused.err.find("convert with --texture"), std::string::npos);
}

/// Mountains over many tiles, under suns due East and West of any height that the seeds serve and some that they do not.
TEST_F(ConvertedArchiveTest, PicturesFromSeedsAreThoseOfTheSweep) {
  convert_peaks({"--shape", "36x43"});
  std::vector<std::string> swept;
  const std::vector<std::string> suns{"90,1.5", "90,4", "270,4", "90,12", "270,12", "270,40", "200,6"};
  for (const std::string& sun : suns) swept.push_back(picture({"--sun", sun}));
  convert_peaks({"--shape", "36x43", "--shadow-seeds"});
  for (std::size_t i = 0; i < suns.size(); ++i) EXPECT_EQ(picture({"--sun", suns[i]}), swept[i]) << suns[i];
}

TEST_F(ConvertedArchiveTest, SeedsGiveEachVertexWhatTheSweepOverWholeRowsGives) {
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"--shadow-seeds"}, {"--shadow-seeds", "--type", "u8"}, {"--shadow-seeds", "--type", "f32"}, {}}) {
    convert_peaks(with_more({"--shape", "100x115"}, options));
    const RunResult verified = view({"--verify", "--json"});
    EXPECT_EQ(verified.exit_code, 0) << verified.out;
    const auto report = nlohmann::json::parse(verified.out);
    EXPECT_GT(report.at("shadow_vertices"), 500000);
    EXPECT_EQ(report.at("seeded_vertices"), options.empty() ? 0 : report.at("shadow_vertices").get<int>());
    EXPECT_EQ(report.at("worst_shadow"), 0.0);
  }
}

/// Real files, converted with shadow seeds.
TEST_F(ConvertedArchiveTest, RealFilesPassVerify) {
  // Small ones of different kinds: floats in an archive of codes, of floats, of bytes; seeds of angles; voids.
  const std::vector<std::pair<std::string, std::vector<std::string>>> files{
      {"olinda_dem_utm25s.tif", {"--shadow-seeds"}},
      {"missionDEM_gale_hirise.tif", {"--shadow-seeds", "--type", "f32"}},
      {"ETOPO1_1deg.tif", {"--shadow-seeds", "--type", "u8"}},
      {"N41E002.hgt", {"--shadow-seeds", "--sun-min", "4", "--density", "0.02"}},
      {"mt_fuji_90m.tif", {"--shadow-seeds", "--density", "0.02", "--shape", "52x59", "--levels", "3"}}};
  int checked = 0;
  for (const auto& [name, options] : files) {
    if (kSanitized && checked == 2) break;
    const std::string source = real_data() / name;
    if (!std::filesystem::exists(source)) continue;
    SCOPED_TRACE(name);
    std::vector<std::string> command{"convert", source, archive(), "--overwrite", "--quiet"};
    command.insert(command.end(), options.begin(), options.end());
    const RunResult converted = run_isohf(command);
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    const RunResult verified = view({"--verify"});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    EXPECT_NE(verified.out.find("suns of "), std::string::npos) << verified.out;
    EXPECT_EQ(verified.err, "");
    ++checked;
  }
  if (checked == 0) GTEST_SKIP() << kNoRealFiles;
}

}  // namespace
}  // namespace isohf::test
