#include "formats/photo/photo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/memory_photo.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

class Photo : public ReaderTest {
 protected:
  Photo() { set_module_folder(ISOHF_BIN_DIR); }

  /// A portable pixmap (3), or a graymap in text (1), of noise.
  std::string write_pixmap(const std::string& name, int width, int height, int channels) {
    std::string bytes =
        (channels == 3 ? "P6\n" : "P2\n") + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        if (channels == 1) bytes += std::to_string(noise(column, row, 0)) + ' ';
        for (int c = 0; c < channels && channels == 3; ++c) bytes.push_back(static_cast<char>(noise(column, row, c)));
      }
    }
    return write(name, bytes);
  }
};

TEST_F(Photo, ReadsWindowsOfAPictureLargerThanTheCache) {
  for (const int channels : {1, 3}) {
    const std::string path = write_pixmap("large.pnm", 3000, 1700, channels);
    const auto photo = open_photo(path);
    ASSERT_EQ(photo->info().width, 3000);
    ASSERT_EQ(photo->info().height, 1700);
    ASSERT_EQ(photo->info().channels, channels);
    EXPECT_FALSE(photo->info().georeference);
    photo->set_cache_bytes(1U << 20U);  // of 5 or 15 MB
    expect_noise(*photo, {{0, 0, 3000, 3},
                          {2999, 1699, 1, 1},
                          {1000, 40, 700, 300},
                          {5, 1500, 9, 200},
                          {0, 63, 64, 2},
                          {700, 10, 1, 1600}});
  }
}

TEST_F(Photo, RoundsDeeperSamples) {
  std::string bytes = "P6\n2 1\n65535\n";
  for (const int value : {0, 65535, 257 * 100, 257 * 100 + 128, 257 * 100 + 129, 300}) {
    bytes.push_back(static_cast<char>(value >> 8));
    bytes.push_back(static_cast<char>(value & 255));
  }
  const auto photo = open_photo(write("deep.ppm", bytes));
  EXPECT_EQ(window_of(*photo, {0, 0, 2, 1}), (std::vector<std::uint8_t>{0, 255, 100, 100, 101, 1}));
}

TEST_F(Photo, CodesLinearFloatsAsSrgb) {
  // Portable float map: grey, little-endian, rows from the bottom.
  std::string bytes = "Pf\n4 1\n-1.0\n";
  for (const float light : {0.0F, 0.2140411F, 1.0F, 7.0F}) bytes.append(reinterpret_cast<const char*>(&light), 4);
  const auto photo = open_photo(write("light.pfm", bytes));
  const auto samples = window_of(*photo, {0, 0, 4, 1});
  // 0.2140 is half on the sRGB scale; a reader that does not call the file linear gives 0.214 * 255.
  EXPECT_EQ(samples[0], 0);
  EXPECT_THAT(static_cast<int>(samples[1]), ::testing::AnyOf(127, 128, 55));
  EXPECT_EQ(samples[2], 255);
  EXPECT_EQ(samples[3], 255);
}

/// A GeoTIFF of bytes, `channels` interleaved; tags say nothing of alpha but `extra`.
std::string tiff_of(int channels, bool placed, std::vector<std::uint64_t> extra = {}) {
  const auto n = static_cast<std::uint64_t>(channels);
  TiffBytes tiff;
  tiff.image(4, 2, 8, 1, 2).shorts(258, std::vector<std::uint64_t>(n, 8)).shorts(277, {n});
  tiff.shorts(262, {channels >= 3 ? 2U : 1U}).shorts(339, std::vector<std::uint64_t>(n, 1));
  if (!extra.empty()) tiff.shorts(338, extra);
  if (placed) {
    tiff.doubles(33550, {10.0, 20.0, 0.0}).doubles(33922, {0, 0, 0, 500000.0, 4000000.0, 0.0});
    tiff.shorts(34735, {1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32632});
  }
  std::string pixels;
  for (int i = 0; i < 8 * channels; ++i) pixels.push_back(static_cast<char>(i * 5));
  return tiff.block(pixels).build();
}

