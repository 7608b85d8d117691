#include "formats/readers.h"

#include <fmt/format.h>
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

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
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

/// The same samples with and without a header.
TEST_F(RawSource, EveryTypeIsReadInBothByteOrdersAsWithAHeader) {
  using enum SampleType;
  for (const SampleType type : {kUint8, kInt8, kUint16, kInt16, kUint32, kInt32, kFloat32, kFloat64}) {
    const std::size_t size = size_bytes(type);
    for (const bool is_big : {false, true}) {
      const std::string path = write(folder, "samples", 20 * size);
      const std::string stored = read_file(path);
      std::string wanted = stored;
      for (std::size_t at = 0; is_big && at < wanted.size(); at += size) {
        std::reverse(wanted.data() + at, wanted.data() + at + size);
      }
      const auto expect = [&](const std::string& name, const OpenOptions& options) {
        SCOPED_TRACE(name + to_string(type));
        const auto source = open_raster(folder / name, options);
        EXPECT_EQ(source->info().sample_type, type);
        EXPECT_TRUE(source->info().warnings.empty());
        expect_every_window(*source, std::as_bytes(std::span(wanted)));
      };
      const bool is_unsigned = to_string(type).starts_with("u");
      const char kind = is_floating(type) ? 'f' : is_unsigned ? 'u' : 'i';
      const char* const order = size == 1 ? "" : is_big ? "be" : "le";
      expect("samples", raw(fmt::format("5x4:{}{}{}", kind, 8 * size, order)));
      for (const char* layout : {"bil", "bip", "bsq"}) {  // with padded rows behind seven other bytes
        std::string padded = "0123456";
        for (std::size_t row = 0; row < 4; ++row) padded += stored.substr(row * 5 * size, 5 * size) + "...";
        write_file(folder / (std::string("a.") + layout), padded);
        write_file(folder / "a.hdr",
                   fmt::format("byteorder {}\r\nlayout {}\r\nnrows 4\r\nncols 5\r\nnbands 1\r\nnbits {}\r\n"
                               "pixeltype {}\r\nskipbytes 7\r\nbandrowbytes {}\r\ntotalrowbytes {}\r\n",
                               is_big ? "M" : "I", layout, 8 * size,
                               is_floating(type) ? "FLOAT"
                               : is_unsigned     ? "UNSIGNEDINT"
                                                 : "signedint",
                               5 * size + 3, 5 * size + 3));
        expect(std::string("a.") + layout, {});
      }
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
    return open_raster(folder / "a.r16", raw(layout))->info().warnings;
  };
  EXPECT_THAT(warnings(hills, "64x64:u16be"), ElementsAre(HasSubstr("perhaps the samples are `raw` 64x64:u16le")));
  EXPECT_THAT(warnings(hills, "64x64:i16be"), ElementsAre(HasSubstr("64x64:i16le")));
  EXPECT_THAT(warnings(hills, "64x64:u16le"), IsEmpty());
  for (const std::string& either : {noise, terraces, std::string(8192, '\7')}) {
    EXPECT_THAT(warnings(either, "64x64:u16le"), IsEmpty());
    EXPECT_THAT(warnings(either, "64x64:u16be"), IsEmpty());
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
  const std::tuple<const char*, std::size_t, const char*> rows[] = {{"a.r8", 9, "`raw` 3x3:u8)"},
                                                                    {"a.R16", 18, "`raw` 3x3:u16le)"},
                                                                    {"a.f32", 36, "`raw` 3x3:f32le)"},
                                                                    {"a.f64", 72, "`raw` 3x3:f64le)"},
                                                                    {"a.raw", 18, "`raw` 3x3:u16le)"},
                                                                    {"a.raw", 9, "`raw` 3x3:u8)"},
                                                                    {"a.r16", 20, "as in `raw` 200x300:u16le"}};
  for (const auto& [name, bytes, says] : rows) {
    const Error error = error_of([&] { (void)open_raster(write(folder, name, bytes), {}); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), ::testing::AllOf(HasSubstr(says), Not(HasSubstr("\n"))));
  }
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
