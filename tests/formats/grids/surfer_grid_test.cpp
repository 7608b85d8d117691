#include "formats/readers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "formats/files/gzipped.h"
#include "formats/reader_failure.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename T>
std::string little(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

constexpr float kBlank = 1.70141e38F;

/// 3 x 2 nodes, the southern row first.
std::string text_grid(const std::string& numbers = "1 2 1.70141e+038\n4 5.5 6\n") {
  return "DSAA\n3 2\n500 520\n4000 4030\n1 6\n" + numbers;
}

std::string surfer6(std::int16_t columns = 3, std::int16_t rows = 2, double east = 520.0) {
  std::string bytes = "DSBB" + little(columns) + little(rows);
  for (const double value : {500.0, east, 4000.0, 4030.0, 1.0, 6.0}) bytes += little(value);
  for (const float value : {1.0F, 2.0F, kBlank, 4.0F, 5.5F, 6.0F}) bytes += little(value);
  return bytes;
}

/// With a section that nobody knows between header and grid.
std::string surfer7(double angle = 0.0, double blank = -9999.0) {
  std::string bytes = "DSRB" + little(4) + little(2) + "ELSE" + little(3) + "abc";
  bytes += "GRID" + little(72) + little(2) + little(3);
  for (const double value : {500.0, 4000.0, 10.0, 30.0, 1.0, 6.0, angle, blank}) bytes += little(value);
  bytes += "DATA" + little(48);
  for (const double value : {1.0, 2.0, blank, 4.0, 5.5, 6.0}) bytes += little(value);
  return bytes;
}

class SurferGrid : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& bytes, const std::string& name = "a.grd") const {
    write_file(folder_ / name, bytes);
    return open_raster(folder_ / name, {});
  }
  [[nodiscard]] std::string failure(const std::string& bytes, ErrorCode* code = nullptr) const {
    write_file(folder_ / "a.grd", bytes);
    return failure_of(folder_ / "a.grd", code, [&] { read_corner(*open_raster(folder_ / "a.grd", {})); });
  }

  const TemporaryFolder folder_;
};

TEST_F(SurferGrid, HasItsFirstRowInTheSouthAndItsNodesAsPoints) {
  for (const auto& [bytes, format, type] : {std::tuple{text_grid(), "Surfer text grid", SampleType::kFloat64},
                                            {surfer6(), "Surfer 6 grid", SampleType::kFloat32},
                                            {surfer7(), "Surfer 7 grid", SampleType::kFloat64}}) {
    SCOPED_TRACE(format);
    const auto source = open(bytes);
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, format);
    EXPECT_EQ(info.sample_type, type);
    EXPECT_EQ(info.width, 3);
    EXPECT_EQ(info.height, 2);
    const Georeference& place = info.georeference;
    EXPECT_EQ(place.registration, Registration::kPoint);
    EXPECT_TRUE(place.has_origin);
    EXPECT_EQ(place.origin_x, 500.0);
    EXPECT_EQ(place.origin_y, 4030.0);
    EXPECT_EQ(place.spacing_x, 10.0);
    EXPECT_EQ(place.spacing_y, 30.0);
    EXPECT_TRUE(info.warnings.empty());
    const std::vector<double> values = values_of(*source);
    EXPECT_THAT(std::vector<double>(values.begin(), values.begin() + 5), ElementsAre(4.0, 5.5, 6.0, 1.0, 2.0));
    EXPECT_TRUE(is_void(info, values[5]));
    for (std::size_t i = 0; i < 5; ++i) EXPECT_FALSE(is_void(info, values[i]));
  }
}

