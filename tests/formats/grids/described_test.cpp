/// Plain samples that a header or label describes: ENVI, netCDF in its classic formats, PDS4, GDAL's virtual rasters.
/// What GDAL writes in these formats is tests/cli/gdal/gdal_variants_test.cpp.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "formats/grids/netcdf_bytes.h"
#include "formats/planetary/pds4_label.h"
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

/// The text of a virtual raster: what stands in its one band, and before it.
std::string vrt_of(const std::string& size, const std::string& type, const std::string& band,
                   const std::string& before = {}) {
  const auto x = size.find('x');
  return fmt::format(R"(<VRTDataset rasterXSize="{}" rasterYSize="{}">{}<VRTRasterBand dataType="{}" band="1">{})"
                     R"(</VRTRasterBand></VRTDataset>)",
                     size.substr(0, x), size.substr(x + 1), before, type, band);
}

/// A source in one; `more` behind the number of its band.
std::string vrt_source(const std::string& file, const std::string& more = {}, const char* kind = "SimpleSource") {
  return fmt::format(
      R"(<{0}><SourceFilename relativeToVRT="1">{1}</SourceFilename><SourceBand>1</SourceBand>{2}</{0}>)", kind, file,
      more);
}

class Described : public ReaderTest {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& name, const std::string& channel = {}) const {
    return open_raster(folder / name, of_channel(channel));
  }
  [[nodiscard]] std::string failure(const std::string& name, ErrorCode* code = nullptr) const {
    return failure_of(folder.path(), code, [&] { read_corner(*open(name)); });
  }

  /// Opens the file with a variable z of shorts over both dimensions.
  [[nodiscard]] std::unique_ptr<HeightSource> open_z(NetcdfBytes& file, const std::string& shorts,
                                                     const NetcdfBytes::Texts& texts = {},
                                                     const NetcdfBytes::Numbers& numbers = {}) const {
    write("a.nc", file.variable("z", {0, 1}, 3, shorts, texts, numbers).bytes());
    return open("a.nc");
  }
};

using Envi = Described;

std::string envi(const std::string& more) {
  return "ENVI\nsamples = 2\nlines = 2\nbands = 2\ndata type = 2\ninterleave = bip\nbyte order = 0\n" + more;
}

TEST_F(Envi, FeetOfMapInfoAreUsSurveyFeet) {
  write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
  write("a.hdr", envi("map info = {State Plane (NAD 83), 1, 1, 600000, 400000, 10, 10, 3104, units=Feet}\n"));
  const Georeference place = open("a.dat")->info().georeference;
  EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
  EXPECT_DOUBLE_EQ(place.metres_per_unit, 1200.0 / 3937.0);
  write("a.hdr", envi("map info = {Geographic Lat/Lon, 1, 1, 6, 40, 10, 10, WGS-84, units=Seconds}\n"));
  EXPECT_THAT(failure("a.dat"), HasSubstr("its coordinates are in seconds"));
}

TEST_F(Envi, SystemsThatMapInfoNamesAreTakenOrTold) {
  write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
  set_module_folder(ISOHF_BIN_DIR);
  write("a.hdr", envi("map info = {UTM, 1, 1, 500000, 4900000, 30, 30, 12, North, North America 1927}\n"));
  EXPECT_EQ(open("a.dat")->info().georeference.system.epsg, 26712);
  write("a.hdr",
        envi("map info = {Geographic Lat/Lon, 1, 1, -110, 40, 0.1, 0.1, North America 1983, units=Degrees}\n"));
  EXPECT_EQ(open("a.dat")->info().georeference.system.epsg, 4269);
  write("a.hdr", envi("map info = {State Plane (NAD 83), 1, 1, 600000, 400000, 10, 10, 3104, units=Feet}\n"));
  EXPECT_THAT(open("a.dat")->info().warnings, testing::Contains(HasSubstr("the reference system is left out")));
  write("a.hdr", envi("map info = {Arbitrary, 1, 1, 0, 0, 1, 1}\n"));
  EXPECT_THAT(open("a.dat")->info().warnings, testing::Not(testing::Contains(HasSubstr("left out"))));
}

TEST_F(Envi, RowsFromTheSouthAreTurned) {
  write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
  for (const char* way : {"10, -20, 32, North, WGS-84", "10, 20, 32, North, WGS-84, rotation=180"}) {
    write("a.hdr", envi(std::string("map info = {UTM, 1, 1, 500000, 4000000, ") + way + "}\n"));
    const auto source = open("a.dat");
    EXPECT_THAT(values_of(*source), ElementsAre(5, 7, 1, 3)) << way;
    const Georeference& place = source->info().georeference;
    EXPECT_EQ(place.spacing_y, 20.0);
    EXPECT_EQ(place.origin_x, 500005.0);
    EXPECT_EQ(place.origin_y, 4000030.0) << way;  // 4000000 is the southern edge, as GDAL reads both
  }
  write("a.hdr", envi("map info = {UTM, 1, 1, 500000, 4000000, 10, 20, 32, North, WGS-84, rotation=30}\n"));
  EXPECT_THAT(failure("a.dat"), HasSubstr("the map is rotated"));
}

