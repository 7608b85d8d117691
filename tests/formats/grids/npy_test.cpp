#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/io/zip_archive.h"
#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string array(const std::string& descr, const std::string& shape, const std::string& data, int version = 1,
                  const std::string& order = "False") {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", descr, order, shape);
  text.resize(117, ' ');
  text += '\n';
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(version);
  bytes += '\0';
  bytes += static_cast<char>(text.size());
  bytes.append(version == 1 ? 1 : 3, '\0');
  return bytes + text + data;
}

/// 3 x 2 samples 1 to 6 of `size` bytes.
std::string counting(int size, bool big_endian) {
  std::string bytes;
  for (int i = 1; i <= 6; ++i) {
    for (int b = 0; b < size; ++b) bytes += b == (big_endian ? size - 1 : 0) ? static_cast<char>(i) : '\0';
  }
  return bytes;
}

class Npy : public test::ReaderTest {
 protected:
  std::string write(const std::string& bytes, const std::string& name = "a.npy") const {
    return ReaderTest::write(name, bytes);
  }

  std::string failure(const std::string& bytes, ErrorCode* code = nullptr, const std::string& name = "a.npy") const {
    return failure_at(write(bytes, name), code, open_raster);
  }
};

TEST_F(Npy, ReadsEveryTypeOrderAndVersion) {
  const std::pair<const char*, SampleType> types[] = {
      {"u1", SampleType::kUint8},   {"i1", SampleType::kInt8},    {"u2", SampleType::kUint16},
      {"i2", SampleType::kInt16},   {"u4", SampleType::kUint32},  {"i4", SampleType::kInt32},
      {"f2", SampleType::kFloat16}, {"f4", SampleType::kFloat32}, {"f8", SampleType::kFloat64}};
  for (const auto& [name, type] : types) {
    const int size = static_cast<int>(size_bytes(type));
    for (const char order : {'<', '>', '=', '|'}) {
      if (order == '|' && size > 1) continue;
      for (const int version : {1, 2, 3}) {
        SCOPED_TRACE(fmt::format("{}{} {}", order, name, version));
        const std::string data = counting(size, order == '>');
        const auto source = open_raster(write(array(order + std::string(name), "(2, 3)", data, version)), {});
        ASSERT_EQ(source->info().sample_type, type);
        ASSERT_EQ(source->info().width, 3);
        const auto raw = test::read_whole(*source);
        const std::string little = counting(size, false);
        EXPECT_TRUE(std::equal(raw.begin(), raw.end(), std::as_bytes(std::span(little)).begin()));
        std::vector<std::byte> last(static_cast<std::size_t>(size) * 2);
        source->read_window({2, 0, 1, 2}, last);
        EXPECT_EQ(test::value_at(type, last, 1), test::value_at(type, raw, 5));
      }
    }
  }
}

TEST_F(Npy, ReadsWholeNumbersOf64BitsAsFloatsThatHoldThem) {
  for (const char* type : {"<i8", ">i8", "<u8", ">u8"}) {
    for (const char* order : {"False", "True"}) {
      SCOPED_TRACE(fmt::format("{} {}", type, order));
      const auto source = open_raster(write(array(type, "(2, 3)", counting(8, type[0] == '>'), 1, order)), {});
      ASSERT_EQ(source->info().sample_type, SampleType::kFloat64);
      EXPECT_THAT(test::values_of(SampleType::kFloat64, test::read_window(*source, {2, 0, 1, 2})),
                  ElementsAre(order[0] == 'F' ? 3.0 : 5.0, 6.0));
    }
  }
  const auto number = [&](const char* type, const std::string& bytes) { return array(type, "(1, 1)", bytes); };
  const auto value = [&](const char* type, const std::string& bytes) {
    return test::values_of(*open_raster(write(number(type, bytes)), {})).at(0);
  };
  const std::string lowest("\0\0\0\0\0\0\0\x80", 8);
  EXPECT_EQ(value("<i8", lowest), -0x1p63);
  EXPECT_EQ(value("<u8", lowest), 0x1p63);
  const std::string ones(8, '\xff');
  EXPECT_EQ(value("<i8", ones), -1);
  EXPECT_THAT(
      failure(number("<u8", ones)),
      HasSubstr("sample (0, 0) is 18446744073709551615, which float64 does not hold; store the samples as float64"));
  EXPECT_THAT(failure(number("<i8", std::string("\1\0\0\0\0\0\x20\0", 8))),
              HasSubstr("is 9007199254740993, which float64 does not hold"));
  EXPECT_THAT(failure(number("<i8", std::string(7, '\xff') + '\x7f')), HasSubstr("is 9223372036854775807, which"));
}

