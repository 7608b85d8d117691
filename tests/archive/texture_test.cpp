#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/rasters/memory_photo.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

Picture noisy(int width, int height, int channels) {
  Picture picture(width, height, channels);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      for (int c = 0; c < channels; ++c) {
        picture.row(row)[column * channels + c] =
            static_cast<std::uint8_t>(column * 3 + row * 2 + 40 * c + test::noise(column, row, c) / 64);
      }
    }
  }
  return picture;
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

template <typename Action>
ErrorCode code_of(Action action) {
  return test::error_of(action).code();
}

TEST(PictureCodec, PngBringsEverySampleBack) {
  for (const int channels : {1, 3, 4}) {
    for (const int size : {1, 8, 33}) {
      const Picture picture = noisy(size, size + 1, channels);
      const std::vector<std::byte> bytes = encode_png(picture);
      EXPECT_EQ(decode_png(bytes, 100), picture);
      EXPECT_EQ(encode_png(picture), bytes);
    }
  }
}

TEST(PictureCodec, JpegComesCloseWithoutExif) {
  for (const int channels : {1, 3}) {
    const Picture picture = noisy(64, 48, channels);
    const std::vector<std::byte> bytes = encode_jpeg(picture, 95);
    EXPECT_EQ(encode_jpeg(picture, 95), bytes);
    EXPECT_THAT(text_of(bytes), Not(HasSubstr("Exif")));
    EXPECT_LT(encode_jpeg(picture, 30).size(), bytes.size());
    const Picture back = decode_jpeg(bytes, 64);
    ASSERT_EQ(back.samples.size(), picture.samples.size());
    double difference = 0.0;  // samples wrap around at 255: single ones may lie far apart
    for (std::size_t i = 0; i < back.samples.size(); ++i) difference += std::abs(back.samples[i] - picture.samples[i]);
    EXPECT_LT(difference / static_cast<double>(back.samples.size()), 4.0);
  }
}

TEST(PictureCodec, RefusesEveryTruncation) {
  const Picture picture = noisy(16, 16, 3);
  const std::vector<std::byte> png = encode_png(picture);
  for (std::size_t size = 0; size < png.size(); ++size) {
    EXPECT_EQ(code_of([&] { (void)decode_png(std::span(png).first(size), 16); }), ErrorCode::kCorrupt) << size;
  }
  const std::vector<std::byte> jpeg = encode_jpeg(picture, 90);
  for (std::size_t size = 0; size + 2 < jpeg.size(); ++size) {
    EXPECT_EQ(code_of([&] { (void)decode_jpeg(std::span(jpeg).first(size), 16); }), ErrorCode::kCorrupt) << size;
  }
}

TEST(PictureCodec, SurvivesEveryDamagedByte) {
  const Picture picture = noisy(16, 16, 3);
  for (const bool is_png : {true, false}) {
    const std::vector<std::byte> good = is_png ? encode_png(picture) : encode_jpeg(picture, 90);
    for (std::size_t i = 0; i < good.size(); ++i) {
      std::vector<std::byte> bad = good;
      bad[i] ^= std::byte{0xFF};
      try {
        const Picture found = is_png ? decode_png(bad, 16) : decode_jpeg(bad, 16);
        EXPECT_LE(found.width, 16);
      } catch (const Error& error) {
        EXPECT_NE(error.code(), ErrorCode::kIo);
      }
    }
  }
}

TEST(PictureCodec, RefusesPicturesThatAreTooLarge) {
  const Picture picture = noisy(17, 16, 3);
  EXPECT_EQ(code_of([&] { (void)decode_png(encode_png(picture), 16); }), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of([&] { (void)decode_jpeg(encode_jpeg(picture, 90), 16); }), ErrorCode::kCorrupt);
}

TextureInfo sample_info() {
  TextureInfo info;
  info.size = 256;
  info.levels = 6;
  info.quality = 85;
  info.photo_name = "orthophoto \"2024\".tif";
  info.photo_format = "tiff";
  info.photo_width = 123456;
  info.photo_height = 7890;
  info.placed_by = "georeference";
  info.placement = {-1.5, 0.25, 3e6, 1e-3};
  info.members = 12345;
  info.bytes = 1ULL << 40U;
  return info;
}

