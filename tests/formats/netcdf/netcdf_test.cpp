/// netCDF: classic files that are made here, and netCDF-4 files that GDAL wrote. Its other variants of both are
/// tests/cli/gdal/gdal_variants_test.cpp.

#include "formats/netcdf/netcdf_bytes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <sstream>
#include <thread>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The classic types, as the header numbers them.
enum Type : std::uint32_t { kByte = 1, kShort = 3, kFloat = 5, kDouble = 6 };

/// "units=m2 s-2; valid_range=0,100": values that are numbers throughout become these, all others texts.
struct Attributes {
  Attributes(const char* list) {  // NOLINT: rows of tables are written so
    std::istringstream in(list);
    for (std::string each; std::getline(in >> std::ws, each, ';');) {
      const std::string key = each.substr(0, each.find('='));
      const std::string value = each.substr(key.size() + 1);
      if (value.find_first_not_of("0123456789.,-") != std::string::npos || key == "units") {
        texts.emplace_back(key, value);
        continue;
      }
      numbers.push_back({key, {}});
      std::istringstream items(value);
      for (std::string item; std::getline(items, item, ',');) numbers.back().second.push_back(std::stod(item));
    }
  }
  NetcdfBytes::Texts texts;
  NetcdfBytes::Numbers numbers;
};

std::string shorts(const std::vector<std::int16_t>& values) {
  return big_endian(values);
}
std::string doubles(const std::vector<double>& values) {
  return big_endian(values);
}

/// Coordinates of doubles along "lat" and "lon".
NetcdfBytes grid(const std::vector<double>& latitudes, const std::vector<double>& longitudes,
                 const std::string& lat_unit = "degrees_north", const std::string& lon_unit = "degrees_east") {
  NetcdfBytes file;
  file.dimension("lat", static_cast<std::uint32_t>(latitudes.size()));
  file.dimension("lon", static_cast<std::uint32_t>(longitudes.size()));
  file.variable("lat", {0}, kDouble, doubles(latitudes), {{"units", lat_unit}});
  file.variable("lon", {1}, kDouble, doubles(longitudes), {{"units", lon_unit}});
  return file;
}

/// 2 x 2 samples at 1 and 2 degrees East, 1 and 0 North.
NetcdfBytes small_grid() {
  return grid({1.0, 0.0}, {1.0, 2.0});
}

class Netcdf : public ReaderTest {
 protected:
  Netcdf() { set_module_folder(ISOHF_BIN_DIR); }

  [[nodiscard]] std::unique_ptr<HeightSource> open(const NetcdfBytes& file, const std::string& channel = {}) const {
    return open_raster(write("a.nc", file.bytes()), of_channel(channel));
  }
  /// Opens the file with a variable z of shorts over both dimensions.
  [[nodiscard]] std::unique_ptr<HeightSource> open_z(NetcdfBytes file, const std::vector<std::int16_t>& samples,
                                                     const Attributes& of = "") const {
    return open(file.variable("z", {0, 1}, kShort, shorts(samples), of.texts, of.numbers));
  }
  [[nodiscard]] std::string failure(const NetcdfBytes& file, ErrorCode* code = nullptr) const {
    return failure_of(folder.path(), code, [&] { read_corner(*open(file)); });
  }
  static bool is_loss(const Warning& warning) { return warning.kind == Warning::Kind::kLoss; }
};

