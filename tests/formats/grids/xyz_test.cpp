#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Xyz : public ReaderTest {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& text, const std::string& name = "a.xyz") const {
    return open_raster(write(name, text), {});
  }
  [[nodiscard]] std::string failure(const std::string& text, ErrorCode* code = nullptr) const {
    return failure_at(write("a.xyz", text), code, open_raster);
  }
};

TEST_F(Xyz, PointsMayComeInAnyOrder) {
  std::vector<std::string> lines;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      lines.push_back(fmt::format("{} {} {}\n", 500.5 + 2.0 * column, 4000.0 + 2.5 * row, 10 * row + column));
    }
  }
  const auto expect = [&] {
    const auto source = open(fmt::format("{}", fmt::join(lines, "")));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.sample_type, SampleType::kInt32);
    EXPECT_THAT(values_of(*source), ElementsAre(20, 21, 22, 23, 10, 11, 12, 13, 0, 1, 2, 3));
    EXPECT_THAT(grid_of(info.georeference), ElementsAre(500.5, 4005.0, 2.0, 2.5));
    EXPECT_EQ(info.georeference.registration, Registration::kPoint);
    EXPECT_THAT(values_of(info.sample_type, read_window(*source, {1, 1, 2, 2})), ElementsAre(11, 12, 1, 2));
  };
  expect();
  std::ranges::reverse(lines);
  expect();
  std::ranges::stable_sort(lines, {}, [](const std::string& line) { return line.substr(0, 5); });  // by columns
  expect();
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    std::ranges::shuffle(lines, random);
    expect();
  }
}

/// Every text is the same four points, 1.5 and 2 in the South, 3 and 4 in the North.
TEST_F(Xyz, LinesAreReadInManySpellings) {
  struct Row {
    const char* text;
    const char* note = nullptr;
    const char* name = "a.xyz";
  };
  const Row rows[] = {
      {"0 0 1.5\n1 0 2\n0 1 3\n1 1 4\n"},
      {"0 0 1.5\n1 0 2\n0 1 3\n1 1 4", nullptr, "a.txt"},
      {"\t0\t0\t1.5\n1\t0\t2\n0\t1\t3\n1\t1\t4\n"},
      {"0.0, 0, 1.5  \n1,0,2\n0 , 1 , 3\r\n1,1,4\n"},
      {"0.0D+00 0 0.15d1\n1 0 2.0D0\n0 1 3\n1 1 4\n"},
      {"\n# by hand\n// twice\n! thrice\n% x\nx,y,z\n0,0,1.5\n1,0,2\n\n0,1,3\n# late\n1,1,4", nullptr, "a.csv"},
      {"0 0 1.5 255 0 0\n1 0 2 0 0 0\n0 1 3 0 0 0\n1 1 4 0 0 0\n"},
      {"Z;Name;Y;X\r\n1,5;a;0;0\r\n2;b b;0;1\r\n3;;1;0\r\n4;d;1;1\r\n", nullptr, "a.txt"},
      {"\xEF\xBB\xBFX Y Z\n0 0 1.5\n1 0 2\n0 1 3\n1 1 4\n", nullptr, "a.txt"},
      {"\xEF\xBB\xBF"
       "0;0;1.5\n1;0;2\n0;1;3\n1;1;4\n"},
      {"x [m]\ty [m]\televation (m)\n0\t0\t1.5\n1\t0\t2\n0\t1\t3\n1\t1\t4\n"},
      {"x [m] y [m] z [m]\r\n0 0 1.5\r\n1 0 2\r\n0 1 3\r\n1 1 4\r\n", nullptr, "a.txt"},
      {"0 ,0 ,1.5\n1 ,0 ,2\n0 ,1 ,3\n1 ,1 ,4\n"},
      {"lat,lon,alt\n0,0,1.5\n0,1,2\n1,0,3\n1,1,4\n"},
      {"id,grid_z,POINT_X,POINT_Y,Elevation_m\n1,0,0,0,1.5\n2,0,1,0,2\n3,0,0,1,3\n4,0,1,1,4\n"},
      {"\"X\"\t\"Y\"\t\"mlw\"\n0\t0\t1.5\n1\t0\t2\n0\t1\t3\n1\t1\t4\n",
       "\"X\", \"Y\" and \"mlw\" are read as x, y and z"},
      {"mlw Y X\n1.5 0 0\n2 0 1\n3 1 0\n4 1 1\n", "\"X\", \"Y\" and \"mlw\" are read", "a.txt"},
      {"a b c\n0 0 1.5\n1 0 2\n0 1 3\n1 1 4\n", "\"a\", \"b\" and \"c\" are read as x, y and z"},
      {"0,0 0,0 1,5\n1,0 0,0 2\n0 1 3\n1 1 4\n", "decimal signs"},
      {"0 0 1,5\n1 0 2,0\n0 1 3\n1 1 4\n", "decimal signs"},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.text);
    const auto source = open(row.text, row.name);
    EXPECT_EQ(source->info().sample_type, SampleType::kFloat64);
    EXPECT_THAT(values_of(*source), ElementsAre(3, 4, 1.5, 2));
    const std::vector<Warning>& notes = source->info().warnings;
    ASSERT_EQ(notes.size(), row.note == nullptr ? 0U : 1U) << notes.front();
    EXPECT_THAT(notes.empty() ? Warning("") : notes.front(), HasSubstr(row.note == nullptr ? "" : row.note));
    EXPECT_EQ(source->info().georeference.unit == HorizontalUnit::kDegree,
              std::string(row.text).find("lon") != std::string::npos);
  }
  EXPECT_EQ(open("0 0 1\n1 0 2.00\n0 1 3\n1 1 +4\n")->info().sample_type, SampleType::kInt32);
}

