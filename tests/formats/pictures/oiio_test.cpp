/// Rasters and photos through OpenImageIO.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "formats/photo/photo.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/memory_photo.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 23;
constexpr int kHeight = 17;

int ground_at(int column, int row) {
  return column * 1000 + row * 7;
}

class OiioModule : public ReaderTest {
 protected:
  OiioModule() { set_module_folder(ISOHF_BIN_DIR); }

  /// A portable floatmap: little-endian, rows from the bottom.
  std::string write_floatmap() {
    std::string bytes = "Pf\n23 17\n-1.0\n";
    for (int row = kHeight; row-- > 0;) {
      for (int column = 0; column < kWidth; ++column) {
        const auto value = static_cast<float>(ground_at(column, row));
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
    return write("ground.pfm", bytes);
  }

  /// A Targa picture of 24 bits, rows from the top, whose numbers count in the order of the file: blue, green, red.
  std::string write_targa() {
    std::string bytes("\0\0\2\0\0\0\0\0\0\0\0\0\4\0\2\0\x18\x20", 18);
    for (char value = 0; value < 24; ++value) bytes.push_back(value);
    return write("colours.tga", bytes);
  }
};

TEST_F(OiioModule, ReadsWhatNoNativeReaderKnows) {
  OpenOptions options;
  for (const bool is_scaled : {false, true}) {
    if (is_scaled) options.z_scale = 0.5;
    const auto source = open_raster(write_floatmap(), options);
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "pnm");
    EXPECT_EQ(info.z_scale, is_scaled ? 0.5 : 1.0);
    ASSERT_EQ(info.width, kWidth);
    ASSERT_EQ(info.height, kHeight);
    ASSERT_EQ(info.sample_type, SampleType::kFloat32);
    EXPECT_TRUE(info.warnings.empty());
    for (const Window& window :
         {Window{0, 0, kWidth, kHeight}, Window{3, 9, 5, 4}, Window{20, 0, 3, 17}, Window{0, 16, 23, 1}}) {
      const auto samples = read_window(*source, window);
      for (int row = 0; row < window.rows; ++row) {
        for (int column = 0; column < window.columns; ++column) {
          const auto at = static_cast<std::size_t>(row * window.columns + column);
          EXPECT_EQ(value_at(info.sample_type, samples, at),
                    ground_at(static_cast<int>(window.column) + column, static_cast<int>(window.row) + row));
        }
      }
    }
  }
}

TEST_F(OiioModule, ReadsTheChannelAskedFor) {
  const std::string path = write_targa();
  EXPECT_THAT(error_of([&] { (void)open_raster(path, {}); }).what(),
              HasSubstr("is a picture with channels R, G, B; `channel` R reads one"));
  for (const char* name : {"B", "2"}) {
    const auto samples = read_whole(*open_raster(path, of_channel(name)));
    ASSERT_EQ(samples.size(), 8U);
    for (std::size_t at = 0; at < samples.size(); ++at) EXPECT_EQ(static_cast<std::size_t>(samples[at]), at * 3);
  }
  const Error error = error_of([&] { (void)open_raster(path, of_channel("Z")); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(error.what(), path + ": has no channel \"Z\"; it has R, G, B (or 0...2)");
}

TEST_F(OiioModule, RefusesWhatItWouldNotRead) {
  const auto refuses = [&](const std::string& name, const std::string& bytes, ErrorCode code, const char* why) {
    const std::string path = write(name, bytes);
    const Error error = error_of([&] { (void)read_whole(*open_raster(path, {})); });
    EXPECT_EQ(error.code(), code) << name;
    EXPECT_EQ(std::string(error.what()).rfind(path + ": " + why, 0), 0U) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  };
  // Numbers that OpenImageIO would change.
  refuses("a.pgm", "P2\n# of metres\n2 2\n200\n0 1 199 200\n", ErrorCode::kUnsupported,
          "OpenImageIO spreads or rounds the samples of any-maps; store the raster as TIFF or PNG");
  std::string fits;
  for (const char* card :
       {"SIMPLE  =                    T", "BITPIX  =                   16", "NAXIS   =                    2",
        "NAXIS1  =                    2", "NAXIS2  =                    2", "END"}) {
    std::string line = card;
    line.resize(80, ' ');
    fits += line;
  }
  fits.resize(2880, ' ');
  fits.resize(5760, '\0');
  refuses("d.fits", fits, ErrorCode::kUnsupported, "OpenImageIO displaces the rows of FITS images");
  refuses("notes.txt", "this is no raster", ErrorCode::kUnsupported,
          "unknown format: this is text; isohf formats lists what is read");
  const std::string bytes = read_file(write_floatmap());
  for (std::size_t length = 20; length < bytes.size(); length += 97) {
    refuses("cut.pfm", bytes.substr(0, length), ErrorCode::kCorrupt, "");
  }
}

TEST_F(OiioModule, ReadsPhotosThatNoNativeReaderKnows) {
  for (const int channels : {1, 3}) {
    // A portable pixmap, or a graymap in text.
    std::string bytes = std::string(channels == 3 ? "P6" : "P2") + "\n700 500\n255\n";
    for (int row = 0; row < 500; ++row) {
      for (int column = 0; column < 700; ++column) {
        if (channels == 1) bytes += std::to_string(noise(column, row, 0)) + ' ';
        for (int c = 0; c < channels && channels == 3; ++c) bytes.push_back(static_cast<char>(noise(column, row, c)));
      }
    }
    const auto photo = open_photo(write("large.pnm", bytes));
    ASSERT_EQ(photo->info().width, 700);
    ASSERT_EQ(photo->info().height, 500);
    ASSERT_EQ(photo->info().channels, channels);
    EXPECT_FALSE(photo->info().georeference);
    photo->set_cache_bytes(1U << 16U);
    expect_noise(*photo, {{0, 0, 700, 3}, {699, 499, 1, 1}, {100, 40, 70, 300}, {5, 400, 9, 100}, {0, 63, 64, 2}});
  }
  std::string deep = "P6\n2 1\n65535\n";
  for (const int value : {0, 65535, 257 * 100, 257 * 100 + 128, 257 * 100 + 129, 300}) {
    deep.push_back(static_cast<char>(value >> 8));
    deep.push_back(static_cast<char>(value & 255));
  }
  EXPECT_EQ(window_of(*open_photo(write("deep.ppm", deep)), {0, 0, 2, 1}),
            (std::vector<std::uint8_t>{0, 255, 100, 100, 101, 1}));
}

TEST_F(OiioModule, CodesLinearFloatsOfPhotosAsSrgb) {
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

}  // namespace
}  // namespace isohf::test
