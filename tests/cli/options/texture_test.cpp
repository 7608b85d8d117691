#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;

class TextureOption : public testing::Test {
 protected:
  TextureOption() {
    write_int16_tiff(folder / "a.tif", 200, 120, [](std::int64_t c, std::int64_t r) {
      return static_cast<std::int16_t>(100 + noise(c / 8, r / 8, 0) / 16);
    });
    write_pixmap("photo.ppm", 400, 240);
  }

  void write_pixmap(const std::string& name, int width, int height) {
    std::string bytes = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
    for (int i = 0; i < width * height * 3; ++i) bytes.push_back(static_cast<char>(noise(i, 0, 0)));
    write_file(folder / name, bytes);
  }

  RunResult convert(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {"convert", "--overwrite", "--shape", "52x67", folder / "a.tif", folder / "a.isohf"});
    return run_isohf(arguments);
  }

  TemporaryFolder folder;
};

TEST_F(TextureOption, CutsTexturesThatInfoTellsAndVerifyChecks) {
  const RunResult result = convert({"--texture", folder / "photo.ppm"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const RunResult info = run_isohf({"info", folder / "a.isohf"});
  EXPECT_THAT(info.out, HasSubstr("128 x 128 texels a tile, 5 levels, jpeg 90, RGB: 60 members, "));
  EXPECT_THAT(info.out, HasSubstr("from photo.ppm, 400 x 240 pixels, placed by source"));
  const json metadata = json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out).at("metadata");
  EXPECT_EQ(metadata.at("textures"), json::array({"textures/ROW/COLUMN/SIZE.jpg"}));
  EXPECT_EQ(metadata.at("tile_textures").at("photo").at("format"), "pnm");
  EXPECT_EQ(metadata.at("tile_textures").at("size"), 128);
  EXPECT_EQ(run_isohf({"verify", folder / "a.isohf"}).exit_code, 0);
}

TEST_F(TextureOption, TakesASize) {
  const RunResult made = convert({"--texture", folder / "photo.ppm", "--texture-size=64", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const json summary = json::parse(made.out);
  EXPECT_EQ(summary.at("metadata").at("tile_textures").at("format"), "jpeg");
  EXPECT_EQ(summary.at("metadata").at("tile_textures").at("size"), 64);
  EXPECT_EQ(summary.at("texture_bytes"), summary.at("metadata").at("tile_textures").at("bytes"));
  EXPECT_GT(summary.at("photo_pixels_per_texel"), 1.0);
}

TEST_F(TextureOption, RefusesWhatItCannotUse) {
  const auto refused = [&](const std::vector<std::string>& arguments, int exit_code, const std::string& text) {
    const RunResult result = convert(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, StartsWith("isohf"));
    EXPECT_THAT(result.err, HasSubstr(text));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.isohf"));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.isohf.part"));
  };
  refused({"--texture-size", "128"}, 2, "--texture-size requires --texture");
  refused({"--texture", folder / "photo.ppm", "--texture-size", "100"}, 2, "power of two");
  refused({"--texture", folder / "none.jpg"}, 1, "none.jpg");
  write_file(folder / "text.jpg", "no picture at all");
  refused({"--texture", folder / "text.jpg"}, 1, "text.jpg");
  const std::string whole = read_file(folder / "photo.ppm");
  write_file(folder / "cut.ppm", whole.substr(0, whole.size() / 2));
  refused({"--texture", folder / "cut.ppm"}, 1, "cut.ppm");
}

TEST_F(TextureOption, ShadeShowsThePhoto) {
  // Red West of column 200, blue East of it.
  std::string bytes = "P6\n400 240\n255\n";
  for (int i = 0; i < 400 * 240; ++i) bytes += i % 400 < 200 ? std::string("\xC8\0\0", 3) : std::string("\0\0\xC8", 3);
  write_file(folder / "halves.ppm", bytes);
  ASSERT_EQ(convert({"--texture", folder / "halves.ppm"}).exit_code, 0);
  for (const char* size : {"400x240", "90x54"}) {
    const RunResult result = run_isohf({"shade", folder / "a.isohf", "-o", folder / "s.tif", "--texture", "--no-shadow",
                                        "--exaggeration", "0.001", "--size", size, "--overwrite"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    OpenOptions channel;
    const auto row_of = [&](const char* name) {
      channel.channel = name;
      const auto source = open_raster(folder / "s.tif", channel);
      std::vector<std::byte> row(static_cast<std::size_t>(source->info().width));
      source->read_window({0, source->info().height / 2, source->info().width, 1}, row);
      return row;
    };
    const auto red = row_of("R");
    const auto blue = row_of("B");
    const std::size_t middle = red.size() / 2;
    for (std::size_t i = 0; i < red.size(); ++i) {
      if (i + 2 > middle && i < middle + 2) continue;
      // JPEG leaves a little of the other colour.
      EXPECT_EQ(red[i] > std::byte{60}, i < middle) << i;
      EXPECT_EQ(blue[i] > std::byte{60}, i >= middle) << i;
    }
  }
  ASSERT_EQ(convert({}).exit_code, 0);
  const RunResult none = run_isohf({"shade", folder / "a.isohf", "-o", folder / "n.png", "--texture"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("convert with --texture"));
}

TEST_F(TextureOption, WarnsOfAPhotoOfAnotherShape) {
  write_pixmap("square.ppm", 100, 100);
  const RunResult result = convert({"--texture", folder / "square.ppm"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, StartsWith("isohf convert: warning: "));
  EXPECT_THAT(result.err, HasSubstr("does it show the same ground?"));
}

}  // namespace
}  // namespace isohf::test
