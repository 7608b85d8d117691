#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

struct Picture {
  std::uint32_t width = 37;
  std::uint32_t height = 41;
  int bit_depth = 16;
  int color_type = PNG_COLOR_TYPE_GRAY;
  bool interlaced = false;
  int transparent_gray = -1;  ///< tRNS, unless negative
  bool grey = false;          ///< all channels equal

  [[nodiscard]] std::uint32_t channels() const {
    switch (color_type) {
      case PNG_COLOR_TYPE_GRAY_ALPHA:
        return 2;
      case PNG_COLOR_TYPE_RGB:
        return 3;
      case PNG_COLOR_TYPE_RGB_ALPHA:
        return 4;
      default:
        return 1;
    }
  }
  [[nodiscard]] unsigned value(std::uint32_t column, std::uint32_t row, std::uint32_t channel) const {
    return (column * 977 + row * 3541 + (grey ? 0 : channel * 12345)) & ((1U << static_cast<unsigned>(bit_depth)) - 1U);
  }
  [[nodiscard]] std::size_t sample_bytes() const { return bit_depth == 16 ? 2 : 1; }
};

void write_picture(const std::string& path, const Picture& picture) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, picture.width, picture.height, picture.bit_depth, picture.color_type,
               picture.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  const png_color palette[4] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  if (picture.color_type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 4);
  png_set_gAMA(png, info, 0.45);  // must change nothing
  if (picture.transparent_gray >= 0) {
    png_color_16 gray{};
    gray.gray = static_cast<png_uint_16>(picture.transparent_gray);
    png_set_tRNS(png, info, nullptr, 0, &gray);
  }
  png_write_info(png, info);
  if (picture.bit_depth < 8) png_set_packing(png);
  std::vector<std::vector<png_byte>> rows(picture.height);
  std::vector<png_bytep> pointers;
  for (std::uint32_t row = 0; row < picture.height; ++row) {
    for (std::uint32_t column = 0; column < picture.width; ++column) {
      for (std::uint32_t channel = 0; channel < picture.channels(); ++channel) {
        const unsigned value = picture.value(column, row, channel);
        if (picture.bit_depth == 16) rows[row].push_back(static_cast<png_byte>(value >> 8U));
        rows[row].push_back(static_cast<png_byte>(value & 0xFFU));
      }
    }
    pointers.push_back(rows[row].data());
  }
  png_write_image(png, pointers.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

std::vector<std::byte> expected_window(const Picture& picture, std::uint32_t channel, const Window& window) {
  std::vector<std::byte> samples;
  for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
    for (std::int64_t column = window.column; column < window.column + window.columns; ++column) {
      const unsigned value =
          picture.value(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), channel);
      samples.push_back(static_cast<std::byte>(value & 0xFFU));
      if (picture.bit_depth == 16) samples.push_back(static_cast<std::byte>(value >> 8U));
    }
  }
  return samples;
}

std::vector<std::byte> expected_whole(const Picture& picture, std::uint32_t channel = 0) {
  return expected_window(picture, channel, {0, 0, picture.width, picture.height});
}

class PngSource : public InFolder {
 protected:
  const std::string path = folder / "picture.png";
};