TEST_F(Envi, GainsAndOffsetsAreTheBandsOwn) {
  write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
  write("a.hdr", envi("data gain values = {1, 0.5}\ndata offset values = {0, 100}\nband names = {height, slope}\n"));
  const auto second = open("a.dat", "slope");
  EXPECT_THAT(values_of(*second), ElementsAre(2, 4, 6, 8));
  EXPECT_EQ(second->info().z_scale, 0.5);
  EXPECT_EQ(second->info().z_offset, 100.0);
  EXPECT_EQ(second->info().channel, "slope");
  EXPECT_EQ(open("a.dat", "1")->info().z_scale, 0.5);
  EXPECT_THAT(open("a.dat")->info().warnings.front(), HasSubstr("channel height is read"));
  EXPECT_THAT(failure_of(folder.path(), nullptr, [&] { (void)open("a.dat", "aspect"); }),
              HasSubstr("are 0 to 1: height, slope"));
  write("a.hdr", envi("data gain values = {0, 1}\n"));
  EXPECT_THAT(failure("a.dat"), HasSubstr("data gain values gives a scale of 0"));
}

TEST_F(Envi, BytesHaveSignsWhereGdalsFileSaysSo) {
  write("a.dat", std::string("\xFF\x01\xFB\x80", 4));
  write("a.hdr", "ENVI\nsamples = 2\nlines = 2\ndata type = 1\ndata ignore value = -5\n");
  write(
      "a.dat.aux.xml",
      R"(<PAMDataset><PAMRasterBand band="1"><Metadata domain="IMAGE_STRUCTURE"><MDI key="PIXELTYPE">SIGNEDBYTE</MDI>)"
      R"(</Metadata></PAMRasterBand></PAMDataset>)");
  const auto source = open("a.dat");
  EXPECT_THAT(values_of(*source), ElementsAre(-1, 1, -5, -128));
  EXPECT_THAT(source->info().void_values, ElementsAre(-5));
}

TEST_F(Envi, TheBandWhoseNameSaysElevationsIsRead) {
  write("a.dat", stored_bytes<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8}));
  write("a.hdr", envi("band names = {slope, Elevation (m)}\n"));
  EXPECT_THAT(values_of(*open("a.dat")), ElementsAre(2, 4, 6, 8));
  EXPECT_EQ(open("a.dat")->info().channel, "Elevation (m)");
  EXPECT_THAT(open("a.dat")->info().warnings, ElementsAre("there are 2 bands; channel Elevation (m) is read"));
  EXPECT_THAT(values_of(*open("a.dat", "0")), ElementsAre(1, 3, 5, 7));
  write("a.hdr", envi(""));
  EXPECT_THAT(values_of(*open("a.dat")), ElementsAre(1, 3, 5, 7));
  write("a.dat.aux.xml",
        R"(<PAMDataset><PAMRasterBand band="2"><Description>z</Description></PAMRasterBand></PAMDataset>)");
  EXPECT_THAT(values_of(*open("a.dat")), ElementsAre(2, 4, 6, 8));
  // A virtual raster names its band by a number.
  write("a.vrt", vrt_of("2x2", "Int16", vrt_source("a.dat")));
  EXPECT_THAT(values_of(*open("a.vrt")), ElementsAre(1, 3, 5, 7));
}

TEST_F(Envi, WholeNumbersOf64BitsAreFloat64) {
  write("a.dat", big_endian<std::int64_t>({1, -2, 1LL << 50, 4}));
  write("a.hdr", "ENVI\nsamples = 2\nlines = 2\ndata type = 14\nbyte order = 1\n");
  EXPECT_THAT(values_of(*open("a.dat")), ElementsAre(1, -2, 0x1p50, 4));
  write("a.dat", big_endian<std::int64_t>({1, -2, (1LL << 60) + 1, 4}));
  EXPECT_THAT(failure("a.dat"), HasSubstr("sample (0, 1) is 1152921504606846977, which float64 does not hold"));
}

using Netcdf = Described;

TEST_F(Netcdf, LongitudesMayComeBeforeLatitudes) {
  NetcdfBytes file;
  file.dimension("lon", 3).dimension("lat", 2);
  file.variable("lon", {0}, 6, big_endian<double>({10.0, 10.5, 11.0}), {{"units", "degrees_east"}});
  file.variable("lat", {1}, 6, big_endian<double>({40.0, 40.5}), {{"units", "degrees_north"}});
  const auto source = open_z(file, big_endian<std::int16_t>({1, 2, 3, 4, 5, 6}));
  ASSERT_EQ(source->info().width, 3);
  ASSERT_EQ(source->info().height, 2);
  EXPECT_THAT(values_of(*source), ElementsAre(2, 4, 6, 1, 3, 5));  // the South comes first
  const Georeference& place = source->info().georeference;
  EXPECT_THAT(origin_of(place), ElementsAre(10.0, 40.5));
  EXPECT_THAT(values_of(source->info().sample_type, read_window(*source, {1, 1, 2, 1})), ElementsAre(3, 5));
}