TEST_F(Netcdf, RowsAndColumnsAreTurnedToRunFromNorthWest) {
  struct Row {
    std::vector<double> latitudes, longitudes;
    std::string lat_unit, lon_unit;
    std::vector<double> origin;
    std::vector<double> samples;  ///< of 1 to 6 as stored
  };
  const std::vector<double> as_stored = {1, 2, 3, 4, 5, 6};
  const std::string east = "degrees_east";
  const std::string north = "degrees_north";
  for (const Row& row : {Row{{41, 40}, {10, 11, 12}, north, east, {10, 41}, as_stored},
                         {{40, 41}, {10, 11, 12}, "degree_N", "degrees_E", {10, 41}, {4, 5, 6, 1, 2, 3}},
                         {{41, 40}, {12, 11, 10}, "degreesN", "degree_east", {10, 41}, {3, 2, 1, 6, 5, 4}},
                         {{41, 40}, {5, 6, 7}, north, "degrees_west", {-7, 41}, {3, 2, 1, 6, 5, 4}},
                         {{41, 40}, {7, 6, 5}, north, "degree_W", {-7, 41}, as_stored},
                         {{40, 41}, {10, 11, 12}, "degrees_south", east, {10, -40}, as_stored},
                         {{41, 40}, {179, 180, -179}, north, east, {179, 41}, as_stored}}) {
    const auto source = open_z(grid(row.latitudes, row.longitudes, row.lat_unit, row.lon_unit), {1, 2, 3, 4, 5, 6});
    SCOPED_TRACE(row.lat_unit + ' ' + row.lon_unit);
    EXPECT_EQ(values_of(*source), row.samples);
    const Georeference& place = source->info().georeference;
    EXPECT_EQ(origin_of(place), row.origin);
    EXPECT_EQ(place.spacing_x, 1.0);
    EXPECT_EQ(place.system.epsg, 4326);
    EXPECT_THAT(source->info().warnings, IsEmpty());
    EXPECT_THAT(values_of(source->info().sample_type, read_window(*source, {1, 1, 2, 1})),
                ElementsAre(row.samples[4], row.samples[5]));
  }
}

TEST_F(Netcdf, LongitudesMayComeBeforeLatitudes) {
  for (const bool from_east : {false, true}) {
    NetcdfBytes file;
    file.dimension("lon", 3).dimension("lat", 2);
    file.variable("lon", {0}, kDouble, doubles({10.0, 10.5, 11.0}), {{"units", from_east ? "degrees_W" : "degrees_E"}});
    file.variable("lat", {1}, kDouble, doubles({40.0, 40.5}), {{"units", "degrees_north"}});
    const auto source = open_z(file, {1, 2, 3, 4, 5, 6});
    ASSERT_EQ(source->info().width, 3);
    ASSERT_EQ(source->info().height, 2);
    const std::vector<double> rows =
        from_east ? std::vector<double>{6, 4, 2, 5, 3, 1} : std::vector<double>{2, 4, 6, 1, 3, 5};
    EXPECT_EQ(values_of(*source), rows);  // the South comes first
    EXPECT_THAT(origin_of(source->info().georeference), ElementsAre(from_east ? -11.0 : 10.0, 40.5));
    EXPECT_THAT(values_of(source->info().sample_type, read_window(*source, {1, 1, 2, 1})),
                ElementsAre(rows[4], rows[5]));
  }
}

TEST_F(Netcdf, CoordinatesOfFloat32MayBeRounded) {
  constexpr double kSecond = 1.0 / 3600.0;
  for (const auto& [step, jitter, is_even] :
       {std::tuple{kSecond, 0.0, true}, {kSecond, 0.3 * kSecond, false}, {0.5, 0.02, false}}) {
    std::vector<float> longitudes;
    for (int i = 0; i < 5; ++i) longitudes.push_back(static_cast<float>(179.0 + step * i + (i == 2 ? jitter : 0.0)));
    NetcdfBytes file;
    file.dimension("lat", 2).dimension("lon", 5);
    file.variable("lon", {1}, kFloat, big_endian(longitudes), {{"units", "degrees_east"}});
    file.variable("lat", {0}, kDouble, doubles({1.0, 1.0 - step}), {{"units", "degrees_north"}});
    const auto source = open_z(file, std::vector<std::int16_t>(10, 1));
    EXPECT_EQ(source->info().georeference.has_origin, is_even);
    EXPECT_EQ(std::ranges::count_if(source->info().warnings, is_loss), is_even ? 0 : 1);
    if (is_even) {
      EXPECT_NEAR(source->info().georeference.spacing_x, kSecond, 0.02 * kSecond);
    }
  }
}