TEST_F(PngSource, ReadsEveryDepthAndChannelAsStored) {
  const std::vector<std::pair<int, std::vector<int>>> kinds = {{PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16}},
                                                               {PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16}},
                                                               {PNG_COLOR_TYPE_RGB, {8, 16}},
                                                               {PNG_COLOR_TYPE_RGB_ALPHA, {8, 16}}};
  const std::vector<std::vector<std::string>> names = {{}, {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
  for (const auto& [color_type, depths] : kinds) {
    for (const int depth : depths) {
      for (const bool interlaced : {false, true}) {
        Picture picture{.bit_depth = depth, .color_type = color_type, .interlaced = interlaced};
        SCOPED_TRACE(fmt::format("colour type {} depth {} interlaced {}", color_type, depth, interlaced));
        write_picture(path, picture);
        for (std::uint32_t channel = 0; channel < picture.channels(); ++channel) {
          for (const std::string& name : {names[picture.channels()][channel], std::to_string(channel)}) {
            const auto source = open_png(path, of_channel(name));
            EXPECT_EQ(read_whole(*source), expected_whole(picture, channel));
            EXPECT_EQ(source->info().sample_type, depth == 16 ? SampleType::kUint16 : SampleType::kUint8);
            EXPECT_TRUE(source->info().warnings.empty());
            EXPECT_EQ(source->info().channel, picture.channels() > 1 ? names[picture.channels()][channel] : "");
          }
        }
      }
    }
  }
}

TEST_F(PngSource, DeliversWindowsInAnyOrder) {
  Picture picture;
  picture.height = 3000;  // more rows than are kept
  write_picture(path, picture);
  const auto source = open_png(path, {});
  for (const std::int64_t row : {0, 2990, 5, 2990, 1500, 1400, 700, 699, 0}) {
    const Window window = {3, row, 20, 9};
    ASSERT_EQ(read_window(*source, window), expected_window(picture, 0, window)) << "row " << row;
  }
  EXPECT_EQ(read_whole(*source), expected_whole(picture));
}

TEST_F(PngSource, WantsToKnowWhatTheColoursOfAPictureAre) {
  Picture picture{.bit_depth = 8, .color_type = PNG_COLOR_TYPE_RGB};
  for (const int depth : {8, 16}) {
    picture.bit_depth = depth;
    write_picture(path, picture);
    const Error error = error_of([&] { (void)open_png(path, {}); });
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr("is a colour picture with channels R, G, B"));
    EXPECT_THAT(error.what(), HasSubstr("`channel` R"));
    EXPECT_THAT(error.what(), HasSubstr("`encoding` terrarium"));
    EXPECT_TRUE(open_png(path, of_channel("R"))->info().warnings.empty());
  }
  picture.grey = true;
  for (const int depth : {16, 8}) {
    picture.bit_depth = depth;
    write_picture(path, picture);
    const auto in_greys = open_png(path, {});
    EXPECT_EQ(in_greys->info().channel, "R");
    EXPECT_EQ(in_greys->info().sample_type, depth == 8 ? SampleType::kUint8 : SampleType::kUint16);
    ASSERT_EQ(in_greys->info().warnings.size(), 1U);
    EXPECT_THAT(in_greys->info().warnings[0], HasSubstr("greys"));
  }
  picture.grey = false;
  picture.color_type = PNG_COLOR_TYPE_GRAY_ALPHA;
  write_picture(path, picture);
  const auto source = open_png(path, {});
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("transparent"));
  picture.color_type = PNG_COLOR_TYPE_GRAY;
  write_picture(path, picture);
  EXPECT_TRUE(open_png(path, {})->info().warnings.empty());
}

TEST_F(PngSource, KnowsHowElevationsArePackedWithoutBeingTold) {
  if (real_files().empty()) GTEST_SKIP() << kNoRealFiles;
  for (const auto& [name, encoding] : {std::pair{"terrarium.png", "terrarium"},
                                       {"derived/n44e006_mapbox.png", "mapbox"},
                                       {"gale_rgba_float_16_57775_31917.png", "rgba-float"}}) {
    SCOPED_TRACE(name);
    const std::string file = real_data() / name;
    const auto source = open_raster(file, of_channel(encoding));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.channel, encoding);
    EXPECT_EQ(info.vertical_unit, "metre");
    EXPECT_TRUE(info.warnings.empty());
    const auto all = read_whole(*source);
    // The bytes leave no doubt: the same without being told, and a warning says so.
    const auto untold = open_raster(file, {});
    EXPECT_EQ(untold->info().channel, encoding);
    ASSERT_EQ(untold->info().warnings.size(), 1U);
    EXPECT_THAT(untold->info().warnings[0], HasSubstr(fmt::format("decoded as with `encoding` {}", encoding)));
    EXPECT_EQ(read_whole(*untold), all);
    const auto red = open_raster(file, of_channel("R"));
    EXPECT_EQ(red->info().sample_type, SampleType::kUint8);
    EXPECT_TRUE(red->info().warnings.empty());
  }
}

TEST_F(PngSource, TakesTransparentPixelsOfPackedElevationsAsVoid) {
  Picture picture{.bit_depth = 8, .color_type = PNG_COLOR_TYPE_RGB_ALPHA};
  write_picture(path, picture);
  const auto source = open_raster(path, of_channel("mapbox"));
  EXPECT_EQ(source->info().void_values, std::vector<double>{-1.0});
  const std::vector<double> values = values_of(*source);
  int voids = 0;
  for (std::uint32_t row = 0; row < picture.height; ++row) {
    for (std::uint32_t column = 0; column < picture.width; ++column) {
      const auto channel = [&](std::uint32_t c) { return static_cast<double>(picture.value(column, row, c)); };
      const bool is_void = channel(3) == 0.0;
      voids += is_void ? 1 : 0;
      ASSERT_EQ(values[row * picture.width + column],
                is_void ? -1.0 : channel(0) * 65536 + channel(1) * 256 + channel(2));
    }
  }
  EXPECT_GT(voids, 0);
}