TEST_F(Xyz, PlacesWithoutAnElevationAreNodata) {
  for (const char* text :
       {"0 0 1.5\n1 0 2\n2 0 3\n0 1 4\n2 1 6\n", "0 0 1\n1 0 2\n2 0 3\n0 1 4\n2 1 6\n",
        "0 0 1\n1 0 2\n2 0 3\n0 1 4\n1 1 nan\n2 1 6\n", "0 0 1\n1 0 2\n2 0 3\n0 1 4\n1 1 NoData\n2 1 6\n",
        "0;0;1\n1;0;2\n2;0;3\n0;1;4\n1;1;\n2;1;6\n", "0,0,1\n1,0,2\n2,0,3\n0,1,4\n1,1,NA\n1,1,NULL\n2,1,6\n"}) {
    SCOPED_TRACE(text);
    const auto source = open(text);
    EXPECT_THAT(source->info().warnings, IsEmpty());
    const std::vector<double> values = values_of(*source);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(is_void(source->info(), values[i]), i == 1);
  }
  OpenOptions options;
  options.void_values = {-9.0};
  const auto source = open_raster(write("a.xyz", "0 0 1\n1 0 -9\n2 0 3\n0 1 4\n2 1 6\n"), options);
  ASSERT_EQ(source->info().sample_type, SampleType::kInt32);
  const std::vector<double> values = values_of(*source);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(is_void(source->info(), values[i]), i == 1 || i == 4);
}

TEST_F(Xyz, TheNodataValueBesideIsOneOfWholeNumbersToo) {
  write("a.xyz.aux.xml",
        "<PAMDataset><PAMRasterBand band=\"1\"><NoDataValue>3</NoDataValue></PAMRasterBand></PAMDataset>");
  for (const char* last : {"2 1 4\n", "2 1 4.5\n", ""}) {
    const auto source = open(std::string("0 0 1\n1 0 2\n2 0 5\n0 1 3\n1 1 7\n") + last);
    EXPECT_TRUE(is_void(source->info(), 3.0)) << last;
    EXPECT_FALSE(is_void(source->info(), 2.0)) << last;
    EXPECT_EQ(is_void(source->info(), values_of(*source)[2]), *last == '\0') << "where no point is";
  }
}

TEST_F(Xyz, PointsThatComeAgainAreALossIfTheyDiffer) {
  struct Row {
    const char* again;
    int points;
    std::vector<double> values = {3, 4, 1, 2};
  };
  const Row rows[] = {{"", 0},
                      {"0 0 1\n0 0 1\n1 1 4\n", 0},
                      {"1 1 nan\n", 0},
                      {"0 0 8\n", 1, {3, 4, 8, 2}},
                      {"0 0 8\n1 0 9\n1 1 4\n0 0 8\n", 2, {3, 4, 8, 9}},
                      {"0 0 8.5\n0 0 7\n", 2, {3, 4, 7, 2}}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.again);
    const auto source = open(std::string("0 0 1\n1 0 2\n0 1 3\n1 1 4\n") + row.again);
    EXPECT_EQ(values_of(*source), row.values);
    const std::vector<Warning>& warnings = source->info().warnings;
    ASSERT_EQ(warnings.size(), row.points == 0 ? 0U : 1U);
    if (row.points == 0) continue;
    EXPECT_EQ(warnings.front().kind, Warning::Kind::kLoss);
    EXPECT_EQ(
        warnings.front(),
        fmt::format("{} points come again with other elevations; the last one of each place is read", row.points));
  }
}