TEST_F(Netcdf, CoordinatesMayBePackedOrAtAnEdgeOfTheirCells) {
  NetcdfBytes file;
  file.dimension("rows", 2).dimension("lon", 3).dimension("ends", 2);
  file.variable("lon", {1}, kShort, shorts({0, 5, 10}), {{"units", "degrees_east"}, {"bounds", "lon_bnds"}},
                {{"scale_factor", {0.1}}, {"add_offset", {10.0}}});
  file.variable("lon_bnds", {1, 2}, kShort, shorts({0, 5, 5, 10, 10, 15}), {});
  file.variable("latitude", {0}, kDouble, doubles({50.5, 50.0}), {{"units", "degrees_north"}});  // under another name
  const auto source = open_z(file, {1, 2, 3, 4, 5, 6});
  EXPECT_DOUBLE_EQ(source->info().georeference.origin_x, 10.25);
  EXPECT_NEAR(source->info().georeference.spacing_x, 0.5, 1e-12);
  EXPECT_EQ(source->info().georeference.origin_y, 50.5);
  EXPECT_THAT(source->info().warnings, IsEmpty());
}

TEST_F(Netcdf, RowsWithoutCoordinatesBeginInTheSouth) {
  for (const bool has_columns : {false, true}) {
    NetcdfBytes file;
    file.dimension("y", 3).dimension("x", 2);
    if (has_columns) file.variable("x", {1}, kDouble, doubles({1.0, 2.0}), {});
    const auto source = open_z(file, {1, 2, 3, 4, 5, 6});
    EXPECT_THAT(values_of(*source), ElementsAre(5, 6, 3, 4, 1, 2));
    EXPECT_THAT(source->info().warnings, ElementsAre(HasSubstr("the first is taken for the southernmost, as GDAL")));
  }
  const auto uneven = open_z(grid({0.0, 1.0, 2.5}, {1.0, 2.0}), {1, 2, 3, 4, 5, 6});
  EXPECT_THAT(values_of(*uneven), ElementsAre(5, 6, 3, 4, 1, 2));
  EXPECT_FALSE(uneven->info().georeference.has_origin);
}

TEST_F(Netcdf, LatitudesBeyondAPoleAreTold) {
  EXPECT_THAT(open_z(grid({90.0, 89.0}, {1.0, 2.0}), {1, 2, 3, 4})->info().warnings, IsEmpty());
  EXPECT_THAT(open_z(grid({90.5, 89.5}, {1.0, 2.0}), {1, 2, 3, 4})->info().warnings,
              ElementsAre(HasSubstr("its rows lie at latitudes from 89.5 to 90.5")));
}

TEST_F(Netcdf, CurvedCoordinatesAreALoss) {
  NetcdfBytes file;
  file.dimension("eta", 2).dimension("xi", 2);
  file.variable("lat_rho", {0, 1}, kDouble, doubles({1, 1, 2, 2}), {{"units", "degree_north"}});
  file.variable("lon_rho", {0, 1}, kDouble, doubles({1, 2, 1, 2}), {{"standard_name", "longitude"}});
  const auto source = open_z(file, {1, 2, 3, 4}, "coordinates=lon_rho lat_rho; units=meter");
  EXPECT_THAT(values_of(*source), ElementsAre(3, 4, 1, 2));
  EXPECT_FALSE(source->info().georeference.has_origin);
  const auto& warnings = source->info().warnings;
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_TRUE(is_loss(warnings[1]));
  EXPECT_THAT(warnings[1], HasSubstr("curved coordinates (lat_rho, lon_rho): where it lies is left out"));
  EXPECT_THAT(values_of(*open(file, "lat_rho")), ElementsAre(2, 2, 1, 1));  // asked for
}