TEST_F(PngSource, UnpacksElevationsOutOfAPalette) {
  Picture picture{.bit_depth = 2, .color_type = PNG_COLOR_TYPE_PALETTE};
  write_picture(path, picture);
  const Error error = error_of([&] { (void)open_raster(path, {}); });
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), AllOf(HasSubstr("palette"), HasSubstr("unless these are packed into them")));
  const std::vector<double> values = values_of(*open_raster(path, of_channel("mapbox")));
  for (std::uint32_t row = 0; row < picture.height; ++row) {
    for (std::uint32_t column = 0; column < picture.width; ++column) {
      ASSERT_EQ(values[row * picture.width + column], picture.value(column, row, 0) * 0x010101);
    }
  }
}

TEST_F(PngSource, PlacesTilesOfWebMapsByTheirNumbers) {
  std::filesystem::create_directories(folder / "3/5");
  Picture picture;
  picture.width = picture.height = 32;
  picture.bit_depth = 8;
  picture.color_type = PNG_COLOR_TYPE_RGB;
  const OpenOptions packed = of_channel("terrarium");
  const auto place_of = [&](const std::string& name, const OpenOptions& options) {
    write_picture(folder / name, picture);
    return open_raster(folder / name, options)->info().georeference;
  };
  constexpr double kTile = 40075016.68557849 / 8.0;
  for (const char* name : {"3/5/2.png", "3/5/2@2x.png"}) {
    const Georeference place = place_of(name, packed);
    EXPECT_EQ(place.registration, Registration::kArea);
    EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
    EXPECT_EQ(place.system.epsg, 3857);
    EXPECT_DOUBLE_EQ(place.spacing_x, kTile / 32.0);
    EXPECT_DOUBLE_EQ(place.spacing_y, kTile / 32.0);
    ASSERT_TRUE(place.has_origin);
    EXPECT_NEAR(place.origin_x, kTile + kTile / 64.0, 1e-6);
    EXPECT_NEAR(place.origin_y, 2.0 * kTile - kTile / 64.0, 1e-6);
  }
  EXPECT_FALSE(place_of("3/5/3.png", of_channel("R")).has_origin);
  for (const char* name : {"3/5/8.png", "3/5/-1.png", "3/5/2a.png", "3/2.png"}) {
    EXPECT_FALSE(place_of(name, packed).has_origin) << name;
  }
  picture.height = 31;
  EXPECT_FALSE(place_of("3/5/4.png", packed).has_origin);
}

TEST_F(PngSource, UnpacksNothingButColoursOfEightBits) {
  for (const auto& [color_type, depth, encoding] : {std::tuple{PNG_COLOR_TYPE_GRAY, 8, "terrarium"},
                                                    {PNG_COLOR_TYPE_RGB, 16, "mapbox"},
                                                    {PNG_COLOR_TYPE_RGB, 8, "rgba-float"}}) {
    Picture picture{.bit_depth = depth, .color_type = color_type};
    write_picture(path, picture);
    const Error error = error_of([&] { (void)open_raster(path, of_channel(encoding)); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), HasSubstr(fmt::format("encoding {} packs an elevation", encoding)));
  }
}

TEST_F(PngSource, TakesGreyPixelsWithoutOpacityAsVoid) {
  Picture picture{.bit_depth = 8, .color_type = PNG_COLOR_TYPE_GRAY_ALPHA};
  write_picture(folder / "a.png", picture);
  const auto source = open_png(folder / "a.png", {});
  ASSERT_EQ(source->info().sample_type, SampleType::kInt16);
  ASSERT_EQ(source->info().void_values.size(), 1U);
  std::vector<std::int16_t> samples(std::size_t{picture.width} * picture.height);
  source->read_window({0, 0, picture.width, picture.height}, std::as_writable_bytes(std::span(samples)));
  std::int64_t voids = 0;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    const std::uint32_t column = i % picture.width;
    const std::uint32_t row = i / picture.width;
    const bool is_void = picture.value(column, row, 1) == 0;
    ASSERT_EQ(samples[i], is_void ? source->info().void_values[0] : picture.value(column, row, 0));
    voids += is_void ? 1 : 0;
  }
  EXPECT_GT(voids, 0);
}