TEST_F(Xyz, TextThatIsCutOffIsALossOrRefused) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) text += fmt::format("{} {} {}\n", column, row, 10.25 + row + column);
  }
  EXPECT_THAT(open(text.substr(0, text.size() - 1))->info().warnings, IsEmpty());
  const std::string cut = text.substr(0, text.size() - 14);  // "3 3 16"
  const auto source = open(cut);
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_EQ(source->info().warnings.front().kind, Warning::Kind::kLoss);
  EXPECT_THAT(source->info().warnings.front(), HasSubstr("5 x 4 places have 19 points: it may be cut off"));
  EXPECT_THAT(failure(cut.substr(0, cut.size() - 3)), HasSubstr("line 19 is \"3 3\", must be x, y and z"));
}

TEST_F(Xyz, CoordinatesMayBeRounded) {
  std::string text;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 3000; ++column) {
      text += fmt::format("{:.5f} {:.5f} {}\n", 6.0 + column / 3600.0, 45.0 + row / 3600.0, row * 50 + column);
    }
  }
  const auto source = open(text);
  ASSERT_EQ(source->info().width, 3000);
  ASSERT_EQ(source->info().height, 40);
  EXPECT_NEAR(source->info().georeference.spacing_x, 1.0 / 3600.0, 1e-8);
  EXPECT_EQ(values_of(*source)[0], 39 * 50);
}

TEST_F(Xyz, WhatIsWrongIsNamedByItsLine) {
  struct Row {
    std::string text;
    const char* says;
    ErrorCode code = ErrorCode::kCorrupt;
  };
  std::string scattered;
  for (int i = 0; i < 100; ++i) scattered += fmt::format("{} {} 1\n", i, (i * 37) % 100);
  const std::string three = "0 0 1\n1 0 2\n0 1 3\n";
  const Row rows[] = {
      {three + "1 1 4\n2.4 1 4\n", "line 5 has x 2.4, 0.40 spacings of", ErrorCode::kUnsupported},
      {"0 0 1\n0 1 2\n0 2 3\n0 3 4\n", "line 1 has the x of all points", ErrorCode::kUnsupported},
      {scattered, "its 100 points are few of 100 x 100", ErrorCode::kUnsupported},
      {three + "1 x 4\n", "line 4 is \"1 x 4\", must be x, y and z"},
      {three + "1 1 z\n", "line 4 is"},
      {three + "1 1 ***\n", "line 4 is"},
      {three + "1 1e12 4\n", "line 4 is"},
      {three + "X Y Z\n1 1 4\n", "line 4 is \"X Y Z\""},
      {three, "has 3 points"},
      {"2000\ncomment\nC 0 0 0\n", "line 1 is \"2000\", must be x, y and z"},
      {"id x elev\n1 0 0\n", "line 1 is \"id x elev\""},
      {"x y z\nlater\n", "line 2 is \"later\""},
      {"# nothing\n", "has 0 points"},
      {std::string(300000, '1'), "more than 4096 bytes without a blank or line end"},
      {std::string("\xFF\xFE"
                   "0\0 \0",
                   6),
       "this is text in UTF-16; iconv", ErrorCode::kUnsupported},
      {std::string("\xFE\xFF\0x\0 ", 6), "this is text in UTF-16; iconv", ErrorCode::kUnsupported},
  };
  for (const Row& row : rows) {
    ErrorCode code{};
    EXPECT_THAT(failure(row.text, &code), HasSubstr(row.says));
    EXPECT_EQ(code, row.code) << row.says;
  }
}

TEST_F(Xyz, OtherTextIsNotTakenForPoints) {
  for (const char* text : {"1 2 3 4\n5 6 7 8\n", "a b c\n1 2 3\n4 5 6\n", "0 0 1\n", "one\n0 0 1\n1 0 2\n"}) {
    EXPECT_EQ(native_format_of(write("a.txt", text), {}), nullptr) << text;
  }
}

}  // namespace
}  // namespace isohf::test
