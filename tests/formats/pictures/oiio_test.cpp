#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
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

  /// An 8-bit portable pixmap whose channels differ.
  std::string write_pixmap() {
    std::string bytes = "P6\n4 2\n255\n";
    for (char value = 0; value < 24; ++value) bytes.push_back(value);
    return write("colours.ppm", bytes);
  }
};

TEST_F(OiioModule, ReadsWhatNoNativeReaderKnows) {
  const auto source = open_raster(write_floatmap(), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.format, "pnm");
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

TEST_F(OiioModule, KeepsNoMoreThanItIsAskedTo) {
  const auto source = open_raster(write_floatmap(), {});
  EXPECT_EQ(source->buffer_bytes(1), 4U * kWidth);
  EXPECT_EQ(source->buffer_bytes(9 * kWidth), 4U * 2 * kWidth);
  EXPECT_EQ(source->buffer_bytes(UINT64_MAX), 4U * kWidth * kHeight);
  const auto whole = read_window(*source, {2, 1, 9, 15});
  source->limit_buffers(1);
  EXPECT_EQ(read_window(*source, {2, 1, 9, 15}), whole);
}

TEST_F(OiioModule, ReadsTheChannelAskedFor) {
  const std::string path = write_pixmap();
  EXPECT_THAT(error_of([&] { (void)open_raster(path, {}); }).what(),
              HasSubstr("is a colour picture with channels R, G, B; say which one holds elevations"));
  for (const char* name : {"G", "1"}) {
    const auto source = open_raster(path, of_channel(name));
    const auto samples = read_whole(*source);
    ASSERT_EQ(samples.size(), 8U);
    for (std::size_t at = 0; at < samples.size(); ++at) EXPECT_EQ(static_cast<std::size_t>(samples[at]), at * 3 + 1);
  }
  const Error error = error_of([&] { (void)open_raster(path, of_channel("Z")); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(error.what(), path + ": has no channel \"Z\"; it has R, G, B (or 0...2)");
}

TEST_F(OiioModule, UnpacksElevationsOutOfColours) {
  std::filesystem::create_directories(folder / "4/3");
  const std::string path = folder / "4/3/5.ppm";
  std::string bytes = "P6\n16 16\n255\n";
  for (int at = 0; at < 256; ++at) {
    const int code = 100000 + 37 * at;
    for (const int byte : {code >> 16, code >> 8, code}) bytes.push_back(static_cast<char>(byte & 0xFF));
  }
  write_file(path, bytes);
  const auto source = open_raster(path, of_channel("mapbox"));
  EXPECT_TRUE(source->info().warnings.empty());
  EXPECT_EQ(source->info().georeference.system.epsg, 3857);
  const auto samples = read_window(*source, {3, 2, 4, 5});
  for (std::size_t at = 0; at < 20; ++at) {
    EXPECT_EQ(value_at(source->info().sample_type, samples, at),
              static_cast<double>(100000 + 37 * ((2 + at / 4) * 16 + 3 + at % 4)));
  }
  const auto untold = open_raster(path, {});
  EXPECT_THAT(untold->info().warnings, ::testing::ElementsAre(HasSubstr("decoded as with `encoding` mapbox")));
  EXPECT_EQ(read_whole(*untold), read_whole(*source));
}

TEST_F(OiioModule, RefusesFilesWhoseNumbersItWouldNotGet) {
  const auto refuses = [&](const std::string& name, const std::string& bytes, const char* why) {
    const std::string path = write(name, bytes);
    const Error error = error_of([&] { (void)open_raster(path, {}); });
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_EQ(std::string(error.what()).rfind(path + ": " + why, 0), 0U) << error.what();
  };
  refuses("a.pgm", "P2\n# of metres\n2 2\n200\n0 1 199 200\n", "the largest value is stated as 200, and OpenImageIO");
  refuses("b.pgm", "P2 2 2 65535 0 1 2 3", "OpenImageIO rounds the samples of any-maps of 16 bits");
  refuses("c.ppm", "P6 2 1 100\nabcdef",
          "the largest value is stated as 100, and OpenImageIO spreads the samples over 0 to 255");
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
  refuses("d.fits", fits, "OpenImageIO displaces the rows of FITS images; store the raster as TIFF or PNG");
}

TEST_F(OiioModule, AppliesTheOpenOptions) {
  OpenOptions options;
  options.z_scale = 0.5;
  options.void_values = {7.0};
  const auto source = open_raster(write_floatmap(), options);
  EXPECT_EQ(source->info().z_scale, 0.5);
  EXPECT_EQ(source->info().void_values, std::vector<double>{7.0});
  options.z_scale = 0.0;
  EXPECT_EQ(error_of([&] { (void)open_raster(write_floatmap(), options); }).code(), ErrorCode::kInvalidArgument);
}

TEST_F(OiioModule, ReportsTruncationAndForeignFilesInOneLine) {
  const std::string whole = write_floatmap();
  const auto bytes = read_file(whole);
  const std::string cut = folder / "cut.pfm";
  for (std::size_t length = 1; length < bytes.size(); length += 13) {
    write_file(cut, bytes.substr(0, length));
    const Error error = error_of([&] { (void)read_whole(*open_raster(cut, {})); });
    EXPECT_THAT(error.what(), HasSubstr(cut));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  }
  const std::string text = write("notes.txt", "this is no raster");
  const Error error = error_of([&] { (void)open_raster(text, {}); });
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("unknown format: this is text; isohf formats lists what is read"));
  EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
}

}  // namespace
}  // namespace isohf::test