TEST_F(Netcdf, UnitsOfCoordinatesAreReadOrALoss) {
  const auto with = [&](const std::string& unit) {
    return open_z(grid({0.75, 0.5}, {0.25, 0.5}, unit, unit), {1, 2, 3, 4});
  };
  const auto feet = with("US_survey_foot");
  EXPECT_EQ(feet->info().georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(feet->info().georeference.metres_per_unit, 1200.0 / 3937.0);
  EXPECT_THAT(feet->info().warnings, ElementsAre(HasSubstr("its coordinates are in feet")));
  for (const char* unit : {"furlong", "radian"}) {  // the latter of a view from space
    const auto source = with(unit);
    ASSERT_EQ(source->info().warnings.size(), 1U);
    EXPECT_TRUE(is_loss(source->info().warnings[0]));
    EXPECT_THAT(source->info().warnings[0], HasSubstr(std::string(unit) + "\", which is no unit that isohf knows"));
  }
  OpenOptions options;
  options.reference_system = "EPSG:2263";
  EXPECT_THAT(open_raster(folder / "a.nc", options)->info().warnings, Not(Contains(HasSubstr("radian"))));
}

TEST_F(Netcdf, NodataIsEveryMissingValueAndWhatTheValidRangeLeavesOut) {
  struct Row {
    const char* attributes;
    std::vector<double> voids, elevations;
  };
  for (const auto& [attributes, voids, elevations] : {Row{"", {-32767}, {1, -9}},
                                                      {"_Unsigned=true; missing_value=-1,-9", {65535, 65527}, {1}},
                                                      {"_FillValue=7; missing_value=8", {7, 8}, {-32767}},
                                                      {"valid_range=0,100", {1500, -9}, {0, 40, 100}},
                                                      {"valid_min=0", {-9}, {1500, 40}},
                                                      {"valid_max=100", {1500}, {-9, 40}},
                                                      {"_Unsigned=true; valid_range=1,-5536", {0, 60001}, {60000}}}) {
    const SourceInfo info = open_z(small_grid(), {1, 2, 3, 4}, attributes)->info();
    EXPECT_EQ(info.sample_type,
              attributes[0] == '_' && attributes[1] == 'U' ? SampleType::kUint16 : SampleType::kInt16);
    for (const double value : voids) EXPECT_TRUE(is_void(info, value)) << value;
    for (const double value : elevations) EXPECT_FALSE(is_void(info, value)) << value;
  }
}

TEST_F(Netcdf, SamplesBecomeElevationsInAUnitOfLength) {
  struct Row {
    const char* attributes;
    double scale;
    std::string unit;
    std::string says;  ///< a warning; "!": which is a loss
  };
  constexpr double kGravity = 9.80665;
  for (const auto& [attributes, scale, unit, says] :
       {Row{"units=meters", 1.0, "metre", ""},
        {"units=km", 1.0, "kilometre", ""},
        {"units=gpm; standard_name=geopotential_height", 1.0, "metre", ""},
        {"", 1.0, "", ""},
        {"units=m; positive=down", -1.0, "metre", "depths, positive down"},
        {"units=m; standard_name=sea_floor_depth_below_geoid", -1.0, "metre", "depths, positive down"},
        {"units=m; standard_name=depth; positive=up", 1.0, "metre", ""},
        {"units=m**2 s**-2; standard_name=geopotential", 1.0 / kGravity, "metre", "divided by 9.80665"},
        {"units=m2 s-2; long_name=Geopotential", 1.0 / kGravity, "metre", "divided by 9.80665"},
        {"units=m above MSL; long_name=depth; positive=up", 1.0, "metre", ""},
        {"units=m; long_name=Water depth", 1.0, "metre", "!z may be depths, positive down"},
        {"units=K", 1.0, "", "!z is in \"K\", which is no unit of length"},
        {"units=m s-1", 1.0, "", "!no unit of length"},
        {"units=1", 1.0, "", "!no unit of length"}}) {
    SCOPED_TRACE(attributes);
    const std::string packed = std::string(attributes) + "; scale_factor=0.5; add_offset=10";
    const SourceInfo info = open_z(small_grid(), {1, 2, 3, 4}, packed.c_str() + (*attributes == '\0' ? 2 : 0))->info();
    EXPECT_DOUBLE_EQ(info.z_scale, 0.5 * scale);
    EXPECT_DOUBLE_EQ(info.z_offset, 10.0 * scale);
    EXPECT_EQ(info.vertical_unit, unit);
    ASSERT_EQ(info.warnings.size(), says.empty() ? 0U : 1U);
    if (says.empty()) continue;
    EXPECT_THAT(info.warnings[0], HasSubstr(says.substr(says[0] == '!' ? 1 : 0)));
    EXPECT_EQ(is_loss(info.warnings[0]), says[0] == '!');
  }
  EXPECT_FALSE(std::signbit(open_z(small_grid(), {1, 2, 3, 4}, "positive=down")->info().z_offset));
  OpenOptions kelvin;  // somebody knows better
  kelvin.z_scale = 2.0;
  (void)open_z(small_grid(), {1, 2, 3, 4}, "units=K");
  EXPECT_THAT(open_raster(folder / "a.nc", kelvin)->info().warnings, IsEmpty());
}

TEST_F(Netcdf, TheVariableIsReadThatIsLikeliestToHoldElevations) {
  struct Row {
    const char* variables;  ///< "name:attributes|name ..."; bytes if the name ends in *
    std::string chosen;
    std::string left_out;  ///< of a loss; empty: none
  };
  for (const auto& [variables, chosen, left_out] :
       {Row{"mask*|firn|surface:standard_name=surface_altitude|thickness|bed:standard_name=bedrock_altitude|errbed",
            "surface", "bed"},
        {"bed:standard_name=bedrock_altitude|thickness", "bed", ""},
        {"e:standard_name=surface_altitude standard_error|a:standard_name=surface_altitude", "a", ""},
        {"sid|Band1", "Band1", ""},
        {"tid|elevation", "elevation", ""},
        {"z:flag_meanings=land sea|Elevation_m", "Elevation_m", ""},
        {"z:flag_values=0,1|lidar:long_name=Height of the ground", "lidar", ""},
        {"value_count|elevation|stdev|elevation_min|interpolation_flag", "elevation", "elevation_min"},
        {"tas|orog:standard_name=surface_altitude|pr", "orog", ""},
        {"slope|first|second", "first", "second"},
        {"lat_bnds|edges|mask*:bounds=edges", "", ""}}) {
    SCOPED_TRACE(variables);
    NetcdfBytes file = small_grid();
    std::istringstream in(variables);
    for (std::string each; std::getline(in, each, '|');) {
      std::string name = each.substr(0, each.find(':'));
      const Attributes of(each.size() > name.size() ? each.c_str() + name.size() + 1 : "");
      const bool is_byte = name.back() == '*';
      if (is_byte) name.pop_back();
      file.variable(name, {0, 1}, is_byte ? kByte : kFloat, std::string(16, '\0'), of.texts, of.numbers);
    }
    const SourceInfo info = open(file)->info();
    EXPECT_EQ(info.channel, chosen);  // empty: there is but one
    EXPECT_EQ(std::ranges::count_if(info.warnings, is_loss), left_out.empty() ? 0 : 1);
    if (left_out.empty()) continue;
    EXPECT_THAT(info.warnings,
                ElementsAre(HasSubstr("left out are " + left_out + ", which may be elevations as well")));
    EXPECT_THAT(open(file, chosen)->info().warnings, IsEmpty());
  }
  (void)open_z(small_grid(), {1, 2, 3, 4});
  EXPECT_THAT(failure_of(folder.path(), nullptr, [&] { (void)open_raster(folder / "a.nc", of_channel("ghost")); }),
              HasSubstr("there is no channel \"ghost\"; there are z"));
}

TEST_F(Netcdf, SeveralStepsAreRefusedAndRecordsAreRead) {
  const auto stepped = [](std::uint32_t records) {
    NetcdfBytes file;
    file.dimension("time", 0).dimension("y", 2).dimension("x", 2).records(records);
    std::vector<std::int16_t> samples;
    for (std::uint32_t i = 0; i < records * 4; ++i) samples.push_back(static_cast<std::int16_t>(i));
    return file.variable("z", {0, 1, 2}, kShort, shorts(samples), {});
  };
  EXPECT_THAT(values_of(*open(stepped(1))), ElementsAre(2, 3, 0, 1));
  ErrorCode code{};
  EXPECT_THAT(failure(stepped(2), &code),
              HasSubstr("z has 2 steps along time, must have 1 (ncks -d time,0 takes one)"));
  EXPECT_EQ(code, ErrorCode::kUnsupported);
  NetcdfBytes rows;  // that grow
  rows.dimension("y", 0).dimension("x", 2).records(3);
  EXPECT_THAT(values_of(*open_z(rows, {1, 2, 3, 4, 5, 6})), ElementsAre(5, 6, 3, 4, 1, 2));
  NetcdfBytes both = small_grid();  // what has no steps goes before
  both.dimension("time", 2).variable("h", {2, 0, 1}, kShort, std::string(16, '\0'), {});
  EXPECT_THAT(values_of(*open_z(both, {1, 2, 3, 4}, "long_name=height")), ElementsAre(1, 2, 3, 4));
}

TEST_F(Netcdf, HeadersThatClaimMoreThanTheFileHoldsAreRefused) {
  NetcdfBytes file = small_grid();
  file.variable("z", {0, 1}, kShort, shorts({1, 2, 3, 4}), {});
  const std::string whole = file.bytes();
  ErrorCode code{};
  for (std::size_t length = 8; length < whole.size(); ++length) {
    const std::string path = write("a.nc", whole.substr(0, length));
    EXPECT_THAT(failure_of(folder.path(), &code, [&] { (void)open_raster(path, {}); }), HasSubstr("ends early"));
    EXPECT_EQ(code, ErrorCode::kCorrupt);
  }
  NetcdfBytes huge;
  huge.dimension("y", 2).dimension("x", 0x7FFFFFFF);
  EXPECT_THAT(failure(huge.variable("z", {0, 1}, kShort, shorts({1, 2, 3, 4}), {})), HasSubstr("ends early"));
}

/// Readers of one file or several at once: neither library is for threads.
TEST_F(Netcdf, ReadersMayRunOnThreads) {
  const std::string data = std::string(ISOHF_SOURCE_DIR) + "/tests/formats/data/";
  const std::string classic =
      write("a.nc", small_grid().variable("z", {0, 1}, kShort, shorts({1, 2, 3, 4}), {}).bytes());
  const std::vector<std::string> paths = {data + "lat_lon.nc", data + "lon_lat.nc", classic};
  std::vector<std::vector<double>> expected;
  for (const std::string& path : paths) expected.push_back(values_of(*open_raster(path, {})));
  std::vector<std::jthread> threads;
  std::atomic<int> wrong = 0;
  for (std::size_t thread = 0; thread < 6; ++thread) {
    threads.emplace_back([&, thread] {
      for (std::size_t i = 0; i < 20; ++i) {
        const std::size_t which = (thread + i) % paths.size();
        if (values_of(*open_raster(paths[which], {})) != expected[which]) ++wrong;
      }
    });
  }
  threads.clear();
  EXPECT_EQ(wrong, 0);
}

TEST_F(Netcdf, AGridMappingGivesTheReferenceSystem) {
  const auto mapped = [&](const std::string& mapping, const std::string& unit = "m",
                          const char* of = "grid_mapping=map") {
    NetcdfBytes file = grid({4600.0, 4500.0}, {500.0, 600.0}, unit, unit);
    const Attributes attributes(mapping.c_str());
    file.variable("map", {}, kShort, shorts({0}), attributes.texts, attributes.numbers);
    return open_z(file, {1, 2, 3, 4}, of)->info();
  };
  struct Row {
    std::string mapping;
    std::string code;  ///< of the same
    GeoPoint at;
  };
  const std::string grs80 = "; semi_major_axis=6378137; inverse_flattening=298.257222101";
  for (const auto& [mapping, code, at] :
       {Row{"transverse_mercator; latitude_of_projection_origin=0; longitude_of_central_meridian=9; "
            "scale_factor_at_central_meridian=0.9996; false_easting=500000",
            "EPSG:32632",
            {10.0, 45.0}},
        {"polar_stereographic; straight_vertical_longitude_from_pole=-45; standard_parallel=70",
         "EPSG:3413",
         {-40.0, 75.0}},
        {"polar_stereographic; latitude_of_projection_origin=-90; standard_parallel=-71; "
         "straight_vertical_longitude_from_pole=0",
         "EPSG:3031",
         {30.0, -75.0}},
        {"lambert_azimuthal_equal_area; latitude_of_projection_origin=52; longitude_of_projection_origin=10; "
         "false_easting=4321000; false_northing=3210000" +
             grs80,
         "EPSG:3035",
         {6.0, 45.0}},
        {"lambert_conformal_conic; standard_parallel=49,44; latitude_of_projection_origin=46.5; "
         "longitude_of_central_meridian=3; false_easting=700000; false_northing=6600000" +
             grs80,
         "EPSG:2154",
         {6.0, 45.0}},
        {"albers_conical_equal_area; standard_parallel=55,65; latitude_of_projection_origin=50; "
         "longitude_of_central_meridian=-154" +
             grs80,
         "EPSG:3338",
         {-150.0, 60.0}},
        {"mercator; standard_parallel=0; longitude_of_projection_origin=150", "EPSG:3832", {160.0, 10.0}}}) {
    SCOPED_TRACE(mapping);
    const SourceInfo info = mapped("grid_mapping_name=" + mapping);
    EXPECT_THAT(info.warnings, IsEmpty());
    const MapPoint ours = Crs::parse(system_text(info.georeference.system))->map_from_geo(at);
    const MapPoint known = Crs::parse(code)->map_from_geo(at);
    EXPECT_NEAR(ours.easting, known.easting, 1e-3);
    EXPECT_NEAR(ours.northing, known.northing, 1e-3);
  }
  for (const char* text : {"spatial_ref=EPSG:3031", "proj4=EPSG:3031", "crs_wkt=EPSG:3031", "spatial_epsg=3031"}) {
    const std::string mercator = "; grid_mapping_name=mercator";  // which counts less
    EXPECT_EQ(mapped(text + mercator).georeference.system.epsg, 3031) << text;
  }
  const Georeference in_km = mapped("crs_wkt=EPSG:32632", "km", "grid_mapping=map: lat lon").georeference;
  EXPECT_EQ(in_km.system.epsg, 32632);
  EXPECT_EQ(in_km.metres_per_unit, 1000.0);
  EXPECT_EQ(mapped("earth_radius=6371229", "degrees").georeference.system.semi_major_axis_m, 6371229.0);
  for (const auto& [kind, unit, says] :
       {std::tuple("rotated_latitude_longitude", "degrees", "comes without crs_wkt: where it lies is left out"),
        {"geostationary", "rad", "comes without crs_wkt: where it lies is left out"},
        {"mercator", "degrees", "no coordinates in degrees: where it lies is left out"},
        {"van_der_grinten", "m", "comes without crs_wkt: the reference system is left out"}}) {
    SCOPED_TRACE(kind);
    const SourceInfo info = mapped(std::string("grid_mapping_name=") + kind, unit);
    EXPECT_EQ(std::ranges::count_if(info.warnings, is_loss), 1);
    EXPECT_THAT(info.warnings, Contains(HasSubstr(says)));
  }
}

// GDAL's netCDF driver wrote these: CF conventions, deflated chunks of 4 x 3 samples.
class Netcdf4 : public ::testing::Test {
 protected:
  Netcdf4() { set_module_folder(ISOHF_BIN_DIR); }
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
    OpenOptions options;
    options.buffer_bytes = limit;
    const auto limited = open_raster(file("lat_lon.nc"), options);
    EXPECT_EQ(values_of(*limited), values);
    EXPECT_THAT(values_of(info.sample_type, read_window(*limited, {3, 2, 2, 2})),
                ElementsAre(values[21], values[22], values[30], values[31]));
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

/// Programs in place of the probe.
TEST_F(Netcdf4, WhatTheProbeFindsRefusesAFileOnceForEachOfItsStates) {
  const TemporaryFolder folder;
  const std::string probe = folder / "isohf-netcdf-probe";
  const std::string path = folder / "a.nc";
  std::filesystem::copy_file(file("lat_lon.nc"), path);
  const auto found = [&](const std::string& script) {
    write_file(probe, "#!/bin/sh\necho x >> " + folder / "times" + '\n' + script);
    std::filesystem::permissions(probe, std::filesystem::perms::owner_all);
    ErrorCode code{};
    return failure_of(path, &code, [&] { (void)open_raster(path, {}); });
  };
  set_module_folder(folder.path());
  EXPECT_THAT(found("kill -SEGV $$"), HasSubstr("is so damaged that HDF5 breaks down over it"));
  EXPECT_THAT(found("exit 0"), HasSubstr("breaks down"));
  EXPECT_EQ(found("printf '2 '; printf '%s' \"$1\"; printf ': no filter'"), path + ": no filter");
  EXPECT_EQ(found("printf sound"), "");
  EXPECT_EQ(found("exit 1"), "");  // known by now
  EXPECT_EQ(read_file(folder / "times"), "x\nx\nx\nx\n");
  std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_THAT(found("exit 1"), HasSubstr("breaks down"));
}

}  // namespace
}  // namespace isohf::test
