#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/grids/dted_cell.h"
#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/every_window.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::kDtedHeader;
using test::put;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// What test cells hold: a void in the South-West corner, else by column and post from the South, below and above 0.
int height_at(int column, int post) {
  return column == 0 && post == 0 ? -32767 : 1000 * column - 7 * post - 1500;
}

std::string cell() {
  return test::dted_cell(4, 5, height_at);
}

class Dted : public test::ReaderTest {
 protected:
  std::string write(const std::string& bytes) const { return ReaderTest::write("n43.dt0", bytes); }

  std::string failure(const std::string& bytes, ErrorCode* code = nullptr) const {
    return failure_at(write(bytes), code, kDtedFormat.open);
  }
};

TEST_F(Dted, TurnsColumnsIntoRowsFromTheNorth) {
  const auto source = open_raster(write(cell()), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.georeference.registration, Registration::kPoint);
  EXPECT_DOUBLE_EQ(info.georeference.spacing_x, 30.0 / 3600.0);
  EXPECT_DOUBLE_EQ(info.georeference.spacing_y, 15.0 / 3600.0);
  EXPECT_DOUBLE_EQ(info.georeference.origin_x, -80.0);
  EXPECT_DOUBLE_EQ(info.georeference.origin_y, 43.0 + 60.0 / 3600.0);
  EXPECT_EQ(info.georeference.system.epsg, 4326);
  EXPECT_EQ(info.void_values, std::vector<double>{-32767.0});
  test::expect_every_window(*source, test::stored<std::int16_t>(4, 5, [](std::int64_t c, std::int64_t r) {
    return height_at(static_cast<int>(c), static_cast<int>(4 - r));
  }));
}

TEST_F(Dted, FindsTheCellBehindATapeRecord) {
  EXPECT_EQ(failure("HDR1" + std::string(76, ' ') + cell() + "and what follows it"), "");
  std::string south = cell();
  put(south, 4, "0100000E0100000S");
  const auto source = kDtedFormat.open(write(south), {});
  EXPECT_EQ(source->info().georeference.origin_x, 10.0);
  EXPECT_DOUBLE_EQ(source->info().georeference.origin_y, -10.0 + 60.0 / 3600.0);
}

TEST_F(Dted, CarriesItsDatums) {
  std::string old = cell();
  put(old, 80 + 141, "E96WGS72");
  const auto source = kDtedFormat.open(write(old), {});
  EXPECT_EQ(source->info().georeference.system.epsg, 4322);
  EXPECT_FALSE(source->info().georeference.system.vertical_epsg);  // GDAL and QGIS want degrees alone in a GeoTIFF
  put(old, 80 + 144, "XXXXX");
  EXPECT_THAT(kDtedFormat.open(write(old), {})->info().warnings,
              ElementsAre("the horizontal datum in DSI is neither WGS84 nor WGS72; its ellipsoid is not known"));
}

TEST_F(Dted, NamesTheColumnOfEveryDamagedRecord) {
  const std::string whole = cell();
  const std::size_t record = 12 + 10;
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t i = 0; i < record; ++i) {
      std::string damaged = whole;
      const std::size_t at = kDtedHeader + column * record + i;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x04);
      ErrorCode code = ErrorCode::kCancelled;
      const std::string what = failure(damaged, &code);
      EXPECT_THAT(what, HasSubstr(fmt::format("column {} at byte {}", column, kDtedHeader + column * record)));
      if (i + 4 >= record) {
        EXPECT_THAT(what, HasSubstr("its checksum is "));
      }
      EXPECT_EQ(code, ErrorCode::kCorrupt);
    }
  }
  std::string two = whole;
  put(two, kDtedHeader + 8, "\xFF\xFB");  // -5 in two's complement
  test::sign(two, kDtedHeader, 5);
  EXPECT_THAT(failure(two), HasSubstr("post 0 from the South is at -32763 m"));
}

TEST_F(Dted, SaysWhichLabelIsWrong) {
  for (const auto& [at, text, said] : {std::tuple(4U, "08X0000W", "UHL: the longitude of the origin at byte 4"),
                                       {19U, "E", "UHL: the latitude of the origin at byte 12"},
                                       {20U, "0000", "longitude interval"},
                                       {47U, "0003", "DSI: says 4 x 5 posts, UHL 3 x 5"},
                                       {80U + 264U, "0010000.0", "rotated"},
                                       {728U, "XXX", "ACC: is not at byte 728"}}) {
    std::string wrong = cell();
    put(wrong, at, text);
    EXPECT_THAT(failure(wrong), HasSubstr(said));
  }
  EXPECT_THROW((void)kDtedFormat.open(write(cell()), test::of_channel("1")), Error);
}

}  // namespace
}  // namespace isohf
