#include "formats/georeference/sidecars.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader_failure.h"
#include "isohf/error.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// What GDAL 3.6 writes beside a PNG, shortened; statistics and histograms are what most such files hold.
constexpr const char* kAll = R"(<PAMDataset>
  <SRS dataAxisToSRSAxisMapping="2,1">GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]</SRS>
  <GeoTransform>  1.0000000000000000e+01,  5.0e-01,  0.0,  5.0e+01,  0.0, -2.5e-01</GeoTransform>
  <Metadata domain="IMAGE_STRUCTURE"><MDI key="AREA_OR_POINT">Area</MDI></Metadata>
  <Metadata><MDI key="AREA_OR_POINT">Point</MDI><MDI key="DataType">Generic</MDI></Metadata>
  <PAMRasterBand band="1">
    <NoDataValue>1</NoDataValue>
  </PAMRasterBand>
  <PAMRasterBand band="2">
    <Description>a &lt;b&gt;</Description>
    <NoDataValue>-3.2768E+04</NoDataValue>
    <UnitType>ft</UnitType>
    <Offset>100</Offset><Scale>0.1</Scale>
    <Metadata><MDI key="STATISTICS_MINIMUM">7</MDI></Metadata>
  </PAMRasterBand>
</PAMDataset>
)";

class AuxiliaryMetadata : public ::testing::Test {
 protected:
  AuxiliaryMetadata() {
    info_.path = folder_ / "a.png";
    info_.sample_type = SampleType::kInt16;
  }
  void beside(const std::string& text) { write_file(info_.path + ".aux.xml", text); }
  Error error_with(const std::string& text) {
    beside(text);
    return error_of([&] { read_sidecars(info_, 1); });
  }

  TemporaryFolder folder_;
  SourceInfo info_;
};

TEST_F(AuxiliaryMetadata, IsNoneWithoutTheFile) {
  read_sidecars(info_, 1);
  EXPECT_FALSE(info_.georeference.has_origin);
  EXPECT_TRUE(info_.void_values.empty());
}