TEST_F(Netcdf, GmtGridsFromBeforeCfAreRefusedWithTheCommandThatConvertsThem) {
  NetcdfBytes file;
  file.dimension("side", 2).dimension("xysize", 6);
  file.variable("x_range", {0}, 6, big_endian<double>({0.0, 2.0}), {});
  file.variable("dimension", {0}, 4, big_endian<std::int32_t>({3, 2}), {});
  write("a.grd", file.variable("z", {1}, 5, std::string(24, '\1'), {}).bytes());
  EXPECT_THAT(failure("a.grd"), HasSubstr("a GMT grid from before CF; gmt grdconvert " + folder / "a.grd" + " OUT.nc"));
}

TEST_F(Netcdf, CoordinatesOfFloat32MayBeRounded) {
  const auto grid = [](double step, double jitter) {
    std::vector<float> longitudes;
    for (int i = 0; i < 5; ++i) longitudes.push_back(static_cast<float>(179.0 + step * i + (i == 2 ? jitter : 0.0)));
    NetcdfBytes file;
    file.dimension("lat", 2).dimension("lon", 5);
    file.variable("lon", {1}, 5, big_endian<float>(longitudes), {{"units", "degrees_east"}});
    file.variable("lat", {0}, 6, big_endian<double>({1.0, 1.0 - step}), {{"units", "degrees_north"}});
    file.variable("z", {0, 1}, 3, std::string(20, '\1'), {});
    return file.bytes();
  };
  constexpr double kSecond = 1.0 / 3600.0;
  write("a.nc", grid(kSecond, 0.0));
  EXPECT_TRUE(open("a.nc")->info().georeference.has_origin);
  EXPECT_NEAR(open("a.nc")->info().georeference.spacing_x, kSecond, 0.02 * kSecond);
  write("a.nc", grid(kSecond, 0.3 * kSecond));
  EXPECT_FALSE(open("a.nc")->info().georeference.has_origin);
  write("a.nc", grid(0.5, 0.02));  // of which float32 rounds none
  EXPECT_FALSE(open("a.nc")->info().georeference.has_origin);
}

/// Whole degrees in int16 unless said otherwise; the raster's own attributes after them.
NetcdfBytes netcdf_grid(const std::vector<double>& longitudes, const std::vector<double>& latitudes) {
  NetcdfBytes file;
  file.dimension("lat", static_cast<std::uint32_t>(latitudes.size()));
  file.dimension("lon", static_cast<std::uint32_t>(longitudes.size()));
  file.variable("lon", {1}, 6, big_endian<double>(longitudes), {{"units", "degrees_east"}});
  file.variable("lat", {0}, 6, big_endian<double>(latitudes), {{"units", "degrees_north"}});
  return file;
}

TEST_F(Netcdf, LongitudesMayGoOnAtMinus180) {
  NetcdfBytes file = netcdf_grid({179.0, 180.0, -179.0}, {1.0, 0.0});
  const Georeference place = open_z(file, std::string(12, '\1'))->info().georeference;
  EXPECT_EQ(place.origin_x, 179.0);
  EXPECT_EQ(place.spacing_x, 1.0);
}

TEST_F(Netcdf, UnevenRowsFromTheSouthAreTurnedToo) {
  NetcdfBytes file = netcdf_grid({1.0, 2.0}, {0.0, 1.0, 2.5});
  const auto source = open_z(file, big_endian<std::int16_t>({1, 2, 3, 4, 5, 6}));
  EXPECT_THAT(values_of(*source), ElementsAre(5, 6, 3, 4, 1, 2));
  EXPECT_FALSE(source->info().georeference.has_origin);
}

