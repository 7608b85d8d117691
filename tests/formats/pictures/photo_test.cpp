#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <fstream>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/photo/photo.h"
#include "formats/reader_failure.h"
#include "isohf/archive/textures/picture_codec.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

class Photo : public ReaderTest {
 protected:
  /// Noise as a raster file of bytes.
  std::string write_noise(const std::string& name, int width, int height, int channels) {
    std::vector<std::byte> samples;
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        for (int c = 0; c < channels; ++c) samples.push_back(static_cast<std::byte>(noise(column, row, c)));
      }
    }
    write_raster(folder / name, raster_spec(width, height, SampleType::kUint8, channels), samples);
    return folder / name;
  }
};

Picture noise_picture(int width, int height, int channels) {
  Picture picture(width, height, channels);
  for (int row = 0; row < height; ++row) {
    for (int i = 0; i < width * channels; ++i) {
      picture.row(row)[i] = static_cast<std::uint8_t>(noise(i / channels / 9, row / 9, i % channels));
    }
  }
  return picture;
}

/// A TIFF of bytes whose pixels are 0, 1, 2, ...
TiffBytes tiff_of(int channels, std::uint64_t photometric, int bits = 8) {
  const auto n = static_cast<std::uint64_t>(channels);
  TiffBytes tiff;
  tiff.image(4, 2, bits, 1, 2).shorts(258, std::vector<std::uint64_t>(n, static_cast<std::uint64_t>(bits)));
  tiff.shorts(277, {n}).shorts(262, {photometric}).shorts(339, std::vector<std::uint64_t>(n, 1));
  return tiff;
}

std::string counting(int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(i));
  return text;
}

TEST_F(Photo, ReadsWindowsOfPngAndTiffLargerThanTheCache) {
  for (const char* name : {"p.png", "t.tif"}) {
    for (const int channels : {1, 3, 4}) {
      std::filesystem::remove(folder / name);
      const auto photo = open_photo(write_noise(name, 700, 500, channels));
      ASSERT_EQ(photo->info().width, 700);
      ASSERT_EQ(photo->info().height, 500);
      ASSERT_EQ(photo->info().channels, channels);
      EXPECT_TRUE(photo->info().warnings.empty());
      photo->set_cache_bytes(1U << 16U);
      expect_noise(
          *photo,
          {{0, 0, 700, 3}, {699, 499, 1, 1}, {300, 40, 100, 300}, {5, 400, 9, 100}, {0, 63, 64, 2}, {600, 10, 1, 400}});
    }
  }
}

TEST_F(Photo, ReadsJpegAsItsLibraryDoesAlsoBackwards) {
  for (const int channels : {1, 3}) {
    const std::vector<std::byte> bytes = encode_jpeg(noise_picture(130, 200, channels), 80);
    const Picture whole = decode_jpeg(bytes, 1000);
    const auto photo = open_photo(write("a.jpg", bytes));
    EXPECT_EQ(photo->info().format, "jpeg");
    ASSERT_EQ(photo->info().channels, channels);
    for (const std::int64_t row : {150, 0, 64, 199, 63}) {
      const auto samples = window_of(*photo, {0, row, 130, 1});
      EXPECT_TRUE(std::equal(samples.begin(), samples.end(), whole.row(static_cast<int>(row)))) << row;
    }
  }
}

TEST_F(Photo, ReadsWebpAsTheRasterReaderDoes) {
  const std::string path = std::string(ISOHF_SOURCE_DIR) + "/tests/formats/data/small.webp";
  const auto photo = open_photo(path);
  EXPECT_EQ(photo->info().format, "webp");
  ASSERT_EQ(photo->info().channels, 3);
  const auto samples = window_of(*photo, {0, 0, 8, 8});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const std::vector<double> wanted = values_of(*open_raster(path, of_channel(std::to_string(channel))));
    for (std::size_t i = 0; i < wanted.size(); ++i) ASSERT_EQ(samples[3 * i + channel], wanted[i]) << i;
  }
}

/// OpenImageIO and what it brings cost start-up time and memory.
TEST_F(Photo, LoadsNoModuleForPngJpegAndTiff) {
  for (const std::string& path : {write_noise("a.png", 9, 7, 3), write_noise("a.tif", 9, 7, 3),
                                  write("a.jpg", encode_jpeg(noise_picture(9, 7, 3), 90))}) {
    (void)window_of(*open_photo(path), {0, 0, 9, 7});
  }
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    for (const char* library : {"libgdal", "OpenImageIO", "isohf_oiio"}) {
      EXPECT_EQ(line.find(library), std::string::npos) << line;
    }
  }
}

