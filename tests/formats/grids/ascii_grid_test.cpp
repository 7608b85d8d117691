#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/core.h>
#include <cmath>
#include <random>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/every_window.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kHeader = "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n";
constexpr const char* kNumbers = "1 2 3\n4 5 -9999\n";

class AsciiGrid : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& text, const OpenOptions& options = {}) const {
    return open_raster(write(text), options);
  }

  [[nodiscard]] Error refusal(const std::string& text) const {
    return error_of([&] { (void)open(text); });
  }

  [[nodiscard]] std::vector<double> values(const std::string& text) const { return values_of(*open(text)); }

  [[nodiscard]] std::string write(const std::string& text, const std::string& name = "grid.asc") const {
    write_file(folder_ / name, text);
    return folder_ / name;
  }

  TemporaryFolder folder_;
};

TEST_F(AsciiGrid, ReadsWholeNumbersAsIntegers) {
  const auto source = open(std::string(kHeader) + kNumbers);
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.width, 3);
  EXPECT_EQ(info.height, 2);
  EXPECT_EQ(info.sample_type, SampleType::kInt32);
  EXPECT_THAT(info.void_values, ElementsAre(-9999.0));
  EXPECT_THAT(info.warnings, IsEmpty());
  EXPECT_THAT(values_of(*source), ElementsAre(1, 2, 3, 4, 5, -9999));
  const Georeference& place = info.georeference;
  EXPECT_EQ(place.registration, Registration::kArea);
  EXPECT_EQ(place.unit, HorizontalUnit::kUnknown);
  EXPECT_THAT(origin_of(place), ElementsAre(105.0, 215.0));
}

TEST_F(AsciiGrid, ChoosesTheSampleTypeThatHoldsEveryNumber) {
  const auto type_of = [&](const std::string& number) {
    const auto source = open("ncols 2\nnrows 1\n7 " + number + "\n");
    EXPECT_THAT(values_of(*source), ElementsAre(7, std::stod(number))) << number;
    return source->info().sample_type;
  };
  for (const char* number : {"2147483647", "-2147483648", "+5", "-0", "12.", "12.000", "0000000000012"}) {
    EXPECT_EQ(type_of(number), SampleType::kInt32) << number;
  }
  for (const char* number :
       {"2147483648", "-2147483649", "0.5", ".5", "-.5", "12.0001", "1e2", "1E+2", "-1.5e-3", "99999999999999999999"}) {
    EXPECT_EQ(type_of(number), SampleType::kFloat64) << number;
  }
}

TEST_F(AsciiGrid, TakesTheHeaderInAnyOrderAndCase) {
  const auto source = open(
      "nodata_VALUE -1.5\r\nCELLSIZE 2.5\r\nYLLCENTER -4\r\nXllCenter -3\r\nNROWS 2\r\nNCOLS 3\r\n1 2 3\r\n4 5 "
      "6.5\r\n");
  EXPECT_THAT(grid_of(source->info().georeference), ElementsAre(-3.0, -1.5, 2.5, 2.5));
  EXPECT_EQ(source->info().georeference.registration, Registration::kArea);
  EXPECT_THAT(source->info().void_values, ElementsAre(-1.5));
  EXPECT_THAT(values_of(*source), ElementsAre(1, 2, 3, 4, 5, 6.5));
  const auto oblong = open("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ndx 10\ndy 20\n1 2 3 4 5 6\n");
  EXPECT_THAT(grid_of(oblong->info().georeference), ElementsAre(5.0, 30.0, 10.0, 20.0));
}

TEST_F(AsciiGrid, TakesTheVoidValueInAnySpelling) {
  for (const char* name : {"NODATA_value", "nodata_value", "NODATA", "NoData_Value", "nodatavalue"}) {
    const auto source = open(fmt::format("ncols 2\nnrows 1\n{} -9999.000\n1.5 -9999\n", name));
    EXPECT_THAT(source->info().void_values, ElementsAre(-9999.0)) << name;
  }
  EXPECT_THAT(open("ncols 2\nnrows 1\nNODATA_value nan\n1.5 nan\n")->info().void_values, IsEmpty());
  // No sample of this file can be void.
  EXPECT_THAT(open("ncols 2\nnrows 1\nNODATA_value -0.5\n1 2\n")->info().void_values, IsEmpty());
  // Its digits vary: everything as low is void.
  const auto low = open("ncols 2\nnrows 1\nNODATA_value -3.4028234663852886e+38\n-3.40282e+38 2\n");
  EXPECT_EQ(low->info().valid_min, -1e30);
  EXPECT_EQ(low->info().valid_max, std::numeric_limits<double>::infinity());
}

