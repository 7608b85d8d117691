#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/samples.h"
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
  std::function<unsigned(std::uint32_t column, std::uint32_t row, std::uint32_t channel)> at = {};  ///< instead

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
    const unsigned number = at ? at(column, row, channel) : column * 977 + row * 3541 + channel * 12345;
    return number & ((1U << static_cast<unsigned>(bit_depth)) - 1U);
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
    gray.gray = gray.red = gray.green = gray.blue = static_cast<png_uint_16>(picture.transparent_gray);
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
            const auto source = kPngFormat.open(path, of_channel(name));
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
  const auto source = kPngFormat.open(path, {});
  for (const std::int64_t row : {0, 2990, 5, 2990, 1500, 1400, 700, 699, 0}) {
    const Window window = {3, row, 20, 9};
    ASSERT_EQ(read_window(*source, window), expected_window(picture, 0, window)) << "row " << row;
  }
  EXPECT_EQ(read_whole(*source), expected_whole(picture));
}

TEST_F(PngSource, RefusesColoursThatNobodyExplained) {
  for (const auto& [color_type, depth] : {std::pair{PNG_COLOR_TYPE_RGB, 8}, {PNG_COLOR_TYPE_RGB, 16}}) {
    write_picture(path, {.bit_depth = depth, .color_type = color_type});
    const Error error = error_of([&] { (void)open_raster(path, {}); });
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_EQ(std::string(error.what()),
              path +
                  ": is a colour picture with channels R, G, B; `channel` R reads one of them, `encoding` terrarium, "
                  "mapbox, gsi or rgba-float unpacks elevations from all");
    EXPECT_TRUE(open_raster(path, of_channel("R"))->info().warnings.empty());
  }
  // One pixel of colour below the rows that are looked at when the picture is opened.
  write_picture(path, {.height = 100, .color_type = PNG_COLOR_TYPE_RGB, .at = [](auto column, auto row, auto channel) {
                         return column + (row == 80 && column == 7 ? channel : 0);
                       }});
  const auto source = open_raster(path, {});
  (void)read_window(*source, {0, 0, 37, 80});
  EXPECT_THAT(error_of([&] { (void)read_whole(*source); }).what(), HasSubstr(path + ": is a colour picture"));
}

/// Greys in one to four channels of which some are transparent: by opacity 0, or the colour 0 of tRNS.
TEST_F(PngSource, ReadsGreysAndTakesTransparentOnesAsNodata) {
  const auto ground = [](std::uint32_t column, std::uint32_t row) { return row < 5 ? 0 : 300 + column; };
  for (const int depth : {8, 16}) {
    for (const int color_type :
         {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA}) {
      for (const bool interlaced : {false, true}) {
        const bool has_opacity = color_type == PNG_COLOR_TYPE_GRAY_ALPHA || color_type == PNG_COLOR_TYPE_RGB_ALPHA;
        Picture picture{.bit_depth = depth, .color_type = color_type, .interlaced = interlaced};
        SCOPED_TRACE(fmt::format("colour type {} depth {}", color_type, depth));
        if (!has_opacity) picture.transparent_gray = 0;
        picture.at = [&](auto column, auto row, auto channel) {
          // Transparent pixels may have any colour.
          if (has_opacity && channel + 1 == picture.channels()) return row < 5 ? 0U : 0xFFFFU;
          return ground(column, row) + (has_opacity && row < 5 ? channel : 0);
        };
        write_picture(path, picture);
        const auto source = open_raster(path, {});
        const SourceInfo& info = source->info();
        const std::vector<double> values = values_of(*source);
        for (std::uint32_t i = 0; i < values.size(); ++i) {
          const std::uint32_t row = i / picture.width;
          ASSERT_EQ(is_void(info, values[i]), row < 5) << i;
          if (row < 5) continue;
          ASSERT_EQ(values[i], ground(i % picture.width, row) & (depth == 8 ? 0xFFU : 0xFFFFU)) << i;
        }
        const bool has_colours = picture.channels() > 2;
        EXPECT_EQ(info.warnings.size(), (has_colours ? 1U : 0U) + (has_opacity ? 1U : 0U));
        const SampleType wide = depth == 8 ? SampleType::kInt16 : SampleType::kInt32;
        const SampleType plain = depth == 8 ? SampleType::kUint8 : SampleType::kUint16;
        EXPECT_EQ(info.sample_type, has_opacity ? wide : plain);
      }
    }
  }
  write_picture(path, {.transparent_gray = 777});
  EXPECT_EQ(kPngFormat.open(path, {})->info().void_values, std::vector<double>{777.0});
  // One bit of it damaged: neither another void value nor none.
  std::string bytes = read_file(path);
  bytes[bytes.find("tRNS") + 5] ^= 1;
  write_file(path, bytes);
  EXPECT_EQ(error_of([&] { (void)kPngFormat.open(path, {}); }).code(), ErrorCode::kCorrupt);
}