TEST_F(Photo, RoundsSixteenBitsAndExpandsPalettesOfPng) {
  std::array<std::uint16_t, 6> deep = {0, 65535, 257 * 100, 257 * 100 + 128, 257 * 100 + 129, 300};
  write_raster(folder / "deep.png", raster_spec(6, 1, SampleType::kUint16), std::as_bytes(std::span(deep)));
  EXPECT_EQ(window_of(*open_photo(folder / "deep.png"), {0, 0, 6, 1}),
            (std::vector<std::uint8_t>{0, 255, 100, 100, 101, 1}));

  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = 4;
  image.height = 1;
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = 2;
  const std::array<std::uint8_t, 4> indices = {0, 1, 1, 0};
  const std::array<std::uint8_t, 6> colours = {10, 20, 30, 200, 210, 220};
  const std::string path = folder / "palette.png";
  ASSERT_NE(png_image_write_to_file(&image, path.c_str(), 0, indices.data(), 4, colours.data()), 0);
  const auto photo = open_photo(path);
  EXPECT_EQ(photo->info().channels, 3);
  EXPECT_EQ(window_of(*photo, {1, 0, 3, 1}), (std::vector<std::uint8_t>{200, 210, 220, 200, 210, 220, 10, 20, 30}));
}

TEST_F(Photo, ReadsPlanesPalettesAndInvertedGreysOfTiff) {
  TiffBytes planes = tiff_of(3, 2);
  planes.shorts(284, {2});
  for (int i = 0; i < 3; ++i) planes.block(counting(8 * (i + 1)).substr(static_cast<std::size_t>(8 * i)));
  EXPECT_EQ(window_of(*open_photo(write("planes.tif", planes.build())), {1, 0, 2, 1}),
            (std::vector<std::uint8_t>{1, 9, 17, 2, 10, 18}));

  std::vector<std::uint64_t> colours;
  for (std::uint64_t c = 0; c < 3; ++c) {
    for (std::uint64_t i = 0; i < 256; ++i) colours.push_back(257 * (i + c));
  }
  TiffBytes palette = tiff_of(1, 3);
  palette.shorts(320, colours).block(counting(8));
  const auto photo = open_photo(write("palette.tif", palette.build()));
  EXPECT_EQ(photo->info().channels, 3);
  EXPECT_EQ(window_of(*photo, {1, 0, 2, 1}), (std::vector<std::uint8_t>{1, 2, 3, 2, 3, 4}));

  EXPECT_EQ(window_of(*open_photo(write("inverted.tif", tiff_of(1, 0).block(counting(8)).build())), {0, 1, 2, 1}),
            (std::vector<std::uint8_t>{251, 250}));
}

/// A GeoTIFF of bytes, `channels` interleaved; tags say nothing of alpha but `extra`.
std::string map_of(int channels, bool placed, std::vector<std::uint64_t> extra = {}) {
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
  EXPECT_EQ(open_photo(write("1.tif", map_of(1, false)))->info().channels, 1);
  EXPECT_EQ(open_photo(write("3.tif", map_of(3, false)))->info().channels, 3);
  const auto rgba = open_photo(write("4.tif", map_of(4, false, {2})));
  EXPECT_EQ(rgba->info().channels, 4);
  EXPECT_TRUE(rgba->info().warnings.empty());
  EXPECT_EQ(window_of(*rgba, {1, 0, 1, 1}), (std::vector<std::uint8_t>{20, 25, 30, 35}));
  const auto infrared = open_photo(write("n.tif", map_of(4, false, {0})));
  EXPECT_EQ(infrared->info().channels, 3);
  ASSERT_EQ(infrared->info().warnings.size(), 1U);
  EXPECT_THAT(infrared->info().warnings[0], HasSubstr("first three"));
}

TEST_F(Photo, ReadsGeoTiffTags) {
  const auto photo = open_photo(write("placed.tif", map_of(3, true)));
  ASSERT_TRUE(photo->info().georeference);
  const Georeference& place = *photo->info().georeference;
  EXPECT_DOUBLE_EQ(place.origin_x, 500005.0);  // the middle of the pixel whose corner is tied
  EXPECT_DOUBLE_EQ(place.origin_y, 3999990.0);
  EXPECT_DOUBLE_EQ(place.spacing_y, 20.0);
  EXPECT_EQ(place.system.epsg, 32632);
}

