#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "formats/reader_failure.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Xyz : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& text, const std::string& name = "a.xyz") const {
    write_file(folder_ / name, text);
    return open_raster(folder_ / name, {});
  }
  [[nodiscard]] std::string failure(const std::string& text, ErrorCode* code = nullptr) const {
    write_file(folder_ / "a.xyz", text);
    return failure_of(folder_ / "a.xyz", code, [&] { read_corner(*open_raster(folder_ / "a.xyz", {})); });
  }

  TemporaryFolder folder_;
};

TEST_F(Xyz, PointsMayComeInAnyOrder) {
  std::vector<std::string> lines;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      lines.push_back(fmt::format("{} {} {}\n", 500.5 + 2.0 * column, 4000.0 + 2.5 * row, 10 * row + column));
    }
  }
  const auto joined = [&] { return fmt::format("{}", fmt::join(lines, "")); };
  const auto expect = [&] {
    const auto source = open(joined());
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.sample_type, SampleType::kInt32);
    EXPECT_THAT(values_of(*source), ElementsAre(20, 21, 22, 23, 10, 11, 12, 13, 0, 1, 2, 3));
    EXPECT_THAT(grid_of(info.georeference), ElementsAre(500.5, 4005.0, 2.0, 2.5));
    EXPECT_EQ(info.georeference.registration, Registration::kPoint);
    EXPECT_THAT(values_of(info.sample_type, read_window(*source, {1, 1, 2, 2})), ElementsAre(11, 12, 1, 2));
  };
  expect();
  std::reverse(lines.begin(), lines.end());
  expect();
  std::stable_sort(lines.begin(), lines.end(),  // column by column
                   [](const std::string& a, const std::string& b) { return a.substr(0, 5) < b.substr(0, 5); });
  expect();
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    std::shuffle(lines.begin(), lines.end(), random);
    expect();
  }
}

TEST_F(Xyz, FieldsAreKeptApartByBlanksCommasAndSemicolons) {
  for (const char* text :
       {"0 0 1.5\n1 0 2\n0 1 3\n1 1 4\n", "# by hand\nx,y,z\n0,0,1.5\n1,0,2\n\n0,1,3\n1,1,4",
        "Z;Name;Y;X\r\n1,5;a;0;0\r\n2;b;0;1\r\n3;c;1;0\r\n4;d;1;1\r\n", "\t0\t0\t1.5\n1\t0\t2\n0\t1\t3\n1\t1\t4\n"}) {
    const auto source = open(text);
    EXPECT_EQ(source->info().sample_type, SampleType::kFloat64) << text;
    EXPECT_THAT(values_of(*source), ElementsAre(3, 4, 1.5, 2)) << text;
  }
  EXPECT_EQ(open("lon lat height\n0 0 1\n1 0 2\n0 1 3\n1 1 4\n", "a.txt")->info().georeference.unit,
            HorizontalUnit::kDegree);
  EXPECT_THAT(values_of(*open("0 0 1 255 0 0\n1 0 2 0 0 0\n0 1 3 0 0 0\n1 1 4 0 0 0\n")), ElementsAre(3, 4, 1, 2));
}

TEST_F(Xyz, MissingPointsAreVoid) {
  const auto source = open("0 0 1.5\n1 0 2\n2 0 3\n0 1 4\n2 1 6\n");
  EXPECT_TRUE(std::isnan(values_of(*source)[1]));
  const auto whole = open("0 0 1\n1 0 2\n2 0 3\n0 1 4\n2 1 6\n");
  EXPECT_TRUE(is_void(whole->info(), values_of(*whole)[1]));
}

TEST_F(Xyz, MissingPointsStayVoidWhateverTheOptionSays) {
  write_file(folder_ / "a.xyz", "0 0 1\n1 0 -9\n2 0 3\n0 1 4\n2 1 6\n");
  OpenOptions options;
  options.void_values = {-9.0};
  const auto source = open_raster(folder_ / "a.xyz", options);
  ASSERT_EQ(source->info().sample_type, SampleType::kInt32);
  const std::vector<double> values = values_of(*source);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(is_void(source->info(), values[i]), i == 1 || i == 4) << values[i];
  }
}

TEST_F(Xyz, TheVoidValueBesideIsOneOfWholeNumbersToo) {
  write_file(folder_ / "a.xyz.aux.xml",
             "<PAMDataset><PAMRasterBand band=\"1\"><NoDataValue>3</NoDataValue></PAMRasterBand></PAMDataset>");
  for (const char* last : {"4", "4.5", ""}) {
    const auto source =
        open(std::string("0 0 1\n1 0 2\n2 0 5\n0 1 3\n") + (*last != '\0' ? "1 1 4\n2 1 " : "1 1 7") + last);
    EXPECT_TRUE(is_void(source->info(), 3.0)) << last;
    EXPECT_FALSE(is_void(source->info(), 2.0)) << last;
    const std::vector<double> values = values_of(*source);
    EXPECT_EQ(is_void(source->info(), values[2]), *last == '\0') << "where no point is";
  }
}

TEST_F(Xyz, CoordinatesMayBeRounded) {
  std::string text;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 50; ++column) {
      text += fmt::format("{:.5f} {:.5f} {}\n", 6.0 + column / 3600.0, 45.0 + row / 3600.0, row * 50 + column);
    }
  }
  const auto source = open(text);
  ASSERT_EQ(source->info().width, 50);
  ASSERT_EQ(source->info().height, 40);
  EXPECT_NEAR(source->info().georeference.spacing_x, 1.0 / 3600.0, 1e-6);
  EXPECT_EQ(values_of(*source)[0], 39 * 50);
}

TEST_F(Xyz, IrregularPointsAreRefusedByTheirLine) {
  ErrorCode code{};
  EXPECT_THAT(failure("0 0 1\n1 0 2\n0 1 3\n1 1 4\n2.4 1 4\n", &code), HasSubstr("line 5 has x 2.4, 0.40 spacings of"));
  EXPECT_EQ(code, ErrorCode::kUnsupported);
  EXPECT_THAT(failure("0 0 1\n0 1 2\n0 2 3\n0 3 4\n"), HasSubstr("line 1 has the x of all points"));
  EXPECT_THAT(failure("0 0 1\n1 0 2\n0 1 3\n1 x 4\n", &code), HasSubstr("line 4 is \"1 x 4\", must be x, y and z"));
  EXPECT_EQ(code, ErrorCode::kCorrupt);
  EXPECT_THAT(failure("0 0 1\n1 0 2\n0 1 z\n1 1 4\n"), HasSubstr("line 3 is"));
  std::string scattered;
  for (int i = 0; i < 100; ++i) scattered += fmt::format("{} {} 1\n", i, (i * 37) % 100);
  EXPECT_THAT(failure(scattered), HasSubstr("its 100 points are few of 100 x 100"));
}

}  // namespace
}  // namespace isohf::test
