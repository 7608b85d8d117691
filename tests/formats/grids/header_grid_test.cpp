#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  write("W180N90.PRJ", "Projection    GEOGRAPHIC\nDatum         WGS84\nZunits        METERS\nUnits         DD\n");
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
    EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
    EXPECT_EQ(info.georeference.system.epsg, 4326);
    EXPECT_EQ(info.georeference.origin_y, 89.99583333333334);
    EXPECT_THAT(values_of(*source), ElementsAre(-9999, 1, 2, 256, -1, 8824));
    EXPECT_THAT(info.warnings, ElementsAre(HasSubstr("no pixeltype")));
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

TEST_F(HeaderGrid, ReadsEveryTypeInBothByteOrdersAndEveryLayout) {
  struct Kind {
    const char* name;
    int bits;
    SampleType type;
  };
  for (const Kind& kind : {Kind{"UNSIGNEDINT", 8, SampleType::kUint8}, Kind{"SIGNEDINT", 8, SampleType::kInt8},
                           Kind{"UNSIGNEDINT", 16, SampleType::kUint16}, Kind{"SIGNEDINT", 16, SampleType::kInt16},
                           Kind{"UNSIGNEDINT", 32, SampleType::kUint32}, Kind{"SIGNEDINT", 32, SampleType::kInt32},
                           Kind{"FLOAT", 32, SampleType::kFloat32}, Kind{"float", 64, SampleType::kFloat64}}) {
    const std::size_t size = size_bytes(kind.type);
    for (const char* layout : {"bil", "bip", "bsq"}) {
      for (const bool big : {false, true}) {
        const std::size_t row = 5 * size + 3;  // padded
        const std::string data = bytes(7 + 4 * row);
        const auto source = open(
            fmt::format("byteorder {}\r\nlayout {}\r\nnrows 4\r\nncols 5\r\nnbands 1\r\nnbits {}\r\npixeltype {}\r\n"
                        "skipbytes 7\r\nbandrowbytes {}\r\ntotalrowbytes {}\r\n",
                        big ? "M" : "I", layout, kind.bits, kind.name, row, row),
            data, std::string("grid.") + layout);
        EXPECT_THAT(source->info().warnings, IsEmpty());
        EXPECT_EQ(source->info().sample_type, kind.type);
        std::string wanted;
        for (std::size_t i = 0; i < 20; ++i) {
          std::string sample = data.substr(7 + i / 5 * row + i % 5 * size, size);
          if (big) std::reverse(sample.begin(), sample.end());
          wanted += sample;
        }
        expect_every_window(*source, std::as_bytes(std::span(wanted)));
      }
    }
    std::filesystem::remove(folder / "grid.bil");
  }
}

TEST_F(HeaderGrid, PlacesCentresAndCorners) {
  const auto origin = [&](const std::string& words) {
    const auto source = open(kSixteenBits + words, bytes(12));
    const Georeference& place = source->info().georeference;
    EXPECT_EQ(place.registration, Registration::kArea);
    return std::tuple(place.has_origin, place.origin_x, place.origin_y, place.spacing_x, place.spacing_y);
  };
  EXPECT_EQ(origin(""), std::tuple(false, 0.0, 0.0, 1.0, 1.0));
  EXPECT_EQ(origin("ULXMAP 100\nULYMAP 200\nXDIM 2\nYDIM 4\n"), std::tuple(true, 100.0, 200.0, 2.0, 4.0));
  EXPECT_EQ(origin("xllcorner 100\nyllcorner 200\ncellsize 2\n"), std::tuple(true, 101.0, 203.0, 2.0, 2.0));
  EXPECT_EQ(origin("xllcenter 100\nyllcenter 200\ncellsize 2\n"), std::tuple(true, 100.0, 202.0, 2.0, 2.0));
}

TEST_F(HeaderGrid, CarriesTheVoidValue) {
  EXPECT_THAT(open(std::string(kSixteenBits) + "NODATA -9999\n", bytes(12))->info().void_values, ElementsAre(-9999.0));
  const std::string header = "ncols 3\nnrows 1\nbyteorder LSBFIRST\nNODATA_value -3.4028235e+38\n";
  const auto source = open(header, bytes(12), "grid.flt");
  EXPECT_EQ(source->info().format, "GridFloat");
  EXPECT_EQ(source->info().sample_type, SampleType::kFloat32);
  EXPECT_EQ(source->info().valid_min, -1e38);
}

TEST_F(HeaderGrid, SaysWhatItTakesForGranted) {
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
  const std::string header = kSixteenBits;
  EXPECT_THAT(refusal(header + "NBANDS 3\n", bytes(12)), HasSubstr("nbands is 3"));
  EXPECT_THAT(refusal(header + "LAYOUT tiles\n", bytes(12)), HasSubstr("layout is \"tiles\""));
  EXPECT_THAT(refusal("NROWS 2\nNCOLS 3\nNBITS 4\n", bytes(12)), HasSubstr("of 4 bits"));
  EXPECT_THAT(refusal("NROWS 2\nNCOLS 3\nBYTEORDER VMS_FFLOAT\n", bytes(24), "grid.flt"), HasSubstr("vms_ffloat"));
  EXPECT_THAT(refusal("", bytes(12)), HasSubstr("does not say ncols"));
  EXPECT_THAT(refusal(header + "TOTALROWBYTES 5\n", bytes(12)), HasSubstr("rows have 5 bytes"));
  EXPECT_THAT(refusal(header + "NROWS 3\n", bytes(12)), HasSubstr("line 6: NROWS is \"3\""));
  EXPECT_THAT(refusal(header + "XDIM\n", bytes(12)), HasSubstr("line 6: XDIM has no value"));
  EXPECT_THAT(refusal(std::string(70000, ' '), bytes(12)), HasSubstr("longer than"));
  for (const char* huge : {"9223372036854775807", "4611686018427387905", "4294967297"}) {
    for (const char* word : {"SKIPBYTES", "TOTALROWBYTES"}) {
      EXPECT_THAT(refusal(header + word + " " + huge + "\n", bytes(12)), HasSubstr("take more")) << word << huge;
    }
    EXPECT_THAT(refusal(fmt::format("NROWS {0}\nNCOLS {0}\n", huge), bytes(12)), HasSubstr("take more"));
    EXPECT_THAT(refusal(fmt::format("NROWS {}\nNCOLS 3\n", huge), bytes(12)), HasSubstr("take more"));
  }
}

TEST_F(HeaderGrid, WantsExactlyTheBytesOfItsHeader) {
  for (std::size_t length = 1; length < 30; ++length) {
    if (length == 12) continue;
    EXPECT_THAT(refusal(kSixteenBits, bytes(length)), HasSubstr("take")) << length;
  }
  // The last row may lack its padding, and nothing else.
  for (std::size_t length = 1; length < 30; ++length) {
    const std::string header = std::string(kSixteenBits) + "TOTALROWBYTES 9\n";
    if (length >= 15 && length <= 18) {
      EXPECT_EQ(read_whole(*open(header, bytes(length))).size(), 12U);
    } else {
      EXPECT_THAT(refusal(header, bytes(length)), HasSubstr("take")) << length;
    }
  }
}

}  // namespace
}  // namespace isohf::test