TEST_F(Netcdf, WithoutCoordinatesTheFirstRowIsTheSouthernmost) {
  const std::string samples = big_endian<std::int16_t>({1, 2, 3, 4, 5, 6});
  for (const bool has_columns : {false, true}) {
    NetcdfBytes file;
    file.dimension("y", 3).dimension("x", 2);
    if (has_columns) file.variable("x", {1}, 6, big_endian<double>({1.0, 2.0}), {});
    const auto source = open_z(file, samples);
    EXPECT_THAT(values_of(*source), ElementsAre(5, 6, 3, 4, 1, 2));
    ASSERT_EQ(source->info().warnings.size(), 1U);
    EXPECT_THAT(source->info().warnings.front(), HasSubstr("the first is taken for the southernmost, as GDAL and GMT"));
  }
  NetcdfBytes file;  // rows that say where they lie are followed
  file.dimension("y", 3).dimension("x", 2).variable("y", {0}, 6, big_endian<double>({3.0, 2.0, 1.0}), {});
  EXPECT_THAT(values_of(*open_z(file, samples)), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(Netcdf, LatitudesBeyondAPoleAreTold) {
  for (const double north : {90.0, 90.5}) {
    NetcdfBytes file = netcdf_grid({1.0, 2.0}, {north, north - 1.0});
    const auto source = open_z(file, big_endian<std::int16_t>({1, 2, 3, 4}));
    const auto& warnings = source->info().warnings;
    ASSERT_EQ(warnings.size(), north > 90.0 ? 1U : 0U);
    if (!warnings.empty()) {
      EXPECT_THAT(warnings.front(), HasSubstr("its rows lie at latitudes from 89.5 to 90.5"));
    }
  }
}

TEST_F(Netcdf, CoordinatesMayBePacked) {
  NetcdfBytes file;
  file.dimension("lat", 2).dimension("lon", 3);
  file.variable("lon", {1}, 3, big_endian<std::int16_t>({0, 5, 10}), {{"units", "degrees_east"}},
                {{"scale_factor", {0.1}}, {"add_offset", {10.0}}});
  file.variable("lat", {0}, 6, big_endian<double>({50.5, 50.0}), {{"units", "degrees_north"}});
  const auto source = open_z(file, std::string(12, '\1'));
  EXPECT_EQ(source->info().georeference.origin_x, 10.0);
  EXPECT_NEAR(source->info().georeference.spacing_x, 0.5, 1e-12);
}

TEST_F(Netcdf, EveryMissingValueIsAVoidAlsoOfUnsignedSamples) {
  NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
  const std::string samples = big_endian<std::int16_t>({1, -1, -9, 4});
  const auto source = open_z(file, samples, {{"_Unsigned", "true"}}, {{"missing_value", {-1.0, -9.0}}});
  EXPECT_EQ(source->info().sample_type, SampleType::kUint16);
  EXPECT_THAT(source->info().void_values, ElementsAre(65535, 65527));
}

TEST_F(Netcdf, ValuesOutsideTheValidRangeAreVoid) {
  const std::string samples = big_endian<std::int16_t>({1, 1500, -9, 40});
  for (const auto& [key, list] : std::vector<std::pair<std::string, std::vector<double>>>{
           {"valid_range", {0.0, 100.0}}, {"valid_min", {0.0}}, {"valid_max", {100.0}}}) {
    NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
    const auto source = open_z(file, samples, {}, {{key, list}});
    EXPECT_EQ(is_void(source->info(), 1500.0), key != "valid_min") << key;
    EXPECT_EQ(is_void(source->info(), -9.0), key != "valid_max") << key;
    EXPECT_FALSE(is_void(source->info(), 40.0)) << key;
  }
  NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
  EXPECT_EQ(open_z(file, big_endian<std::int16_t>({1, -5536, -9, 4}), {{"_Unsigned", "true"}},
                   {{"valid_range", {1.0, -5536.0}}})
                ->info()
                .valid_max,
            60000.0);
}

TEST_F(Netcdf, DepthsAreNegativeElevations) {
  for (const auto& [key, value] : {std::pair("positive", "down"), {"standard_name", "sea_floor_depth_below_geoid"}}) {
    NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
    const std::string samples = big_endian<std::int16_t>({1, 2, 3, 4});
    const auto source =
        open_z(file, samples, {{key, value}, {"units", "m"}}, {{"scale_factor", {0.5}}, {"add_offset", {10.0}}});
    EXPECT_EQ(source->info().z_scale, -0.5) << key;
    EXPECT_EQ(source->info().z_offset, -10.0) << key;
    EXPECT_THAT(source->info().warnings, ElementsAre(HasSubstr("depths, positive down")));
  }
}

TEST_F(Netcdf, DepthsWithoutAnOffsetHaveNone) {
  NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
  EXPECT_FALSE(std::signbit(open_z(file, std::string(8, '\1'), {{"positive", "down"}})->info().z_offset));
}

TEST_F(Netcdf, UnitsOfCoordinatesAreReadOrTold) {
  const auto with = [&](const std::string& axis, const std::string& unit) {
    NetcdfBytes file;
    file.dimension("y", 2).dimension(axis, 2);
    file.variable(axis, {1}, 6, big_endian<double>({0.25, 0.5}), {{"units", unit}});
    file.variable("y", {0}, 6, big_endian<double>({0.75, 0.5}), {{"units", unit}});
    return open_z(file, std::string(8, '\1'));
  };
  const auto feet = with("x", "US_survey_foot");
  EXPECT_EQ(feet->info().georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(feet->info().georeference.metres_per_unit, 1200.0 / 3937.0);
  EXPECT_THAT(feet->info().warnings, ElementsAre(HasSubstr("its coordinates are in feet")));
  const auto furlongs = with("x", "furlong");
  ASSERT_EQ(furlongs->info().warnings.size(), 1U);
  EXPECT_EQ(furlongs->info().warnings[0].kind, Warning::Kind::kLoss);
  EXPECT_THAT(furlongs->info().warnings[0], HasSubstr("\"furlong\", which is no unit that isohf knows"));
  set_module_folder(ISOHF_BIN_DIR);
  OpenOptions options;
  options.reference_system = "EPSG:2263";
  EXPECT_THAT(open_raster(folder / "a.nc", options)->info().warnings, ::testing::Not(Contains(HasSubstr("furlong"))));
  EXPECT_THAT(with("x", "radian")->info().warnings, ElementsAre(HasSubstr("\"radian\"")));  // of a view from space
  const auto radians = with("longitude", "radian");
  EXPECT_EQ(radians->info().georeference.unit, HorizontalUnit::kDegree);
  EXPECT_NEAR(radians->info().georeference.origin_x, 14.3239448782706, 1e-12);
  EXPECT_NEAR(radians->info().georeference.spacing_y, 14.3239448782706, 1e-12);
  EXPECT_THAT(radians->info().warnings, ElementsAre());
}

TEST_F(Netcdf, DegreesOfARotatedGridAreNone) {
  NetcdfBytes file = netcdf_grid({1.0, 2.0}, {1.0, 0.0});
  file.variable("rotated", {}, 3, "", {{"grid_mapping_name", "rotated_latitude_longitude"}});
  const auto source = open_z(file, std::string(8, '\1'), {{"grid_mapping", "rotated"}});
  EXPECT_EQ(source->info().georeference.unit, HorizontalUnit::kUnknown);
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("its degrees are those of a rotated grid (gdalwarp turns it)"));
}

#ifdef ISOHF_WITH_NETCDF
// GDAL's netCDF driver wrote these: CF conventions, deflated chunks of 4 x 3 samples.
class Netcdf4 : public ::testing::Test {
 protected:
  void SetUp() override { set_module_folder(ISOHF_BIN_DIR); }
  static std::string file(const char* name) { return std::string(ISOHF_SOURCE_DIR) + "/tests/formats/data/" + name; }
  /// Their 9 x 7 samples, which rise by 7 from -100 in the South-West corner, times `factor`; one is void.
  static std::vector<double> stored_from_south(double void_value, double factor) {
    std::vector<double> values;
    for (int row = 6; row >= 0; --row) {
      for (int column = 0; column < 9; ++column)
        values.push_back(row == 3 && column == 4 ? void_value : ((row * 9 + column) * 7 - 100) * factor);
    }
    return values;
  }
};

TEST_F(Netcdf4, RowsFromTheSouthAreTurned) {
  const auto source = open_raster(file("lat_lon.nc"), {});
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.width, 9);
  ASSERT_EQ(info.height, 7);
  EXPECT_EQ(info.sample_type, SampleType::kInt16);
  EXPECT_EQ(info.block_width, 4);
  EXPECT_EQ(info.block_height, 3);
  EXPECT_EQ(info.vertical_unit, "metre");
  EXPECT_THAT(info.void_values, ElementsAre(-32767));
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
  EXPECT_DOUBLE_EQ(info.georeference.origin_x, 6.0);
  EXPECT_DOUBLE_EQ(info.georeference.origin_y, 45.025);
  const std::vector<double> values = values_of(*source);
  EXPECT_EQ(values, stored_from_south(-32767, 1.0));
  for (const std::uint64_t limit : {std::uint64_t{0}, std::uint64_t{1000}}) {
    source->limit_buffers(limit);
    EXPECT_EQ(values_of(*source), values);
    EXPECT_THAT(values_of(info.sample_type, read_window(*source, {3, 2, 2, 2})),
                ElementsAre(values[21], values[22], values[30], values[31]));
  }
}

/// h5py's array of 3 x 4 without names of dimensions: GDAL reads it as netCDF, rows from the South, or as HDF5 by its name.
TEST_F(Netcdf4, RowsOfHdf5WithoutNamesBeginInTheSouthWhereTheFileIsCalledNetcdf) {
  const TemporaryFolder folder;
  const std::vector<double> rising = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  for (const auto& [name, first] : {std::pair("a.h5", 0.0), {"a.nc", 8.0}, {"b.NC4", 8.0}}) {
    const std::string path = folder / name;
    std::filesystem::copy_file(file("unnamed.h5"), path);
    const std::vector<double> values = values_of(*open_raster(path, {}));
    ASSERT_EQ(values.size(), rising.size());
    EXPECT_EQ(values.front(), first) << name;
    EXPECT_EQ(values[8], 8.0 - first) << name;
  }
}

TEST_F(Netcdf4, LongitudesMayComeBeforeLatitudes) {
  const auto source = open_raster(file("lon_lat.nc"), {});
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.width, 9);
  ASSERT_EQ(info.height, 7);
  EXPECT_EQ(info.z_scale, 2.0);
  EXPECT_EQ(info.z_offset, 10.0);
  EXPECT_EQ(info.vertical_unit, "foot");
  // float32 coordinates: a hundredth of a sample
  EXPECT_NEAR(info.georeference.origin_x, 6.0, 4e-5);
  EXPECT_NEAR(info.georeference.origin_y, 45.025, 4e-5);
  EXPECT_EQ(values_of(*source), stored_from_south(-16383.5, 0.5));
}
#endif

