// The real programs: what convert cuts out of a photo, the viewer shows.
#include <gtest/gtest.h>

#include <algorithm>

#include "program_fixture.h"
#include "support/rasters/memory_photo.h"

namespace isohf::test {
namespace {

class TextureProgramTest : public ProgramFixture {
 protected:
  TextureProgramTest() {
    std::string pixels = "P6\n512 384\n255\n";
    for (int i = 0; i < 512 * 384; ++i) {
      for (int c = 0; c < 3; ++c) pixels.push_back(static_cast<char>(noise(i % 512 / 16, i / 512 / 16, c)));
    }
    write_file(folder_ / "photo.ppm", pixels);
  }
};

TEST_F(TextureProgramTest, ShowsTexturesUnlessAskedForOtherColours) {
  convert({"--texture", folder_ / "photo.ppm"});
  const std::string textured = picture({});
  EXPECT_EQ(picture({"--mode", "texture"}), textured);
  EXPECT_EQ(picture({"--memory", "16M", "--threads", "3"}), textured);
  const std::string elevation = picture({"--mode", "elevation"});
  EXPECT_NE(elevation, textured);
  convert({});
  EXPECT_EQ(picture({}), elevation);
  const RunResult refused = view({"--mode", "texture", "--screenshot", folder_ / "b.png"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  EXPECT_NE(refused.err.find("convert with --texture"), std::string::npos);
}

TEST_F(TextureProgramTest, PassesVerify) {
  convert({"--texture", folder_ / "photo.ppm", "--texture-format", "png"});
  EXPECT_EQ(view({"--verify"}).exit_code, 0);
}

TEST_F(TextureProgramTest, NamesABrokenTextureInOneLine) {
  convert({"--texture", folder_ / "photo.ppm", "--texture-format", "png"});
  std::string bytes = read_file(archive());
  const std::size_t at = bytes.find("textures/0/0/8.png");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 60] ^= 0x55;
  write_file(archive(), bytes);
  const RunResult result = view({"--screenshot", folder_ / "b.png"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("textures/0/0/8.png"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace isohf::test