TEST_F(AuxiliaryMetadata, PlacesTheMiddleOfTheFirstPixel) {
  beside(kAll);
  read_sidecars(info_, 0);
  const Georeference& place = info_.georeference;
  EXPECT_THAT(grid_of(place), ElementsAre(10.25, 49.875, 0.5, 0.25));
  EXPECT_EQ(place.registration, Registration::kPoint);
  EXPECT_EQ(place.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(place.system.epsg, 4326);
  EXPECT_TRUE(info_.void_values.empty()) << "of no band";
}

TEST_F(AuxiliaryMetadata, SaysWhatABandsNumbersMean) {
  beside(kAll);
  read_sidecars(info_, 2);
  EXPECT_EQ(info_.void_values, std::vector<double>{-32768.0});
  EXPECT_EQ(info_.z_scale, 0.1);
  EXPECT_EQ(info_.z_offset, 100.0);
  EXPECT_EQ(info_.vertical_unit, "foot");
  EXPECT_TRUE(info_.warnings.empty());
}

TEST_F(AuxiliaryMetadata, LeavesWhatTheRasterSaysItself) {
  beside(kAll);
  info_.void_values = {5.0};
  info_.z_scale = 2.0;
  info_.vertical_unit = "metre";
  info_.georeference.has_origin = true;
  info_.georeference.origin_x = 3.0;
  info_.georeference.unit = HorizontalUnit::kMetre;
  info_.georeference.registration = Registration::kArea;
  read_sidecars(info_, 2);
  EXPECT_EQ(info_.void_values, std::vector<double>{5.0});
  EXPECT_EQ(info_.z_scale, 2.0);
  EXPECT_EQ(info_.z_offset, 0.0);
  EXPECT_EQ(info_.vertical_unit, "metre");
  EXPECT_EQ(info_.georeference.origin_x, 3.0);
  EXPECT_EQ(info_.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(info_.georeference.registration, Registration::kArea);
  EXPECT_THAT(
      info_.warnings,
      ElementsAre(
          "a.png.aux.xml gives the void value -32768; followed is the raster itself, which gives 5 (`void_values` "
          "-32768 takes the other)",
          "a.png.aux.xml gives elevations as sample * 0.1 + 100; followed is the raster itself, which gives "
          "sample * 2 + 0",
          "a.png.aux.xml gives the unit foot; followed is the raster itself, which gives metre"));
}

TEST_F(AuxiliaryMetadata, SaysThatBytesHaveSigns) {
  beside(
      R"(<PAMDataset><PAMRasterBand band="1"><Metadata domain="IMAGE_STRUCTURE"><MDI key="PIXELTYPE">SIGNEDBYTE</MDI>)"
      R"(</Metadata><NoDataValue>-5</NoDataValue></PAMRasterBand></PAMDataset>)");
  info_.sample_type = SampleType::kUint8;
  read_sidecars(info_, 1);
  EXPECT_EQ(info_.sample_type, SampleType::kInt8);
  EXPECT_EQ(info_.void_values, std::vector<double>{-5.0});
  info_.sample_type = SampleType::kUint8;
  info_.void_values = {251.0};  // as the raster had it
  read_sidecars(info_, 1);
  EXPECT_EQ(info_.void_values, std::vector<double>{-5.0});
  EXPECT_TRUE(info_.warnings.empty());
}

TEST_F(AuxiliaryMetadata, WhatCannotBeUsedIsLost) {
  beside(R"(<PAMDataset><PAMRasterBand band="1"><NoDataValue>1e9</NoDataValue><Scale>0</Scale><Offset>much</Offset>)"
         R"(</PAMRasterBand></PAMDataset>)");
  read_sidecars(info_, 1);
  ASSERT_EQ(info_.warnings.size(), 3U);
  for (const Warning& warning : info_.warnings) EXPECT_EQ(warning.kind, Warning::Kind::kLoss) << warning;
  EXPECT_EQ(info_.z_scale, 1.0);
}

TEST_F(AuxiliaryMetadata, NamesTheBandsThatHaveNoName) {
  beside(kAll);
  std::vector<std::string> names = {"", "", "own"};
  name_bands_beside(info_.path, 3, names);
  EXPECT_THAT(names, ElementsAre("", "a <b>", "own"));
}

TEST_F(AuxiliaryMetadata, SaysWhatIsWrongInOneLine) {
  const std::string path = info_.path + ".aux.xml";
  EXPECT_EQ(error_with("<PAMDataset>\n<SRS>x</PAMDataset>").what(),
            path + ": byte 21: Start-end tags mismatch; remove the file or have GDAL write it anew");
  EXPECT_THAT(error_with("").what(), HasSubstr("No document element found"));
  Error error = error_with("<PAMDataset><GeoTransform>1, 2, 0, 4, 0</GeoTransform></PAMDataset>");
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_EQ(error.what(), path + ": GeoTransform is \"1, 2, 0, 4, 0\", must be six numbers");
  for (const char* turned : {"1, 2, 0.1, 4, 0, -2", "1, 2, 0, 4, 0.1, -2", "1, -2, 0, 4, 0, -2", "1, 2, 0, 4, 0, 2"}) {
    error = error_with(std::string("<PAMDataset><GeoTransform>") + turned + "</GeoTransform></PAMDataset>");
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported) << turned;
    EXPECT_THAT(error.what(), HasSubstr("gdalwarp turns it")) << turned;
  }
}

TEST_F(AuxiliaryMetadata, EveryTruncationIsAnError) {
  const std::string all = kAll;
  for (std::size_t length = 0; length + 2 < all.size(); ++length) {
    EXPECT_EQ(error_with(all.substr(0, length)).code(), ErrorCode::kCorrupt) << length;
  }
}

}  // namespace
}  // namespace isohf::test