using Vrt = Described;

TEST_F(Vrt, NodataOf15DigitsIsTheFloatThatItMeans) {
  write("a.dat", stored_bytes<float>({1.0F, -3.4028234663852886e38F, 0.1F, 4.0F}));
  write("a.hdr", "ENVI\nsamples = 2\nlines = 2\ndata type = 4\n");
  const auto vrt = [&](const std::string& nodata) {
    const std::string source = vrt_source("a.dat", "<NODATA>" + nodata + "</NODATA>", "ComplexSource");
    write("a.vrt", vrt_of("2x2", "Float32", "<NoDataValue>-9</NoDataValue>" + source));
    return values_of(*open("a.vrt"));
  };
  EXPECT_THAT(vrt("-3.40282346638529e+38"), ElementsAre(1.0, -9.0, 0.1F, 4.0));
  write("a.dat", stored_bytes<float>({1.0F, 2.0F, 0.1F, 4.0F}));
  EXPECT_THAT(vrt("0.100000001490116"), ElementsAre(1.0, 2.0, -9.0, 4.0));
  EXPECT_THAT(vrt("0.11"), ElementsAre(1.0, 2.0, 0.1F, 4.0));
}

TEST_F(Vrt, BytesHaveSignsWhereItOrTheSourceSaysSo) {
  write("a.npy", std::string("\x93NUMPY\1\0\x46\0", 10) +
                     "{'descr': '|i1', 'fortran_order': False, 'shape': (2, 2), }          \n" +
                     std::string("\xFF\x01\xFB\x80", 4));
  // The second is what gdalbuildvrt writes.
  for (const char* sign :
       {R"(<Metadata domain="IMAGE_STRUCTURE"><MDI key="PIXELTYPE">SIGNEDBYTE</MDI></Metadata>)", ""}) {
    const std::string source = vrt_source("a.npy", R"(<SourceProperties DataType="Byte"/>)");
    write("a.vrt", vrt_of("2x2", "Byte", std::string(sign) + "<NoDataValue>-5</NoDataValue>" + source));
    EXPECT_THAT(values_of(*open("a.vrt")), ElementsAre(-1, 1, -5, -128));
    EXPECT_THAT(open("a.vrt")->info().void_values, ElementsAre(-5));
    EXPECT_TRUE(open("a.vrt")->info().warnings.empty());
  }
}