TEST_F(AsciiGrid, BreaksLinesAnywhere) {
  const std::vector<double> wanted = {1, 2, 3, 4, 5, -9999};
  for (const char* numbers : {"1\n2\n3\n4\n5\n-9999\n", "1 2 3 4 5 -9999\n", " 1\t2 \n\n 3 4\r\n5\r-9999   \n\n"}) {
    EXPECT_EQ(values(std::string(kHeader) + numbers), wanted) << numbers;
  }
  EXPECT_EQ(values("ncols 3 nrows 2 1 2 3 4 5 -9999\n"), wanted);
  EXPECT_EQ(values("\xEF\xBB\xBF" + std::string(kHeader) + kNumbers), wanted);
}

TEST_F(AsciiGrid, ReadsDecimalCommasAndSaysSo) {
  const auto source = open("ncols 3\nnrows 1\nxllcorner 1,5\nyllcorner 0\ncellsize 0,5\n1,25 -2,5 7\n");
  EXPECT_EQ(source->info().georeference.origin_x, 1.75);
  EXPECT_THAT(values_of(*source), ElementsAre(1.25, -2.5, 7));
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("decimal commas"));
  EXPECT_THAT(refusal("ncols 3\nnrows 1\n1,5 2.5 3\n").what(), HasSubstr("line 3: \"2.5\" has a decimal point"));
  for (const char* list : {"1,2,3", "1, 2, 3", "1,5, 2 3"}) {
    EXPECT_THAT(refusal("ncols 3\nnrows 1\n" + std::string(list) + "\n").what(), HasSubstr("not commas")) << list;
  }
  EXPECT_THAT(values("ncols 3\nnrows 1\n1,0 -2,00 1,5e1\n"), ElementsAre(1, -2, 15));
  EXPECT_THAT(values("ncols 3\nnrows 1\n1.0D+03 -2.5d-1 1E2\n"), ElementsAre(1000, -0.25, 100));
  EXPECT_THAT(refusal("ncols 2\nnrows 1\n1.234,5 2\n").what(), HasSubstr("is not a number"));
}

TEST_F(AsciiGrid, ReadsWhatIsNoNumberAsVoid) {
  const auto found = values("ncols 8\nnrows 1\nnan NaN -nan NAN inf -Inf 1.#QNAN -1.#IND\n");
  ASSERT_EQ(found.size(), 8U);
  for (const double value : found) EXPECT_FALSE(std::isfinite(value));
}

TEST_F(AsciiGrid, WarnsOfAVoidValueThatTheHeaderDoesNotName) {
  const auto warnings = [&](const std::string& text, const OpenOptions& options = {}) {
    return open(text, options)->info().warnings;
  };
  EXPECT_THAT(warnings("ncols 2\nnrows 1\n1 -9999\n"), ElementsAre(HasSubstr("`void_values` -9999")));
  EXPECT_THAT(warnings("ncols 2\nnrows 1\n-9.999e+03 1\n"), ElementsAre(HasSubstr("`void_values` -9999")));
  EXPECT_THAT(warnings("ncols 2\nnrows 1\n-32768.0 1\n"), ElementsAre(HasSubstr("`void_values` -32768")));
  EXPECT_THAT(warnings("ncols 2\nnrows 1\n-999 1\n"), IsEmpty());
  OpenOptions options;
  options.void_values = {-9999.0};
  EXPECT_THAT(warnings("ncols 2\nnrows 1\n-9999 1\n", options), IsEmpty());
}