TEST_F(PngSource, TakesTransparentGrayAsVoid) {
  Picture picture;
  picture.transparent_gray = 777;
  write_picture(path, picture);
  EXPECT_EQ(open_png(path, {})->info().void_values, std::vector<double>{777.0});
  // One bit of it damaged: neither another void value nor none.
  std::string bytes = read_file(path);
  bytes[bytes.find("tRNS") + 5] ^= 1;
  write_file(path, bytes);
  EXPECT_EQ(error_of([&] { (void)open_png(path, {}); }).code(), ErrorCode::kCorrupt);
}

TEST_F(PngSource, RefusesUnknownChannels) {
  write_picture(path, {.bit_depth = 8, .color_type = PNG_COLOR_TYPE_RGB});
  const Error error = error_of([&] { (void)open_png(path, of_channel("Z")); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.what(), HasSubstr(path + ": has no channel \"Z\"; it has R, G, B (or 0...2)"));
}

TEST_F(PngSource, ReportsEveryTruncation) {
  const std::string cut = folder / "cut.png";
  for (const bool interlaced : {false, true}) {
    Picture picture;
    picture.interlaced = interlaced;
    write_picture(path, picture);
    const auto bytes = read_file(path);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      write_file(cut, bytes.substr(0, length));
      SCOPED_TRACE(fmt::format("{} of {} bytes", length, bytes.size()));
      const Error error = error_of([&] { (void)read_whole(*open_png(cut, {})); });
      EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
      EXPECT_THAT(error.what(), HasSubstr(cut));
    }
  }
}

TEST_F(PngSource, NamesTheRowThatIsMissingAndReadsTheOnesBefore) {
  Picture picture;
  picture.width = 1000;  // tens of kilobytes: libpng reads 8 KiB ahead
  picture.height = 400;
  write_picture(path, picture);
  const auto bytes = read_file(path);
  write_file(path, bytes.substr(0, bytes.size() * 9 / 10));
  const auto source = open_png(path, {});
  EXPECT_THAT(error_of([&] { (void)read_whole(*source); }).what(), HasSubstr("PNG row "));
  const Window top = {0, 0, picture.width, 5};
  EXPECT_EQ(read_window(*source, top), expected_window(picture, 0, top));
  EXPECT_THAT(error_of([&] { (void)read_whole(*source); }).what(), HasSubstr("PNG row "));
}

TEST_F(PngSource, NeverDeliversASampleThatAFlippedBitChanged) {
  for (const bool interlaced : {false, true}) {
    Picture picture;
    picture.width = picture.height = 16;
    picture.interlaced = interlaced;
    write_picture(path, picture);
    const auto bytes = read_file(path);
    for (std::size_t at = 8; at < bytes.size(); ++at) {
      auto changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ 0x10);
      write_file(path, changed);
      try {
        EXPECT_EQ(read_whole(*open_png(path, {})), expected_whole(picture)) << "byte " << at;
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr(path));
      }
    }
  }
}

/// A PNG header with a right checksum and any numbers.
void write_header_only(const std::string& path, std::uint32_t width, std::uint32_t height, int interlace) {
  std::string bytes("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16);
  const auto put = [&](std::uint32_t value) {
    for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes.push_back(static_cast<char>(value >> shift));
  };
  put(width);
  put(height);
  for (const int field : {16, 0, 0, 0, interlace}) bytes.push_back(static_cast<char>(field));
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t at = 12; at < bytes.size(); ++at) {
    crc ^= static_cast<unsigned char>(bytes[at]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  put(~crc);
  bytes += std::string("\0\0\0\0IDAT", 8);
  put(0x35AF061EU);
  write_file(path, bytes);
}

TEST_F(PngSource, RefusesAbsurdSizesBeforeAllocating) {
  for (const auto& [width, height] : {std::pair{0x7FFFFFFFU, 1U}, {0x7FFFFFFFU, 0x7FFFFFFFU}, {100000U, 100000U}}) {
    write_header_only(path, width, height, 0);
    const Error error = error_of([&] { (void)open_png(path, {}); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_THAT(error.what(), HasSubstr("has no room"));
  }
  for (const auto& [width, height] : {std::pair{0U, 5U}, {5U, 0U}, {0x80000000U, 5U}}) {
    write_header_only(path, width, height, 0);
    EXPECT_EQ(error_of([&] { (void)open_png(path, {}); }).code(), ErrorCode::kCorrupt);
  }
}

}  // namespace
}  // namespace isohf::test