TEST_F(Vrt, WhatGdalbuildvrtDoesNotWriteIsRefusedWithACommand) {
  write("a.dat", stored_bytes<float>({1.0F, 2.5F, 300.0F, 4.0F}));
  write("a.hdr", "ENVI\nsamples = 2\nlines = 2\ndata type = 4\n");
  const auto vrt = [&](const std::string& type, const std::string& more, const std::string& file = "a.dat") {
    write("a.vrt", vrt_of("2x2", type, vrt_source(file, more, "ComplexSource")));
    return failure("a.vrt");
  };
  const std::string command = "; gdal_translate " + folder / "a.vrt" + " OUT.tif makes a GeoTIFF of it";
  EXPECT_EQ(vrt("Float32", R"(<SourceProperties DataType="Float32"/>)"), "");
  EXPECT_THAT(vrt("Int16", R"(<SourceProperties DataType="Float32"/>)"), HasSubstr("a.dat are Float32" + command));
  EXPECT_THAT(vrt("Int16", ""), HasSubstr("a.dat is 2.5" + command));
  EXPECT_THAT(vrt("Byte", ""), HasSubstr("a.dat is 2.5" + command));
  EXPECT_THAT(vrt("Float32", "<ScaleRatio>2</ScaleRatio>"), HasSubstr("with ScaleRatio" + command));
  EXPECT_THAT(vrt("Float32", R"(<SrcRect xOff="1" yOff="0" xSize="2" ySize="2"/>)"), HasSubstr("takes a part of"));
  EXPECT_THAT(vrt("Float32", R"(<SrcRect xOff="0" yOff="0" xSize="1" ySize="2"/>)"), HasSubstr("resamples"));
  EXPECT_THAT(vrt("Float32", R"(<SrcRect xSize="1" ySize="2"/><DstRect xSize="1" ySize="2"/>)"),
              HasSubstr("takes 1 x 2 of the 2 x 2 samples of"));
  EXPECT_THAT(vrt("Float32", "", "a.vrt"), HasSubstr("a.vrt: is a virtual raster itself"));
  EXPECT_THAT(vrt("Byte", "", "a.vrt"), HasSubstr("a.vrt: is a virtual raster itself"));
}

