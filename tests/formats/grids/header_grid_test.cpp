#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <tuple>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kSixteenBits = "NROWS 2\nNCOLS 3\nNBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER I\n";

class HeaderGrid : public ReaderTest {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& header, const std::string& data,
                                                   const std::string& name = "grid.bil") const {
    write("grid.hdr", header);
    write(name, data);
    return open_raster(folder / name, {});
  }

  [[nodiscard]] std::string refusal(const std::string& header, const std::string& data,
                                    const std::string& name = "grid.bil") const {
    const std::string what = error_of([&] { (void)open(header, data, name); }).what();
    EXPECT_EQ(what.find('\n'), std::string::npos);
    return what;
  }

  [[nodiscard]] static std::string bytes(std::size_t count) {
    std::string data(count, '\0');
    // No byte that makes a float larger than any ground, in either byte order.
    for (std::size_t i = 0; i < count; ++i) data[i] = static_cast<char>((i * 59 + 3) & 0xbfU);
    return data;
  }
};

TEST_F(HeaderGrid, ReadsGtopo30) {
  write("W180N90.HDR",
        "BYTEORDER      M\nLAYOUT       BIL\nNROWS         2\nNCOLS         3\nNBANDS        1\nNBITS         16\n"
        "BANDROWBYTES         6\nTOTALROWBYTES        6\nBANDGAPBYTES         0\nNODATA        -9999\n"
        "ULXMAP        -179.99583333333334\nULYMAP        89.99583333333334\nXDIM          0.00833333333333\n"
        "YDIM          0.00833333333333\n");
  write("W180N90.DEM", std::string("\xD8\xF1\x00\x01\x00\x02\x01\x00\xFF\xFF\x22\x78", 12));
  for (const char* name : {"W180N90.DEM", "W180N90.HDR"}) {
    const auto source = open_raster(folder / name, {});
    const SourceInfo& info = source->info();
    ASSERT_EQ(info.sample_type, SampleType::kInt16);
    EXPECT_EQ(info.void_values, std::vector<double>{-9999.0});
    EXPECT_EQ(info.georeference.origin_y, 89.99583333333334);
    EXPECT_THAT(values_of(*source), ElementsAre(-9999, 1, 2, 256, -1, 8824));
    EXPECT_THAT(info.warnings, ElementsAre(HasSubstr("no pixeltype"), HasSubstr("look like degrees")));
  }
}

TEST_F(HeaderGrid, TakesThePlaceFromAWorldFileWhereTheHeaderHasNone) {
  const std::string world = "10\n0\n0\n-20\n500005\n4000010\n";
  for (const auto& [data, extension] : {std::pair{"grid.bil", "grid.blw"}, {"grid.bsq", "grid.bqw"}}) {
    write(extension, world);
    const auto source = open(kSixteenBits, bytes(12), data);
    const Georeference& place = source->info().georeference;
    EXPECT_THAT(grid_of(place), ElementsAre(500005.0, 4000010.0, 10.0, 20.0));
    EXPECT_THAT(source->info().warnings, IsEmpty());
    // The header goes first, and what contradicts it is said.
    const std::string placed = std::string(kSixteenBits) + "ULXMAP 500005\nULYMAP 4000010\nXDIM 10\nYDIM ";
    EXPECT_THAT(open(placed + "20\n", bytes(12), data)->info().warnings, IsEmpty());
    EXPECT_THAT(open(placed + "10\n", bytes(12), data)->info().warnings,
                ElementsAre(HasSubstr("elsewhere than the header")));
    write(extension, "10\n0\n0\n20\n500005\n4000010\n");
    EXPECT_THAT(refusal(kSixteenBits, bytes(12), data), HasSubstr("dy is positive"));
    std::filesystem::remove(folder / extension);
    std::filesystem::remove(folder / data);
  }
}

TEST_F(HeaderGrid, PlacesCentresAndCorners) {
  const std::pair<const char*, std::array<double, 4>> rows[] = {
      {"", {0.0, 0.0, 1.0, 1.0}},
      {"ULXMAP 100\nULYMAP 200\nXDIM 2\nYDIM 4\n", {100.0, 200.0, 2.0, 4.0}},
      {"xllcorner 100\nyllcorner 200\ncellsize 2\n", {101.0, 203.0, 2.0, 2.0}},
      {"xllcenter 100\nyllcentre 200\ncellsize 2\n", {100.0, 202.0, 2.0, 2.0}},
      {"XLLCORNER 100\nyll_center 200\ndx 2\ndy 4\n", {101.0, 204.0, 2.0, 4.0}}};
  for (const auto& [words, grid] : rows) {
    const Georeference place = open(std::string(kSixteenBits) + words, bytes(12))->info().georeference;
    EXPECT_EQ(place.registration, Registration::kArea);
    EXPECT_EQ(place.has_origin, *words != '\0');
    EXPECT_EQ(place.spacing_y, grid[3]);
    if (place.has_origin) {
      EXPECT_THAT(grid_of(place), ::testing::ElementsAreArray(grid)) << words;
    }
  }
  for (const char* words : {"ULXMAP 100\nXDIM 2\nYDIM 4\n", "ULXMAP 100\nULYMAP 200\n"}) {
    const auto source = open(std::string(kSixteenBits) + words, bytes(12));
    EXPECT_FALSE(source->info().georeference.has_origin);
    EXPECT_THAT(source->info().warnings, ElementsAre(HasSubstr("the position is unknown")));
  }
}