TEST_F(SurferGrid, WindowsEqualTheWhole) {
  std::string numbers;
  std::string floats;
  for (int i = 0; i < 7 * 5; ++i) {
    numbers += std::to_string(i) + (i % 3 == 0 ? "\n" : " ");  // lines break anywhere
    floats += little(static_cast<float>(i));
  }
  std::string binary = "DSBB" + little(std::int16_t{7}) + little(std::int16_t{5});
  for (const double value : {0.0, 6.0, 0.0, 4.0, 0.0, 34.0}) binary += little(value);
  const std::string text = "DSAA 7 5\n0 6\n0 4\n0 34\n" + numbers + "\n";
  write_file(folder_ / "c.grd.gz", gzipped(text));
  for (const auto& source : {open(text), open(binary + floats, "b.grd"), open_raster(folder_ / "c.grd.gz", {})}) {
    for (std::int64_t row = 4; row >= 0; --row) {
      for (std::int64_t column = 0; column < 7; ++column) {
        for (std::int64_t columns = 1; columns <= 7 - column; ++columns) {
          const Window window{column, row, columns, 5 - row};
          const auto values = values_of(source->info().sample_type, read_window(*source, window));
          for (std::int64_t i = 0; i < columns * window.rows; ++i) {
            const double expected = static_cast<double>(7 * (4 - row - i / columns) + column + i % columns);
            ASSERT_EQ(values[static_cast<std::size_t>(i)], expected) << column << ", " << row;
          }
        }
      }
    }
  }
}

TEST_F(SurferGrid, SaysWhatIsWrong) {
  EXPECT_THAT(failure(text_grid("1 2 3\n4 x 6\n")), HasSubstr("\"x\" at byte 39 is not a number"));
  EXPECT_THAT(failure(text_grid("1 2 3\n4 5 6\n7\n")), HasSubstr("\"7\" at byte 43 comes after the 3 x 2 nodes"));
  EXPECT_THAT(failure(text_grid("1 2 3\n")), HasSubstr("ends after 3 of 3 x 2 nodes"));
  EXPECT_THAT(failure("DSAA\n3.5 2\n0 1\n0 1\n0 1\n"), HasSubstr("3.5 x 2 nodes, must be whole numbers from 2"));
  EXPECT_THAT(failure("DSAA\n2000000000 2000000000\n0 1\n0 1\n0 1\n"), HasSubstr("bytes hold"));
  EXPECT_THAT(failure(surfer6(1)), HasSubstr("1 x 2 nodes"));
  EXPECT_THAT(failure(surfer6(3, -2)), HasSubstr("3 x -2 nodes"));
  EXPECT_THAT(failure(surfer6(30000, 30000)), HasSubstr("ends early: 30000 x 30000 nodes of 4 bytes"));
  EXPECT_THAT(failure(surfer6(3, 2, 500.0)), HasSubstr("the distances positive"));
  EXPECT_THAT(failure(surfer6(3, 2, std::numeric_limits<double>::quiet_NaN())), HasSubstr("the distances positive"));
  ErrorCode code = ErrorCode::kCancelled;
  EXPECT_THAT(failure(surfer7(30.0), &code), HasSubstr("turned by 30"));
  EXPECT_EQ(code, ErrorCode::kUnsupported);
  EXPECT_THAT(failure("DSRB" + little(4) + little(1) + "DATA" + little(0)), HasSubstr("data come before"));
  EXPECT_THAT(failure("DSRB" + little(-4) + little(1)), HasSubstr("section DSRB at byte 0 has a size of -4 bytes"));
  std::string endless;
  for (int i = 0; i < 100; ++i) endless += "DSRB" + little(0);
  EXPECT_THAT(failure(endless), HasSubstr("64 sections without data"));
}

TEST_F(SurferGrid, WarnsOfWhatIsOddAndReadsIt) {
  EXPECT_THAT(open(surfer6() + "more")->info().warnings, ElementsAre("4 bytes follow the grid"));
  EXPECT_TRUE(open(text_grid("1 2 3 4 5 6"))->info().warnings.empty());  // a text may end without a line break
  write_file(folder_ / "a.prj", R"(PROJCS["Here",GEOGCS["G",DATUM["D",SPHEROID["S",6378137,298]]],UNIT["metre",1]])");
  EXPECT_EQ(open(surfer7())->info().georeference.system.name, "Here");
}

}  // namespace
}  // namespace isohf::test
