#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

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
  const auto with_header = [&](const std::string& text) {
    std::string bytes = array("<i2", "(2, 3)", data);
    return bytes.replace(10, 117, text + std::string(117 - text.size(), ' '));
  };
  const std::pair<std::string, const char*> rows[] = {
      {array("<c8", "(2, 3)", data), "the array's type is '<c8'"},
      {array("|i2", "(2, 3)", data), "the array's type is '|i2'"},
      {array("", "(2, 3)", data), "the array's type is ''"},
      {array("<i2", "(6,)", data), "the array's shape is (6,), must have 2 dimensions"},
      {array("<i2", "()", data), "the array's shape is (), must have 2 dimensions"},
      {array("<i2", "(2, 3, 2)", data), "must have 2 dimensions"},
      {array("<i2", "(2, 0)", data), "must be from 1"},
      {array("<i2", "(2, -3)", data), "must be from 1"},
      {array("<i2", "(2, x)", data), "has the shape (2, x)"},
      {array("<i2", "(20, 30)", data), "ends early: 192 bytes, an array of (20, 30) int16 needs 1328"},
      {array("<i2", "(2147483648, 2147483648)", data), "ends early"},
      {array("<i2", "(2, 3)", data, 4), "NumPy format 4"},
      {array("<i2", "(2, 3)", data, 1, "Maybe"), "says no fortran_order"},
      {with_header("{'descr': [('z', '<i2')], 'fortran_order': False, 'shape': (2, 3), }"),
       "the array's type is [('z'"},
      {with_header("{'descr': '<i2', 'fortran_order': False, }"), "says no shape"},
      {with_header("{'descr': '<i2', 'fortran_order': False, 'shape': (2, 3"), "says no shape"},
      {with_header("{'descr': '<i2"), "says no"},
      {with_header(""), "says no shape"}};
  for (const auto& [bytes, says] : rows) EXPECT_THAT(failure(bytes), HasSubstr(says));
}

TEST_F(Npy, ReadsFortranOrder) {
  for (const bool big_endian : {false, true}) {
    const std::string type = big_endian ? ">i2" : "<i2";
    const auto source = open_raster(write(array(type, "(2, 3)", counting(2, big_endian), 1, "True")), {});
    EXPECT_THAT(test::values_of(*source), ElementsAre(1, 3, 5, 2, 4, 6));
    EXPECT_THAT(test::values_of(SampleType::kInt16, test::read_window(*source, {1, 1, 2, 1})), ElementsAre(4, 6));
  }
}

}  // namespace
}  // namespace isohf