TEST_F(Photo, ReadsWorldFilesOfItsOwnExtension) {
  const std::string path = write_noise("map.png", 8, 4, 3);
  write("map.jgw", "1\n0\n0\n-1\n0\n0\n");
  EXPECT_FALSE(open_photo(path)->info().georeference);
  write("map.pgw", "0.5\n0\n0\n-0.25\n100\n200\n");
  write("map.prj", "LOCAL_CS[\"here\"]\n");
  const auto place = open_photo(path)->info().georeference;
  ASSERT_TRUE(place);
  EXPECT_EQ(place->origin_x, 100.0);
  EXPECT_EQ(place->origin_y, 200.0);
  EXPECT_EQ(place->spacing_x, 0.5);
  EXPECT_EQ(place->spacing_y, 0.25);
  EXPECT_EQ(place->system.wkt, "LOCAL_CS[\"here\"]");
  write("map.pgw", "0.5\n0\n0\n0.25\n100\n200\n");
  EXPECT_EQ(error_of([&] { (void)open_photo(path); }).code(), ErrorCode::kUnsupported);
  write("map.pgw", "0.5\n0.1\n0\n-0.25\n100\n200\n");
  EXPECT_EQ(error_of([&] { (void)open_photo(path); }).code(), ErrorCode::kUnsupported);
}

TEST_F(Photo, SaysThatItIgnoresOrientationTags) {
  TiffBytes tiff = tiff_of(3, 2);
  tiff.shorts(274, {6}).block(counting(24));
  const auto turned = open_photo(write("turned.tif", tiff.build()));
  ASSERT_EQ(turned->info().warnings.size(), 1U);
  EXPECT_THAT(turned->info().warnings[0], HasSubstr("orientation tag is ignored"));
  // EXIF in both byte orders, behind the marker that begins the file.
  for (const std::string& exif : {std::string("II\x2A\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\x08\0\0\0\0\0\0\0", 26),
                                  std::string("MM\0\x2A\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\x08\0\0\0\0\0\0", 26)}) {
    const std::vector<std::byte> plain = encode_jpeg(noise_picture(8, 8, 3), 90);
    std::string bytes(reinterpret_cast<const char*>(plain.data()), plain.size());
    bytes.insert(2, std::string("\xFF\xE1\0\x22"
                                "Exif\0\0",
                                10) +
                        exif);
    const auto photo = open_photo(write("exif.jpg", bytes));
    ASSERT_EQ(photo->info().warnings.size(), 1U);
    EXPECT_THAT(photo->info().warnings[0], HasSubstr("orientation tag is ignored"));
  }
}

TEST_F(Photo, RefusesWhatItCannotReadInOneLine) {
  const auto refused = [&](const std::string& path, ErrorCode code, const std::string& text) {
    const Error error = error_of([&] {
      const auto photo = open_photo(path);
      (void)window_of(*photo, {0, 0, photo->info().width, photo->info().height});
    });
    const std::string what = error.what();
    EXPECT_EQ(error.code(), code) << what;
    EXPECT_TRUE(what.starts_with(path + ": ")) << what;
    EXPECT_EQ(what.find(path, 1), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_THAT(what, HasSubstr(text));
  };
  refused(write("signed.tif", tiff_of(1, 1).shorts(339, {2}).block(counting(8)).build()), ErrorCode::kUnsupported,
          "gdal_translate -ot Byte");
  refused(write("ink.tif", tiff_of(4, 5).shorts(338, {2}).block(counting(32)).build()), ErrorCode::kUnsupported,
          "photometric interpretation 5");
  for (const int channels : {2, 5}) {
    refused(write("x.tif", map_of(channels, false)), ErrorCode::kUnsupported,
            "has " + std::to_string(channels) + " channels; photos are grey, RGB or RGBA");
  }
  refused(folder / "none.jpg", ErrorCode::kIo, "");
  refused(write("notes.txt", std::string("this is no picture")), ErrorCode::kUnsupported, "this is text");
  const std::vector<std::byte> jpeg = encode_jpeg(noise_picture(64, 64, 3), 90);
  for (std::size_t length : {std::size_t{4}, jpeg.size() / 2, jpeg.size() - 2}) {
    refused(write("cut.jpg", std::vector<std::byte>(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(length))),
            ErrorCode::kCorrupt, "JPEG");
  }
  const std::string png = read_file(write_noise("whole.png", 40, 30, 3));
  for (std::size_t length = 8; length < png.size(); length += 97) {
    refused(write("cut.png", png.substr(0, length)), ErrorCode::kCorrupt, "PNG");
  }
}

}  // namespace
}  // namespace isohf::test
