#include "formats/readers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "formats/reader_failure.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/every_window.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

OpenOptions raw(const std::string& layout) {
  OpenOptions options;
  options.raw = raw_layout_from_string(layout);
  return options;
}

std::string write(const TemporaryFolder& folder, const std::string& name, std::size_t bytes) {
  std::string data(bytes, '\0');
  // No byte that makes a float larger than any ground, in either byte order.
  for (std::size_t i = 0; i < bytes; ++i) data[i] = static_cast<char>((i * 37 + 5) & 0xbfU);
  write_file(folder / name, data);
  return folder / name;
}

TEST(RawLayout, IsReadFromItsText) {
  const RawLayout layout = raw_layout_from_string("513x7:i16be");
  EXPECT_EQ(layout.width, 513);
  EXPECT_EQ(layout.height, 7);
  EXPECT_EQ(layout.type, SampleType::kInt16);
  EXPECT_TRUE(layout.big_endian);
  EXPECT_EQ(raw_layout_from_string("1X1:u8").type, SampleType::kUint8);
  EXPECT_EQ(raw_layout_from_string("100000x100000:f64le").type, SampleType::kFloat64);
  for (const char* text :
       {"", "200", "200x200", "200x200:", "200x200:u16",

        "200x200:u17le", "0x200:u8", "-2x2:u8", "200x0:u8", "x:u8", "200x200:u16LE", "200x200:u16le ", " 200x200:u8",
        "200x200 u8", "2.5x2:u8", "200,200:u8", "99999999999999999999x1:u8",
        "9223372036854775807x9223372036854775807:f64le", "4294967296x4294967296:u8"}) {
    const Error error = error_of([&] { (void)raw_layout_from_string(text); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << text;
    EXPECT_THAT(error.what(), HasSubstr("must be WxH:TYPE")) << text;
  }
}

using RawSource = InFolder;

TEST_F(RawSource, ReadsEveryTypeInBothByteOrders) {
  constexpr std::array<std::pair<const char*, SampleType>, 8> kTypes = {{{"u8", SampleType::kUint8},
                                                                         {"i8", SampleType::kInt8},
                                                                         {"u16", SampleType::kUint16},
                                                                         {"i16", SampleType::kInt16},
                                                                         {"u32", SampleType::kUint32},
                                                                         {"i32", SampleType::kInt32},
                                                                         {"f32", SampleType::kFloat32},
                                                                         {"f64", SampleType::kFloat64}}};
  for (const auto& [name, type] : kTypes) {
    const std::size_t size = size_bytes(type);
    for (const std::string order : {"le", "be"}) {
      const std::string path = write(folder, "samples", 15 * size);
      auto wanted = read_file(path);
      if (order == "be") {
        for (std::size_t i = 0; i < wanted.size(); i += size) {
          std::reverse(wanted.begin() + static_cast<std::ptrdiff_t>(i),
                       wanted.begin() + static_cast<std::ptrdiff_t>(i + size));
        }
      }
      const auto source = open_raster(path, raw(std::string("5x3:") + name + (size == 1 ? "" : order)));
      EXPECT_EQ(source->info().sample_type, type);
      SCOPED_TRACE(name + order);
      expect_every_window(*source, std::as_bytes(std::span(wanted)));
    }
  }
}

TEST_F(RawSource, SaysWhenTheOtherByteOrderIsFarSmoother) {
  std::string hills;
  std::string noise;
  std::string terraces;
  unsigned state = 1;
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) {
      const auto height = static_cast<unsigned>(30000 + 20000 * std::sin(0.05 * row) * std::cos(0.04 * column));
      state = state * 1664525U + 1013904223U;
      for (const int shift : {0, 8}) {
        hills += static_cast<char>(height >> shift & 255U);
        noise += static_cast<char>(state >> (16 + shift) & 255U);
      }
      terraces += '\0';
      terraces += static_cast<char>(height >> 8U);
    }
  }
  const auto warnings = [&](const std::string& bytes, const char* layout) {
    write_file(folder / "a.r16", bytes);
    OpenOptions options;
    options.raw = raw_layout_from_string(layout);
    return open_raster(folder / "a.r16", options)->info().warnings;
  };
  EXPECT_TRUE(warnings(hills, "64x64:u16le").empty());
  ASSERT_EQ(warnings(hills, "64x64:u16be").size(), 1U);
  EXPECT_THAT(warnings(hills, "64x64:u16be").front(), HasSubstr("perhaps the samples are `raw` 64x64:u16le"));
  EXPECT_THAT(warnings(hills, "64x64:i16be").front(), HasSubstr("64x64:i16le"));
  for (const char* layout : {"64x64:u16le", "64x64:u16be"}) {
    EXPECT_TRUE(warnings(noise, layout).empty());
    EXPECT_TRUE(warnings(terraces, layout).empty()) << "one byte says it all in either order";
    EXPECT_TRUE(warnings(std::string(8192, '\7'), layout).empty());
  }
}

TEST_F(RawSource, WantsExactlyTheBytesOfItsLayout) {
  for (std::size_t bytes = 1; bytes < 30; ++bytes) {
    const std::string path = write(folder, "terrain.r16", bytes);
    if (bytes == 24) {
      EXPECT_EQ(open_raster(path, raw("4x3:u16le"))->info().height, 3);
      continue;
    }
    const Error error = error_of([&] { (void)open_raster(path, raw("4x3:u16le")); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_EQ(error.what(),
              path + ": the file has " + std::to_string(bytes) + " bytes, 4 x 3 samples of 2 bytes take 24");
  }
}

TEST_F(RawSource, AsksForALayoutByName) {
  const auto what = [&](const std::string& name, std::size_t bytes) {
    const Error error = error_of([&] { (void)open_raster(write(folder, name, bytes), {}); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return std::string(error.what());
  };
  EXPECT_THAT(what("a.r8", 9), HasSubstr("`raw` 3x3:u8)"));
  EXPECT_THAT(what("a.R16", 18), HasSubstr("`raw` 3x3:u16le)"));
  EXPECT_THAT(what("a.f32", 36), HasSubstr("`raw` 3x3:f32le)"));
  EXPECT_THAT(what("a.raw", 18), HasSubstr("`raw` 3x3:u16le)"));
  EXPECT_THAT(what("a.raw", 9), HasSubstr("`raw` 3x3:u8)"));
  EXPECT_THAT(what("a.r16", 20), HasSubstr("as in `raw` 200x300:u16le"));
  EXPECT_THAT(what("a.r16", 20), Not(HasSubstr("\n")));
}

TEST_F(RawSource, GoesBeforeNameAndContent) {
  write_file(folder / "a.png", "\x89PNG\r\n\x1A\n");
  EXPECT_EQ(open_raster(folder / "a.png", raw("2x2:u16be"))->info().format, "raw samples");
  OpenOptions channel = raw("2x2:u16be");
  channel.channel = "1";
  EXPECT_EQ(error_of([&] { (void)open_raster(folder / "a.png", channel); }).code(), ErrorCode::kInvalidArgument);
}

TEST_F(RawSource, TakesFloatsBeyondAnyHeightAsVoid) {
  const std::array<float, 4> samples = {1.0F, -3.4e38F, NAN, 8848.0F};
  write_file(folder / "a.f32", std::as_bytes(std::span(samples)));
  const auto source = open_raster(folder / "a.f32", raw("4x1:f32le"));
  const auto read = read_whole(*source);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(is_void(source->info(), value_at(SampleType::kFloat32, read, i)), i == 1 || i == 2);
  }
}

}  // namespace
}  // namespace isohf::test