TEST_F(AsciiGrid, CarriesThePrjBesideIt) {
  (void)write(R"(PROJCS["UTM_11N",GEOGCS["WGS",DATUM["D",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
              R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
              R"(UNIT["Foot_US",0.304800609601219]])",
              "grid.prj");
  const auto source = open(std::string(kHeader) + kNumbers);
  const Georeference& place = source->info().georeference;
  EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
  EXPECT_NEAR(place.metres_per_unit, 1200.0 / 3937.0, 1e-12);
  EXPECT_EQ(place.system.name, "UTM_11N");
  EXPECT_EQ(place.system.body, "Earth");
  EXPECT_EQ(place.system.semi_major_axis_m, 6378137.0);
  EXPECT_THAT(place.system.wkt, HasSubstr("Transverse_Mercator"));
  (void)write(R"(GEOGCS["GCS_Mars_2000",DATUM["D_Mars",SPHEROID["Mars",3396190.0,169.89]],PRIMEM["Ref",0],)"
              R"(UNIT["Degree",0.0174532925199433],AUTHORITY["EPSG","104905"]])",
              "grid.prj");
  const auto mars = open(std::string(kHeader) + kNumbers);
  EXPECT_EQ(mars->info().georeference.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(mars->info().georeference.system.body, "Mars");
  EXPECT_EQ(mars->info().georeference.system.epsg, 104905);
  for (const char* text :
       {"Projection UTM\nZone 11\n", "PROJCS[", "PROJCS[\"a\"", "[]", "PROJCS[\"a\",,]", "A[B[C]]"}) {
    (void)write(text, "grid.prj");
    const auto other = open(std::string(kHeader) + kNumbers);
    EXPECT_THAT(other->info().warnings, ElementsAre(HasSubstr(".prj"))) << text;
    EXPECT_EQ(other->info().georeference.system.wkt, "");
  }
}

TEST_F(AsciiGrid, WarnsOfDegreesThatNothingDeclares) {
  const auto warnings = [&](const std::string& x, const std::string& spacing) {
    return open("ncols 2\nnrows 1\nxllcorner " + x + "\nyllcorner 40.09\ncellsize " + spacing + "\n1 2\n")
        ->info()
        .warnings;
  };
  EXPECT_THAT(warnings("-105.55", "0.000833333333"), ElementsAre(HasSubstr("look like degrees")));
  EXPECT_THAT(warnings("-105.55", "0.5"), IsEmpty());
  EXPECT_THAT(warnings("361015.59", "0.0008"), IsEmpty());
  (void)write(
      R"(GEOGCS["WGS 84",DATUM["D",SPHEROID["WGS 84",6378137,298.257223563]],UNIT["degree",0.017453292519943]])",
      "grid.prj");
  EXPECT_THAT(warnings("-105.55", "0.000833333333"), IsEmpty());
}

TEST_F(AsciiGrid, NamesTheLineThatIsWrong) {
  const std::string header = kHeader;
  const std::pair<std::string, std::string> rows[] = {
      {header + "1 2 3\n4 x5 6\n", "line 8: \"x5\" is not a number"},
      {header + "1 2 3\n4 5\n", "line 9: the file ends after 5 of 3 x 2 numbers"},
      {header + "1 2 3\n4 5 6\n7", "line 9: \"7\" comes after the 3 x 2 numbers that the header says"},
      {header + "ncols 4\n" + kNumbers, "line 7: ncols is \"4\", on line 1 it was \"3\"; it must be given once"},
      {header + "XllCentre 4\n" + kNumbers, "line 3: xllcorner is one of two words that place the x axis"},
      {"ncols 3\n1 2 3\n", "the header does not say nrows, which it must"},
      {"ncols 3\nnrows", "line 2: nrows has no value"},
      {"ncols 0\nnrows 2\n1 2 3\n", "line 1: ncols is \"0\", must be a whole number from 1 on"},
      {header + "zunits m\n" + kNumbers, "line 7: \"zunits m\" is not a line of an ESRI grid header"},
      {"ncols 4000000000\nnrows 4000000000\n1 2 3\n", "the header says 4000000000 x"},
      {"ncols 3\nnrows 2\ncellsize 0\n1 2 3 4 5 6\n", "must be a positive number"},
      {header + std::string("1 2 3\n4 \0 6\n", 12), "line 8: \"?\" is not a number"},
      {header + "1 2 3\n4 5 6" + std::string(1, '\0'), "is not a number"},
      {header + "1 2 3\n4 5 6" + std::string(5000, '\0'), "bytes without a blank"},
      {header + "1 2 3\n4 5 6" + std::string(2, '\0') + "\n", "is not a number"},
      {header + "1e400 2 3 4 5 6\n", "\"1e400\" is not a number"},
      {header + std::string(5000, '1') + " 2 3 4 5 6\n", "is not a number"},
      {header + std::string(600000, '1'), "bytes without a blank"}};
  for (const auto& [text, says] : rows) {
    EXPECT_THAT(refusal(text).what(), ::testing::AllOf(::testing::StartsWith(folder_ / "grid.asc: "), HasSubstr(says)));
  }
  EXPECT_EQ(error_of([&] { (void)open(header + kNumbers, of_channel("R")); }).code(), ErrorCode::kInvalidArgument);
}

TEST_F(AsciiGrid, DeliversEveryWindowInAnyOrder) {
  for (const bool fractions : {false, true}) {
    std::string text = "ncols 7\nnrows 5\n";
    for (int i = 0; i < 35; ++i) text += fmt::format("{}{}{}", i, fractions ? ".5" : "", i % 3 == 0 ? "\n" : " ");
    const auto source = open(text + "\n");
    expect_every_window(*source, read_whole(*source));
  }
}

/// More rows than places are kept of, and many more bytes than are buffered.
TEST_F(AsciiGrid, FindsRowsOfALongFile) {
  constexpr int kRows = 300001;
  std::string text = fmt::format("ncols 2\nnrows {}\n", kRows);
  for (int row = 0; row < kRows; ++row) text += fmt::format("{} {}\n", row, -row);
  const auto source = open(text);
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const auto row = static_cast<std::int64_t>(random() % kRows);
    const auto pair = read_window(*source, {0, row, 2, 1});
    ASSERT_EQ(value_at(SampleType::kInt32, pair, 0), static_cast<double>(row));
    ASSERT_EQ(value_at(SampleType::kInt32, pair, 1), static_cast<double>(-row));
  }
}

}  // namespace
}  // namespace isohf::test