TEST_F(Vrt, RowsFromTheSouthAreRefusedByTheirNumber) {
  write("a.vrt",
        vrt_of("2x2", "Byte", "",
               "<GeoTransform> 4.9000000000000000e+05, 3.0000000000e+01, 0.0, 5.0e+06, 0.0, 3.0e+01</GeoTransform>"));
  EXPECT_THAT(failure("a.vrt"), HasSubstr("a dy of 30 and"));
}

TEST_F(Vrt, MoreSourcesThanMayBeOpenLieOverEachOtherInTheirOrder) {
  constexpr int kFiles = 100;
  constexpr int kRows = 4;
  // Each covers the first column of the next, which is laid over it; every third begins two rows further down.
  std::string sources;
  std::array<std::array<double, 2 * kFiles + 1>, kRows> expected{};
  for (int i = 0; i < kFiles; ++i) {
    std::vector<std::int16_t> samples;
    const int top = i % 3 == 0 ? 2 : 0;
    for (int row = 0; row < kRows - top; ++row) {
      for (int column = 0; column < 3; ++column) {
        samples.push_back(static_cast<std::int16_t>(100 * i + 10 * row + column));
        expected.at(static_cast<std::size_t>(row + top)).at(static_cast<std::size_t>(2 * i + column)) = samples.back();
      }
    }
    write(fmt::format("{}.dat", i), stored_bytes<std::int16_t>(samples));
    write(fmt::format("{}.hdr", i), fmt::format("ENVI\nsamples = 3\nlines = {}\ndata type = 2\n", kRows - top));
    const std::string place =
        fmt::format(R"(<SourceProperties BlockYSize="{0}"/><SrcRect xOff="0" yOff="0" xSize="3" ySize="{1}"/>)"
                    R"(<DstRect xOff="{2}" yOff="{3}" xSize="3" ySize="{1}"/>)",
                    i % 2 + 1, kRows - top, 2 * i, top);
    sources += vrt_source(fmt::format("{}.dat", i), place);
  }
  write("a.vrt",
        vrt_of(fmt::format("{}x{}", 2 * kFiles + 1, kRows), "Int16", "<NoDataValue>0</NoDataValue>" + sources));
  const auto source = open("a.vrt");
  for (const Window& window : {Window{0, 0, 2 * kFiles + 1, kRows}, Window{0, 0, 2 * kFiles + 1, 1},
                               Window{0, 3, 2 * kFiles + 1, 1}, Window{0, 2, 2 * kFiles + 1, 1}, Window{7, 1, 131, 3},
                               Window{7, 1, 131, 1}, Window{7, 2, 131, 2}, Window{200, 0, 1, 4}}) {
    const std::vector<double> values = values_of(source->info().sample_type, read_window(*source, window));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t row = static_cast<std::size_t>(window.row) + i / static_cast<std::size_t>(window.columns);
      const std::size_t column = static_cast<std::size_t>(window.column) + i % static_cast<std::size_t>(window.columns);
      EXPECT_EQ(values[i], expected.at(row).at(column)) << row << ' ' << column;
    }
  }
}

TEST_F(Vrt, TakesWhatItMayKeepWhateverBlocksItClaims) {
  write("a.dat", stored_bytes<std::int16_t>({1}));
  write("a.hdr", "ENVI\nsamples = 1\nlines = 1\ndata type = 2\n");
  const std::string block = R"(<SourceProperties BlockYSize="100000"/>)";
  write("a.vrt", vrt_of("100000x100000", "Int16", vrt_source("a.dat", block)));
  const auto source = open("a.vrt");
  constexpr std::uint64_t kMebibyte = 1U << 20U;
  EXPECT_LE(source->buffer_bytes(kMebibyte), 18 * kMebibyte);  // a strip of 8 times the limit, twice
  EXPECT_LE(source->buffer_bytes(64 * kMebibyte), 193 * kMebibyte);
}

using Pds4 = Described;

TEST_F(Pds4, ReadsTheArrayThatTheLabelDescribes) {
  write("a.dat", "xy" + big_endian<std::int16_t>({1, 2, 3, -32768, 5, 6}));
  write("a.xml", pds4_label("a.dat"));
  for (const char* name : {"a.xml", "a.dat"}) {
    const auto source = open(name);
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "PDS4");
    EXPECT_THAT(values_of(*source), ElementsAre(1, 2, 3, -32768, 5, 6));
    EXPECT_THAT(info.void_values, ElementsAre(-32768));
    EXPECT_EQ(info.z_scale, 0.5);
    EXPECT_EQ(info.z_offset, 1000.0);
    EXPECT_EQ(info.vertical_unit, "metre");
    const Georeference& place = info.georeference;
    EXPECT_EQ(place.registration, Registration::kArea);
    EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
    EXPECT_EQ(place.spacing_x, 100.0);
    EXPECT_THAT(origin_of(place), ElementsAre(5050.0, 8950.0));
    EXPECT_EQ(place.system.body, "Mars");
    EXPECT_THAT(place.system.wkt, HasSubstr(R"(PARAMETER["standard_parallel_1",30])"));
    EXPECT_THAT(place.system.wkt, HasSubstr(R"(PARAMETER["central_meridian",-20])"));
  }
}