TEST_F(HeaderGrid, CarriesTheNodataValue) {
  EXPECT_THAT(open(std::string(kSixteenBits) + "NODATA -9999\n", bytes(12))->info().void_values, ElementsAre(-9999.0));
  const std::string header = "ncols 3\nnrows 1\nbyteorder LSBFIRST\nNODATA_value -3.4028235e+38\n";
  const auto source = open(header, bytes(12), "grid.flt");
  EXPECT_EQ(source->info().format, "GridFloat");
  EXPECT_EQ(source->info().sample_type, SampleType::kFloat32);
  EXPECT_EQ(source->info().valid_min, -1e30);
  EXPECT_THAT(open("NROWS 2\nNCOLS 3\nNBITS 16\n", bytes(12))->info().warnings,
              ElementsAre(HasSubstr("no pixeltype"), HasSubstr("no byteorder")));
  EXPECT_THAT(open("NROWS 2\nNCOLS 3\n", bytes(6))->info().warnings, IsEmpty());
}

TEST_F(HeaderGrid, MissesTheOtherFileByName) {
  write("lonely.flt", bytes(12));
  write("lonely.bil", bytes(12));
  EXPECT_THAT(error_of([&] { (void)open_raster(folder / "lonely.flt", {}); }).what(),
              HasSubstr("lonely.hdr is not there"));
  write("lonely.hdr", kSixteenBits);
  EXPECT_THAT(error_of([&] { (void)open_raster(folder / "lonely.hdr", {}); }).what(), HasSubstr("name the one"));
  std::filesystem::remove(folder / "lonely.flt");
  EXPECT_EQ(open_raster(folder / "lonely.hdr", {})->info().width, 3);
  std::filesystem::remove(folder / "lonely.bil");
  EXPECT_THAT(error_of([&] { (void)open_raster(folder / "lonely.hdr", {}); }).what(),
              HasSubstr("whose data is not beside"));
  write("twofold.bil", bytes(12));
  write("twofold.bil.hdr", std::string("BYTEORDER I\n") + kSixteenBits);
  EXPECT_EQ(open_raster(folder / "twofold.bil", {})->info().width, 3);
  EXPECT_EQ(open_raster(folder / "twofold.bil.hdr", {})->info().width, 3);
}

TEST_F(HeaderGrid, RefusesWhatItDoesNotRead) {
  struct Row {
    std::string words;  ///< behind those of sixteen bits, or all
    const char* says;
    bool are_all = false;
  };
  const Row rows[] = {{"NBANDS 3\n", "nbands is 3"},
                      {"LAYOUT tiles\n", "layout is \"tiles\""},
                      {"NROWS 2\nNCOLS 3\nNBITS 4\n", "of 4 bits", true},
                      {"NROWS 2\nNCOLS 3\nBYTEORDER VMS_FFLOAT\n", "vms_ffloat", true},
                      {"", "does not say ncols", true},
                      {"TOTALROWBYTES 5\n", "rows have 5 bytes"},
                      {"NROWS 3\n", "line 6: NROWS is \"3\""},
                      {"NROWS 2.5\nNCOLS 3\n", "line 1: NROWS is \"2.5\", must be a whole number from 1 on", true},
                      {"XDIM\n", "line 6: XDIM has no value"},
                      {"XDIM 0\n", "line 6: XDIM is \"0\", must be a positive number"},
                      {"XDIM 1\n", "the spacing of one axis alone"},
                      {"CELLSIZE 1\nXDIM 2\nYDIM 2\n", "must be the same as dx and dy"},
                      {std::string(std::size_t{2} << 20U, ' '), "longer than", true},
                      {"SKIPBYTES 9223372036854775807\n", "take more than any file has"},
                      {"TOTALROWBYTES 4611686018427387905\n", "take more than any file has"},
                      {"TOTALROWBYTES 4294967297\n", "take 4294967303"},
                      {"NROWS 9223372036854775807\nNCOLS 3\n", "more than 2147483647 samples a side", true},
                      {"NROWS 2147483647\nNCOLS 2147483647\nNBITS 32\n", "take more than any file has", true}};
  for (const Row& row : rows) {
    EXPECT_THAT(refusal((row.are_all ? "" : kSixteenBits) + row.words, bytes(12)), HasSubstr(row.says));
  }
}

TEST_F(HeaderGrid, WantsExactlyTheBytesOfItsHeader) {
  for (std::size_t length = 1; length < 30; ++length) {
    // The last row may lack its padding, and nothing else.
    for (const auto& [words, least, most] : {std::tuple("", 12U, 12U), {"TOTALROWBYTES 9\n", 15U, 18U}}) {
      const std::string header = std::string(kSixteenBits) + words;
      if (length >= least && length <= most) {
        EXPECT_EQ(read_whole(*open(header, bytes(length))).size(), 12U);
      } else {
        EXPECT_THAT(refusal(header, bytes(length)), HasSubstr("take")) << length;
      }
    }
  }
}

}  // namespace
}  // namespace isohf::test