TEST_F(Photo, TakesGreyRgbAndRgbaAndRefusesTheRest) {
  EXPECT_EQ(open_photo(write("1.tif", tiff_of(1, false)))->info().channels, 1);
  EXPECT_EQ(open_photo(write("3.tif", tiff_of(3, false)))->info().channels, 3);
  const auto rgba = open_photo(write("4.tif", tiff_of(4, false, {2})));
  EXPECT_EQ(rgba->info().channels, 4);
  EXPECT_TRUE(rgba->info().warnings.empty());
  EXPECT_EQ(window_of(*rgba, {1, 0, 1, 1}), (std::vector<std::uint8_t>{20, 25, 30, 35}));
  const auto infrared = open_photo(write("n.tif", tiff_of(4, false, {0})));
  EXPECT_EQ(infrared->info().channels, 3);
  ASSERT_EQ(infrared->info().warnings.size(), 1U);
  EXPECT_THAT(infrared->info().warnings[0], HasSubstr("first three"));
  for (const int channels : {2, 5}) {
    const std::string path = write("x.tif", tiff_of(channels, false));
    const Error error = error_of([&] { (void)open_photo(path); });
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_EQ(error.what(), path + ": has " + std::to_string(channels) + " channels; photos are grey, RGB or RGBA");
  }
}

TEST_F(Photo, ReadsGeoTiffTags) {
  const auto photo = open_photo(write("placed.tif", tiff_of(3, true)));
  ASSERT_TRUE(photo->info().georeference);
  const Georeference& place = *photo->info().georeference;
  EXPECT_DOUBLE_EQ(place.origin_x, 500005.0);  // the middle of the pixel whose corner is tied
  EXPECT_DOUBLE_EQ(place.origin_y, 3999990.0);
  EXPECT_DOUBLE_EQ(place.spacing_y, 20.0);
  EXPECT_EQ(place.system.epsg, 32632);
}

TEST_F(Photo, ReadsWorldFilesOfItsOwnExtension) {
  const std::string path = write_pixmap("map.ppm", 8, 4, 3);
  write("map.jgw", "1\n0\n0\n-1\n0\n0\n");
  EXPECT_FALSE(open_photo(path)->info().georeference);
  write("map.pmw", "0.5\n0\n0\n-0.25\n100\n200\n");
  write("map.prj", "LOCAL_CS[\"here\"]\n");
  const auto place = open_photo(path)->info().georeference;
  ASSERT_TRUE(place);
  EXPECT_EQ(place->origin_x, 100.0);
  EXPECT_EQ(place->origin_y, 200.0);
  EXPECT_EQ(place->spacing_x, 0.5);
  EXPECT_EQ(place->spacing_y, 0.25);
  EXPECT_EQ(place->system.wkt, "LOCAL_CS[\"here\"]");
  write("map.pmw", "0.5\n0\n0\n0.25\n100\n200\n");
  EXPECT_EQ(error_of([&] { (void)open_photo(path); }).code(), ErrorCode::kUnsupported);
  write("map.pmw", "0.5\n0.1\n0\n-0.25\n100\n200\n");
  EXPECT_EQ(error_of([&] { (void)open_photo(path); }).code(), ErrorCode::kUnsupported);
}

TEST_F(Photo, ReportsAMissingAndADamagedFileInOneLine) {
  EXPECT_EQ(error_of([&] { (void)open_photo(folder / "none.jpg"); }).code(), ErrorCode::kIo);
  const std::string text = write("notes.txt", "this is no picture");
  const Error unknown = error_of([&] { (void)open_photo(text); });
  EXPECT_EQ(unknown.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(unknown.what(), HasSubstr(text));
  const std::string whole = write_pixmap("whole.ppm", 40, 30, 3);
  const std::string bytes = read_file(whole);
  for (std::size_t length = 1; length < bytes.size(); length += 97) {
    const std::string cut = write("cut.ppm", bytes.substr(0, length));
    const Error error = error_of([&] {
      const auto photo = open_photo(cut);
      (void)window_of(*photo, {0, 0, photo->info().width, photo->info().height});
    });
    EXPECT_THAT(error.what(), HasSubstr(cut));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace isohf::test