TEST_F(Pds4, AxesComeInAnyOrderAndRowsFromTheBottom) {
  write("a.dat", "xy" + big_endian<std::int16_t>({1, 10, 2, 20, 3, 30, 4, 40, 5, 50, 6, 60}));
  Pds4Options options;
  options.axes = {{"Line", 2}, {"Sample", 3}, {"Band", 2}};
  write("a.xml", pds4_label("a.dat", options));
  EXPECT_THAT(values_of(*open("a.xml", "1")), ElementsAre(10, 20, 30, 40, 50, 60));
  options.axes = {{"Line", 2}, {"Band", 2}, {"Sample", 3}};
  write("a.xml", pds4_label("a.dat", options));
  EXPECT_THAT(values_of(*open("a.xml")), ElementsAre(1, 10, 2, 4, 40, 5));
  options.axes = {{"Sample", 3}, {"Line", 2}, {"Band", 2}};
  write("a.xml", pds4_label("a.dat", options));
  EXPECT_THAT(values_of(*open("a.xml")), ElementsAre(1, 3, 5, 2, 4, 6));
  options.axes = {{"Band", 2}, {"Line", 2}, {"Sample", 3}};
  options.direction = "Bottom to Top";
  write("a.xml", pds4_label("a.dat", options));
  EXPECT_THAT(values_of(*open("a.xml", "1")), ElementsAre(50, 6, 60, 4, 40, 5));
}

TEST_F(Pds4, ConstantsMayBeBits) {
  write("a.dat", "xy" + stored_bytes<float>({1.0F, -3.4028226550889045e38F, 3.0F, 4.0F, 5.0F, 6.0F}));
  Pds4Options options;
  options.type = "IEEE754LSBSingle";
  for (const char* bits : {"16#FF7FFFFB#", "0xFF7FFFFB", "-3.4028226550889045e+38"}) {
    options.constants = fmt::format("<missing_constant>{}</missing_constant><valid_maximum>5</valid_maximum>", bits);
    write("a.xml", pds4_label("a.dat", options));
    const auto source = open("a.xml");
    const std::vector<double> values = values_of(*source);
    EXPECT_TRUE(is_void(source->info(), values[1])) << bits;
    EXPECT_FALSE(is_void(source->info(), values[4])) << bits;
    EXPECT_TRUE(is_void(source->info(), values[5])) << bits;
  }
}

TEST_F(Pds4, LabelsOfOtherThingsAreRefused) {
  write("a.dat", "xy");
  ErrorCode code{};
  write("a.xml", pds4_label("a.dat"));
  EXPECT_THAT(failure("a.xml", &code), HasSubstr("has 2 bytes, 3 x 2 samples"));
  EXPECT_EQ(code, ErrorCode::kCorrupt);
  write("a.xml", pds4_label("b.dat"));
  EXPECT_THAT(failure("a.xml"), HasSubstr("its samples, b.dat, are not beside it"));
  write("b.dat", std::string(20, 'x'));
  EXPECT_THAT(failure("a.dat"), HasSubstr("describes"));
  write("a.xml", "<?xml version=\"1.0\"?>\n<Product_Observational></Product_Observational>");
  EXPECT_THAT(failure("a.xml", &code), HasSubstr("describes no array"));
  EXPECT_EQ(code, ErrorCode::kUnsupported);
  std::string label = pds4_label("b.dat");
  label.replace(label.find("<scaling_factor>0.5"), 19, "<scaling_factor>abc");
  write("a.xml", label);
  EXPECT_THAT(failure("a.xml", &code), HasSubstr("scaling_factor is \"abc\", must be a number"));
  EXPECT_EQ(code, ErrorCode::kCorrupt);
  label = pds4_label("b.dat");
  label.insert(label.find("<Axis_Array>"), "<axis_index_order>First Index Fastest</axis_index_order>");
  write("a.xml", label);
  EXPECT_THAT(failure("a.xml"), HasSubstr("must be \"Last Index Fastest\""));
  Pds4Options options;
  options.type = "ComplexLSB8";
  write("a.xml", pds4_label("b.dat", options));
  EXPECT_THAT(failure("a.xml", &code), HasSubstr("data_type is \"ComplexLSB8\""));
}

}  // namespace
}  // namespace isohf::test