TEST_F(Npy, DimensionsOfOneAreNone) {
  const std::string data = counting(2, false);
  for (const char* shape : {"(1, 2, 3)", "(2, 1, 3)", "(2, 3, 1)", "(1, 2, 3, 1)"}) {
    const auto source = open_raster(write(array("<i2", shape, data)), {});
    EXPECT_EQ(source->info().width, 3) << shape;
    EXPECT_EQ(source->info().height, 2) << shape;
  }
}

TEST_F(Npy, SaysWhatItDoesNotRead) {
  const std::string data(64, '\0');
  EXPECT_THAT(failure(array("<c8", "(2, 3)", data)), HasSubstr("the array's type is '<c8'"));
  EXPECT_THAT(failure(array("|i2", "(2, 3)", data)), HasSubstr("the array's type is '|i2'"));
  EXPECT_THAT(failure(array("<i2", "(6,)", data)), HasSubstr("the array's shape is (6), must have 2 dimensions"));
  EXPECT_THAT(failure(array("<i2", "(2, 3, 2)", data)), HasSubstr("must have 2 dimensions"));
  EXPECT_THAT(failure(array("<i2", "(2, 0)", data)), HasSubstr("must be from 1"));
  EXPECT_THAT(failure(array("<i2", "(2, 3)", data, 4)), HasSubstr("NumPy format 4"));
  EXPECT_THAT(failure("PK\x03\x04 anything", nullptr, "a.npz"), HasSubstr("no zip archive"));
}

TEST_F(Npy, ReadsFortranOrder) {
  for (const bool big_endian : {false, true}) {
    const std::string type = big_endian ? ">i2" : "<i2";
    const auto source = open_raster(write(array(type, "(2, 3)", counting(2, big_endian), 1, "True")), {});
    EXPECT_THAT(test::values_of(*source), ElementsAre(1, 3, 5, 2, 4, 6));
    EXPECT_THAT(test::values_of(SampleType::kInt16, test::read_window(*source, {1, 1, 2, 1})), ElementsAre(4, 6));
  }
}

TEST_F(Npy, PicksAnArrayOfAnArchive) {
  const auto entry = [](const std::string& name, const std::string& contents) {
    return test::ZipEntry{name, std::vector<std::byte>(std::as_bytes(std::span(contents)).begin(),
                                                       std::as_bytes(std::span(contents)).end())};
  };
  for (const int kind : {0, 1, 2, 3}) {
    const auto zip = test::zip_archive({entry("dx.npy", array("<f8", "()", std::string(8, '\0'))),
                                        entry("low.npy", array("<i2", "(2, 3)", counting(2, false))),
                                        entry("high.npy", array(">i4", "(3, 2)", counting(4, true)))},
                                       kind % 2 == 1, kind >= 2);
    const std::string path = write({reinterpret_cast<const char*>(zip.data()), zip.size()}, "a.npz");
    const auto first = open_raster(path, {});
    EXPECT_EQ(first->info().width, 3);
    EXPECT_EQ(first->info().channel, "low");
    EXPECT_THAT(first->info().warnings, ElementsAre(HasSubstr("array low is read, of dx, low, high")));
    OpenOptions options = test::of_channel("high");
    const auto high = open_raster(path, options);
    EXPECT_EQ(high->info().width, 2);
    EXPECT_TRUE(high->info().warnings.empty());
    EXPECT_THAT(test::values_of(*high), ElementsAre(1, 2, 3, 4, 5, 6));
    const auto says = [&](const char* channel) {
      options.channel = channel;
      ErrorCode code = ErrorCode::kCancelled;
      return test::failure_of(path, &code, [&] { (void)open_raster(path, options); });
    };
    EXPECT_THAT(says("nothing"), HasSubstr("there is no array \"nothing\"; there are dx, low, high"));
    EXPECT_THAT(says("dx"), HasSubstr("must have 2 dimensions (array dx)"));
    for (std::size_t length = 0; length < zip.size(); ++length) {
      ErrorCode code = ErrorCode::kCancelled;
      const std::string bytes(reinterpret_cast<const char*>(zip.data()), length);
      EXPECT_NE(failure(bytes, &code, "b.npz"), "") << length;
      EXPECT_EQ(code, ErrorCode::kCorrupt) << length;
    }
  }
}

}  // namespace
}  // namespace isohf