OpenOptions of_encoding(const std::string& encoding) {
  OpenOptions options;
  options.encoding = encoding;
  return options;
}

/// Pixels of four values, red first, and the elevation that they are; NaN: none.
TEST_F(PngSource, UnpacksElevations) {
  constexpr double kVoid = NAN;
  struct Case {
    const char* encoding;
    std::array<unsigned, 4> pixel;
    double elevation;
  };
  const std::vector<Case> cases = {{"terrarium", {131, 220, 128, 255}, 988.5},
                                   {"terrarium", {0, 0, 0, 255}, kVoid},
                                   {"terrarium", {131, 220, 128, 0}, kVoid},
                                   {"mapbox", {1, 134, 160, 255}, 0.0},
                                   {"mapbox", {0, 0, 1, 255}, -9999.9},
                                   {"mapbox", {0, 0, 0, 255}, kVoid},
                                   {"gsi", {5, 192, 144, 255}, 3769.76},
                                   {"gsi", {0, 0, 0, 255}, 0.0},
                                   {"gsi", {255, 255, 156, 255}, -1.0},
                                   {"gsi", {128, 0, 0, 255}, kVoid},
                                   {"rgba-float", {0x44, 0x77, 0x20, 0x00}, 988.5},
                                   {"rgba-float", {0x7F, 0xC0, 0x00, 0x00}, kVoid}};
  for (const Case& each : cases) {
    for (const int color_type : {PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA}) {
      const bool needs_opacity = each.pixel[3] != 255;
      if (needs_opacity && color_type == PNG_COLOR_TYPE_RGB) continue;
      SCOPED_TRACE(fmt::format("{} {}", each.encoding, fmt::join(each.pixel, " ")));
      write_picture(
          path,
          {.width = 3, .height = 2, .bit_depth = 8, .color_type = color_type, .at = [&](auto, auto, auto channel) {
             return each.pixel[channel];
           }});
      const auto source = open_raster(path, of_encoding(each.encoding));
      const SourceInfo& info = source->info();
      const double value = values_of(*source)[5];
      EXPECT_EQ(is_void(info, value), std::isnan(each.elevation));
      if (!std::isnan(each.elevation)) {
        EXPECT_NEAR(value * info.z_scale + info.z_offset, each.elevation, 1e-9);
      }
      EXPECT_EQ(info.channel, each.encoding);
      EXPECT_EQ(info.vertical_unit, "metre");
      EXPECT_TRUE(info.warnings.empty());
    }
  }
}

