#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/netcdf/netcdf_bytes.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class Envi : public ReaderTest {
 protected:
  /// Two bands of 2 x 2 samples, 1, 3, 5, 7 and 2, 4, 6, 8; `more` stands in the header.
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& more, const std::string& channel = {}) const {
    write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
    return open_as("samples = 2\nlines = 2\nbands = 2\ndata type = 2\ninterleave = bip\nbyte order = 0\n" + more,
                   channel);
  }
  [[nodiscard]] std::unique_ptr<HeightSource> open_as(const std::string& header,
                                                      const std::string& channel = {}) const {
    write("a.hdr", "ENVI\n" + header);
    return open_raster(folder / "a.dat", of_channel(channel));
  }
  [[nodiscard]] SourceInfo on_map(const std::string& map_info) const {
    return open("map info = {" + map_info + "}\n")->info();
  }
  [[nodiscard]] std::string failure(const std::string& more, const std::string& channel = {}) const {
    return failure_of(folder.path(), nullptr, [&] { read_corner(*open(more, channel)); });
  }
};

TEST_F(Envi, SystemsThatMapInfoNamesAreTakenOrTold) {
  for (const auto& [map, epsg] :
       {std::pair("UTM, 1, 1, 500000, 4900000, 30, 30, 12, North, WGS-84", 32612),
        {"UTM, 1, 1, 500000, 4900000, 30, 30, 12, South, WGS-84, units=Meters", 32712},
        {"UTM, 1, 1, 500000, 4900000, 30, 30, 12, North, North America 1927", 26712},
        {"Geographic Lat/Lon, 1, 1, -110, 40, 0.1, 0.1, North America 1983, units=Degrees", 4269},
        {"Geographic Lat/Lon, 1, 1, -110, 40, 0.1, 0.1, WGS-84", 4326}}) {
    EXPECT_EQ(on_map(map).georeference.system.epsg, epsg) << map;
    EXPECT_EQ(on_map(map).georeference.unit, epsg < 5000 ? HorizontalUnit::kDegree : HorizontalUnit::kMetre) << map;
  }
  const auto left_out = Contains(HasSubstr("the reference system is left out"));
  const SourceInfo feet = on_map("State Plane (NAD 83), 1, 1, 600000, 400000, 10, 10, 3104, units=Feet");
  EXPECT_THAT(feet.warnings, left_out);
  EXPECT_EQ(feet.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_DOUBLE_EQ(feet.georeference.metres_per_unit, 1200.0 / 3937.0);  // US survey feet
  EXPECT_THAT(on_map("UTM, 1, 1, 500000, 4900000, 30, 30, 32, North, European 1950").warnings, left_out);
  EXPECT_THAT(on_map("Arbitrary, 1, 1, 0, 0, 1, 1").warnings, Not(left_out));
  EXPECT_THAT(failure("map info = {Geographic Lat/Lon, 1, 1, 6, 40, 10, 10, WGS-84, units=Seconds}\n"),
              HasSubstr("its coordinates are in seconds"));
  const std::string map = "map info = {UTM, 1, 1, 500000, 4900000, 30, 30, 12, North, WGS-84}\n";
  EXPECT_EQ(
      open(map + "coordinate system string = {+proj=utm +zone=33 +datum=WGS84}\n")->info().georeference.system.name,
      "unknown");
  EXPECT_THAT(open(map + "coordinate system string = {LOCAL_CS[\"a yard\"]}\n")->info().warnings, left_out);
}

TEST_F(Envi, RowsFromTheSouthAreTurned) {
  for (const char* way : {"10, -20, 32, North, WGS-84", "10, 20, 32, North, WGS-84, rotation=180"}) {
    const auto source = open(std::string("map info = {UTM, 1, 1, 500000, 4000000, ") + way + "}\n");
    EXPECT_THAT(values_of(*source), ElementsAre(5, 7, 1, 3)) << way;
    // 4000000 is the southern edge, as GDAL reads both.
    EXPECT_THAT(grid_of(source->info().georeference), ElementsAre(500005.0, 4000030.0, 10.0, 20.0)) << way;
  }
  EXPECT_THAT(failure("map info = {UTM, 1, 1, 500000, 4000000, 10, 20, 32, North, WGS-84, rotation=30}\n"),
              HasSubstr("the map is rotated"));
}

TEST_F(Envi, GainsAndOffsetsAreTheBandsOwn) {
  const std::string header =
      "data gain values = {1, 0.5}\ndata offset values = {0, 100}\nband names = {height, slope}\n";
  for (const char* channel : {"slope", "1"}) {
    const auto second = open(header, channel);
    EXPECT_THAT(values_of(*second), ElementsAre(2, 4, 6, 8));
    EXPECT_EQ(second->info().z_scale, 0.5);
    EXPECT_EQ(second->info().z_offset, 100.0);
    EXPECT_EQ(second->info().channel, "slope");
  }
  EXPECT_THAT(open(header)->info().warnings, ElementsAre("there are 2 bands; channel height is read"));
  EXPECT_THAT(failure(header, "aspect"), HasSubstr("are 0 to 1: height, slope"));
  EXPECT_THAT(failure("data gain values = {0, 1}\n"), HasSubstr("data gain values gives a scale of 0"));
}

TEST_F(Envi, TheBandWhoseNameSaysElevationsIsRead) {
  const std::string names = "band names = {slope, Elevation (m)}\n";
  EXPECT_THAT(values_of(*open(names)), ElementsAre(2, 4, 6, 8));
  EXPECT_EQ(open(names)->info().channel, "Elevation (m)");
  EXPECT_THAT(values_of(*open(names, "0")), ElementsAre(1, 3, 5, 7));
  EXPECT_THAT(values_of(*open("")), ElementsAre(1, 3, 5, 7));
  write("a.dat.aux.xml",
        R"(<PAMDataset><PAMRasterBand band="2"><Description>z</Description></PAMRasterBand></PAMDataset>)");
  EXPECT_THAT(values_of(*open("")), ElementsAre(2, 4, 6, 8));
  // A virtual raster names its band by a number.
  write("a.vrt",
        R"(<VRTDataset rasterXSize="2" rasterYSize="2"><VRTRasterBand dataType="Int16" band="1"><SimpleSource>)"
        R"(<SourceFilename relativeToVRT="1">a.dat</SourceFilename><SourceBand>1</SourceBand></SimpleSource>)"
        R"(</VRTRasterBand></VRTDataset>)");
  EXPECT_THAT(values_of(*open_raster(folder / "a.vrt", {})), ElementsAre(1, 3, 5, 7));
}

TEST_F(Envi, BytesHaveSignsWhereGdalsFileSaysSo) {
  write("a.dat", std::string("\xFF\x01\xFB\x80", 4));
  write(
      "a.dat.aux.xml",
      R"(<PAMDataset><PAMRasterBand band="1"><Metadata domain="IMAGE_STRUCTURE"><MDI key="PIXELTYPE">SIGNEDBYTE</MDI>)"
      R"(</Metadata></PAMRasterBand></PAMDataset>)");
  const auto source = open_as("samples = 2\nlines = 2\ndata type = 1\ndata ignore value = -5\n");
  EXPECT_THAT(values_of(*source), ElementsAre(-1, 1, -5, -128));
  EXPECT_THAT(source->info().void_values, ElementsAre(-5));
}

TEST_F(Envi, WholeNumbersOf64BitsAreFloat64) {
  const std::string header = "samples = 2\nlines = 2\ndata type = 14\nbyte order = 1\n";
  write("a.dat", big_endian<std::int64_t>({1, -2, 1LL << 50, 4}));
  EXPECT_THAT(values_of(*open_as(header)), ElementsAre(1, -2, 0x1p50, 4));
  write("a.dat", big_endian<std::int64_t>({1, -2, (1LL << 60) + 1, 4}));
  EXPECT_THAT(failure_of(folder.path(), nullptr, [&] { read_corner(*open_as(header)); }),
              HasSubstr("sample (0, 1) is 1152921504606846977, which float64 does not hold"));
}

}  // namespace
}  // namespace isohf::test