TextureInfo parsed(const std::string& json) {
  Metadata metadata(TileGrid::make(TileShape::make(5, 5, 1), 1, 1, 1.0, 1.0));
  metadata.extensions = {{kTileTexturesName, json}};
  return *texture_info(metadata);
}

TEST(TextureInfo, ComesBackFromItsJson) {
  for (const TextureFormat format : {TextureFormat::kJpeg, TextureFormat::kPng}) {
    TextureInfo info = sample_info();
    info.format = format;
    info.channels = format == TextureFormat::kPng ? 4 : 3;
    const TextureInfo back = parsed(format_texture_info(info));
    EXPECT_EQ(format_texture_info(back), format_texture_info(info));
    EXPECT_EQ(back.bytes, info.bytes);
    EXPECT_EQ(back.photo_name, info.photo_name);
    EXPECT_EQ(back.placement.x1, 3e6);
  }
}

TEST(TextureInfo, RefusesEveryMissingOrWrongMember) {
  const std::string good = format_texture_info(sample_info());
  const std::pair<const char*, const char*> damages[] = {
      {"\"format\"", "\"formal\""},         {"\"jpeg\"", "3"},
      {"\"channels\":3", "\"channels\":2"}, {"\"channels\":3", "\"channels\":4"},
      {"\"channels\":3", "\"x\":3"},        {"\"size\":256", "\"size\":255"},
      {"\"size\":256", "\"size\":8192"},    {"\"size\":256", "\"size\":-64"},
      {"\"size\":256", "\"size\":64.5"},    {"\"levels\":6", "\"levels\":0"},
      {"\"levels\":6", "\"levels\":8"},     {"\"levels\":6", "\"levels\":1e30"},
      {"\"quality\":85", "\"quality\":0"},  {"\"photo\"", "\"photos\""},
      {"\"width\":123456", "\"width\":0"},  {"\"placement\":{", "\"placement\":[],\"q\":{"},
      {"\"x0\":-1.5", "\"x0\":null"},       {"\"members\":12345", "\"members\":-1"},
      {"\"bytes\":", "\"kilobytes\":"}};
  for (const auto& [from, to] : damages) {
    std::string bad = good;
    ASSERT_NE(bad.find(from), std::string::npos) << from;
    bad.replace(bad.find(from), std::string(from).size(), to);
    EXPECT_EQ(code_of([&] { (void)parsed(bad); }), ErrorCode::kCorrupt) << bad;
  }
  std::string other = good;
  other.replace(other.find("jpeg"), 4, "webp");
  EXPECT_EQ(code_of([&] { (void)parsed(other); }), ErrorCode::kUnsupported);
  for (const char* text : {"", "[]", "3", "{"}) {
    EXPECT_EQ(code_of([&] { (void)parsed(text); }), ErrorCode::kCorrupt);
  }
}

TEST(TextureInfo, NamesLevelsByTheirSize) {
  const TextureInfo info = sample_info();
  EXPECT_EQ(texture_name_pattern(info.format), "textures/ROW/COLUMN/SIZE.jpg");
  EXPECT_EQ(texture_name(info, {7, 12}, 0), "textures/12/7/256.jpg");
  EXPECT_EQ(texture_name(info, {7, 12}, 5), "textures/12/7/8.jpg");
  for (int level = 0; level < info.levels; ++level) {
    const auto place = place_from_texture_name(info, texture_name(info, {7, 12}, level));
    ASSERT_TRUE(place);
    EXPECT_EQ(place->tile, (TileIndex{7, 12}));
    EXPECT_EQ(place->level, level);
  }
  for (const char* name :
       {"textures/12/7/512.jpg", "textures/12/7/4.jpg", "textures/12/7/8.png", "textures/12/07/8.jpg",
        "textures/12/8.jpg", "textures/12/7/1/8.jpg", "textures/", "textures/8.jpg", "tiles/12/7/8.jpg",
        "textures/-1/7/8.jpg", "textures/12/7/08.jpg", "textures/12/7/8.jpg/"}) {
    EXPECT_FALSE(place_from_texture_name(info, name)) << name;
  }
}

}  // namespace
}  // namespace isohf