/// Level tiles are stored as grey, or with a palette, by programs that make pictures small.
TEST_F(PngSource, UnpacksElevationsThatAPictureHasAsGreysOrAPalette) {
  for (const auto& [color_type, depth] : {std::pair{PNG_COLOR_TYPE_PALETTE, 2}, {PNG_COLOR_TYPE_GRAY, 8}}) {
    Picture picture{.bit_depth = depth, .color_type = color_type};
    write_picture(path, picture);
    const std::vector<double> values = values_of(*open_raster(path, of_encoding("mapbox")));
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(values[i], picture.value(i % picture.width, i / picture.width, 0) * 0x010101);
    }
  }
  write_picture(path, {.bit_depth = 2, .color_type = PNG_COLOR_TYPE_PALETTE});
  EXPECT_THAT(error_of([&] { (void)open_raster(path, {}); }).what(),
              AllOf(HasSubstr("palette"), HasSubstr("unless these are packed into them")));
  for (const auto& [color_type, depth, encoding] : {std::tuple{PNG_COLOR_TYPE_RGB, 16, "mapbox"},
                                                    {PNG_COLOR_TYPE_RGB, 8, "rgba-float"},
                                                    {PNG_COLOR_TYPE_RGB, 8, "utm"}}) {
    write_picture(path, {.bit_depth = depth, .color_type = color_type});
    const Error error = error_of([&] { (void)open_raster(path, of_encoding(encoding)); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), HasSubstr(path + ": "));
    EXPECT_THAT(error.what(), HasSubstr("encoding"));
  }
}

/// rio-rgbify packs with any base and interval.
TEST_F(PngSource, TakesTheBaseAndIntervalOfMapboxTilesFromTheUser) {
  write_picture(path, {.bit_depth = 8, .color_type = PNG_COLOR_TYPE_RGB, .at = [](auto, auto, auto) { return 2; }});
  OpenOptions options = of_encoding("mapbox");
  options.z_scale = 0.001;
  options.z_offset = -100.0;
  const SourceInfo both = open_raster(path, options)->info();
  EXPECT_EQ(both.z_scale, 0.001);
  EXPECT_EQ(both.z_offset, -100.0);
  options.z_offset.reset();
  options.z_scale = 2.0;
  const SourceInfo one = open_raster(path, options)->info();
  EXPECT_EQ(one.z_scale, 0.2);
  EXPECT_EQ(one.z_offset, -20000.0);
}

TEST_F(PngSource, PlacesTilesOfWebMapsByTheirNumbers) {
  std::filesystem::create_directories(folder / "3/5");
  Picture picture;
  picture.width = picture.height = 32;
  picture.bit_depth = 8;
  picture.color_type = PNG_COLOR_TYPE_RGB;
  const OpenOptions packed = of_encoding("terrarium");
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

TEST_F(PngSource, RefusesUnknownChannels) {
  write_picture(path, {.bit_depth = 8, .color_type = PNG_COLOR_TYPE_RGB});
  const Error error = error_of([&] { (void)kPngFormat.open(path, of_channel("Z")); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.what(), HasSubstr(path + ": has no channel \"Z\"; it has R, G, B (or 0...2)"));
}

TEST_F(PngSource, NamesTheRowThatIsMissingAndReadsTheOnesBefore) {
  Picture picture;
  picture.width = 1000;  // tens of kilobytes: libpng reads 8 KiB ahead
  picture.height = 400;
  write_picture(path, picture);
  const auto bytes = read_file(path);
  write_file(path, bytes.substr(0, bytes.size() * 9 / 10));
  const auto source = kPngFormat.open(path, {});
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
        EXPECT_EQ(read_whole(*kPngFormat.open(path, {})), expected_whole(picture)) << "byte " << at;
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
    const Error error = error_of([&] { (void)kPngFormat.open(path, {}); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_THAT(error.what(), HasSubstr("has no room"));
  }
  for (const auto& [width, height] : {std::pair{0U, 5U}, {5U, 0U}, {0x80000000U, 5U}}) {
    write_header_only(path, width, height, 0);
    EXPECT_EQ(error_of([&] { (void)kPngFormat.open(path, {}); }).code(), ErrorCode::kCorrupt);
  }
}

}  // namespace
}  // namespace isohf::test
