
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <GeographicLib/UTMUPS.hpp>
#include <bit>
#include <cmath>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "formats/geotiff/geotiff_keys.h"
#include "formats/mosaic/mosaic_pieces.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "isohf/projection/choose_projection.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/crs_operation.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/raster.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kDegree = M_PI / 180.0;
constexpr double kWgs84 = 6378137.0;
constexpr double kE2 = 0.00669437999014;  // to its last digit; the tests ask for 1e-9

void expect_near(const MapPoint& found, const MapPoint& expected, double tolerance, const std::string& what = {}) {
  EXPECT_NEAR(found.easting, expected.easting, tolerance) << what;
  EXPECT_NEAR(found.northing, expected.northing, tolerance) << what;
}

/// To a micrometre.
void expect_same_place(const GeoPoint& found, const GeoPoint& place, const std::string& what = {}) {
  constexpr double kMicrometre = 1e-6 / 111000.0;
  EXPECT_NEAR(found.latitude, place.latitude, kMicrometre) << what;
  EXPECT_NEAR(std::remainder(found.longitude - place.longitude, 360.0) * std::cos(place.latitude * kDegree), 0.0,
              kMicrometre)
      << what;
}

ReferenceSystem system_of(const std::string& text) {
  ReferenceSystem found;
  if (text.starts_with("EPSG:")) {
    found.epsg = std::stoi(text.substr(5));
  } else {
    found.wkt = Crs::parse(text)->wkt(WktDialect::kWkt2);
  }
  return found;
}

class UnderstandSystem : public testing::Test {
 protected:
};

TEST_F(UnderstandSystem, SaysNameCodeUnitAndEllipsoid) {
  const auto utm = Crs::parse("EPSG:32632");
  EXPECT_EQ(utm->description().name, "WGS 84 / UTM zone 32N");
  EXPECT_EQ(utm->description().authority, "EPSG");
  EXPECT_EQ(utm->description().code, "32632");
  EXPECT_TRUE(utm->description().is_projected);
  EXPECT_EQ(utm->description().unit, 1.0);
  EXPECT_EQ(utm->ellipsoid(), Ellipsoid{});
  EXPECT_THAT(utm->wkt(WktDialect::kWkt2), StartsWith("PROJCRS[\"WGS 84 / UTM zone 32N\""));
  EXPECT_EQ(utm->wkt(WktDialect::kWkt2).find('\n'), std::string::npos);

  EXPECT_EQ(Crs::parse("EPSG:2263")->description().unit, 1200.0 / 3937.0);
  const auto degrees = Crs::parse("EPSG:4326");
  EXPECT_FALSE(degrees->description().is_projected);
  EXPECT_NEAR(degrees->description().unit, 1.0, 1e-15);
  const auto compound = Crs::parse("EPSG:32632+5773");
  EXPECT_TRUE(compound->description().is_compound);
  EXPECT_EQ(compound->description().code, "32632");
}

TEST_F(UnderstandSystem, TakesWktOfEveryVersionAndProjStrings) {
  const MapPoint expected = Crs::parse("EPSG:32632")->map_from_geo({6.865, 45.833});
  const std::string wkt1 =
      "PROJCS[\"WGS_1984_UTM_Zone_32N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,"
      "298.257223563]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_"
      "Mercator\"],"
      "PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",9.0],"
      "PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\"Meter\",1.0]]";
  for (const std::string& text :
       {wkt1, Crs::parse("EPSG:32632")->wkt(WktDialect::kWkt2), Crs::parse("EPSG:32632+5773")->wkt(WktDialect::kWkt2),
        std::string("+proj=utm +zone=32 +datum=WGS84")}) {
    expect_near(Crs::parse(text)->map_from_geo({6.865, 45.833}), expected, 1e-6, text);
  }
}

TEST_F(UnderstandSystem, ADatumThatIsLeftUnknownMayBeAnyOfItsEllipsoid) {
  struct Case {
    const char* one;
    const char* other;
    bool is_same;
    bool may_be;
  };
  for (const Case& of : {Case{"EPSG:4326", "EPSG:4979", true, true},
                         {"EPSG:4326", "+proj=longlat +datum=WGS84 +towgs84=0,0,0", true, true},
                         {"EPSG:4326", "+proj=longlat +ellps=WGS84", false, true},
                         {"EPSG:4267", "+proj=longlat +ellps=clrk66", false, true},
                         {"EPSG:4267", "+proj=longlat +ellps=WGS84", false, false},
                         {"EPSG:4326", "EPSG:4258", false, false},
                         {"EPSG:23032", "+proj=utm +zone=32 +ellps=intl", false, true},
                         {"EPSG:23032", "+proj=utm +zone=33 +ellps=intl", false, false},
                         {"EPSG:23032", "+proj=utm +zone=32 +ellps=intl +units=km", false, false},
                         {"EPSG:32632", "EPSG:25832", false, false},
                         {"EPSG:32632", "EPSG:4326", false, false},
                         {"EPSG:3413", "+proj=stere +lat_0=90 +lat_ts=70 +lon_0=-45 +datum=WGS84", true, true}}) {
    const auto one = Crs::parse(of.one);
    const auto other = Crs::parse(of.other);
    EXPECT_EQ(one->is_same(*other), of.is_same) << of.one << ' ' << of.other;
    EXPECT_EQ(other->is_same(*one), of.is_same) << of.one << ' ' << of.other;
    EXPECT_EQ(one->may_be(*other), of.may_be) << of.one << ' ' << of.other;
    EXPECT_EQ(other->may_be(*one), of.may_be) << of.one << ' ' << of.other;
  }
}

TEST_F(UnderstandSystem, RefusesInOneLineWhatIsNoSystem) {
  for (const char* text :
       {"EPSG:999999", "nonsense", "", "EPSG:5773", "LOCAL_CS[\"a\",UNIT[\"metre\",1]]", "EPSG:2053"}) {
    const Error error = error_of([&] { (void)Crs::parse(text); });
    const bool is_read = std::string(text) == "EPSG:2053";  // but counts westwards
    EXPECT_EQ(error.code(), is_read ? ErrorCode::kUnsupported : ErrorCode::kInvalidArgument) << text;
    EXPECT_THAT(error.what(), StartsWith(std::string("the reference system ") + text));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

/// GeographicLib computes zones to nanometres.
TEST_F(UnderstandSystem, UtmAgreesWithGeographicLibAndComesBack) {
  std::mt19937 random(20);
  std::uniform_real_distribution<double> across(-3.0, 3.0);
  std::uniform_real_distribution<double> along(0.0, 84.0);
  for (const bool north : {true, false}) {
    for (int zone = 1; zone <= 60; zone += 7) {
      const auto utm = Crs::parse("EPSG:" + std::to_string((north ? 32600 : 32700) + zone));
      for (int i = 0; i < 20; ++i) {
        const GeoPoint place{6.0 * zone - 183.0 + across(random), (north ? 1.0 : -0.95) * along(random)};
        int found_zone = 0;
        bool found_north = false;
        MapPoint expected;
        GeographicLib::UTMUPS::Forward(place.latitude, place.longitude, found_zone, found_north, expected.easting,
                                       expected.northing, zone);
        const MapPoint found = utm->map_from_geo(place);
        expect_near(found, expected, 1e-6);
        expect_same_place(utm->geo_from_map(found), place);
      }
    }
  }
}

/// What both know, by the text that rasters of the map are written with.
TEST_F(UnderstandSystem, AgreesWithGeographicLibOnEveryKindOfGroundProjection) {
  struct Case {
    const char* request;
    GeoExtent ground;
  };
  const Case cases[] = {{"local", {5.0, 40.0, 15.0, 50.0}},
                        {"local:10,-33.3", {0.0, -40.0, 20.0, -20.0}},
                        {"transverse-mercator:9,0.9996", {5.0, -60.0, 13.0, 60.0}},
                        {"utm:32N", {6.0, 1.0, 12.0, 84.0}},
                        {"utm:60S", {174.0, -80.0, 180.0, -1.0}},
                        {"lambert-conformal:46,49,3", {-5.0, 41.0, 10.0, 51.0}},
                        {"lambert-conformal:-20,20,30", {-20.0, -60.0, 80.0, 60.0}},
                        {"polar-stereographic:-71,0", {-180.0, -90.0, 180.0, -60.0}},
                        {"polar-stereographic:70,-45", {-180.0, 60.0, 180.0, 90.0}}};
  std::mt19937 random(54);
  for (const Case& test : cases) {
    const ProjectionSpec spec = choose_projection(ProjectionRequest::parse(test.request),
                                                  {"dem", "Earth", Ellipsoid{}, test.ground, false, false, true})
                                    .spec;
    const Projection ours(spec);
    GroundRequest request;
    request.projection = ProjectionRequest::parse(projection_wkt(spec, ""));
    SourceInfo info;
    info.path = "dem";
    info.width = info.height = 2;
    info.georeference =
        place_at(Registration::kUnknown, HorizontalUnit::kDegree, test.ground.west, test.ground.north, 1.0);
    understand_ground(info, request);
    const Projection theirs(request.projection.system_map);
    std::uniform_real_distribution<double> longitude(test.ground.west, test.ground.east);
    std::uniform_real_distribution<double> latitude(test.ground.south, test.ground.north);
    for (int i = 0; i < 1000; ++i) {
      const GeoPoint place{longitude(random), latitude(random)};
      const MapPoint a = ours.forward(place);
      expect_near(a, theirs.forward(place), 1e-6, test.request);
      expect_same_place(theirs.inverse(a), place, test.request);
      if (HasFailure()) FAIL() << test.request << " at " << place.longitude << " " << place.latitude;
    }
  }
}

/// A system of another datum is reached by PROJ's operation, which the archive keeps.
TEST_F(UnderstandSystem, ProjectionsOnAnotherDatumKeepTheWayThere) {
  SourceInfo info;
  info.path = "dem";
  info.width = info.height = 11;
  info.georeference = place_at(Registration::kUnknown, HorizontalUnit::kDegree, 7.0, 47.0, 0.1, 4326);
  GroundRequest request;
  request.projection = ProjectionRequest::parse("EPSG:21781");
  understand_ground(info, request);
  const ProjectionSpec& spec = request.projection.system_map;
  EXPECT_EQ(spec.system.text, "EPSG:21781");
  EXPECT_EQ(spec.system.name, "CH1903 / LV03");
  EXPECT_THAT(spec.system.operation, HasSubstr("+proj=somerc"));
  // swisstopo's own example of its formulas, which are good to a metre: 8 43 49.79, 46 02 38.87 is 699999.76 99999.97.
  const MapPoint at =
      Projection(spec).forward({8.0 + 43.0 / 60.0 + 49.79 / 3600.0, 46.0 + 2.0 / 60.0 + 38.87 / 3600.0});
  expect_near(at, {700000.0, 100000.0}, 1.5);
  const auto again = understand_way(spec.system, spec.ellipsoid);
  EXPECT_EQ(again->map_from_geo({7.5, 46.5}).easting, spec.map->map_from_geo({7.5, 46.5}).easting);

  for (const auto& [text, why] : {std::pair{"EPSG:4258", "counts degrees and is no map"},
                                  {"EPSG:99999", "PROJ does not understand it"},
                                  {"IAU_2015:49910", "is of Mars, the input of Earth"}}) {
    request.projection = ProjectionRequest::parse(text);
    const Error error = error_of([&] { understand_ground(info, request); });
    EXPECT_THAT(error.what(), StartsWith("dem: `projection`: ")) << text;
    EXPECT_THAT(error.what(), HasSubstr(why)) << text;
  }
  EXPECT_THAT(error_of([&] {
                (void)understand_way({"EPSG:1", "a map", "+proj=nonsense", 1.0}, {});
              }).what(),
              StartsWith("the way to the map a map: "));
}

/// An archive on a reference system has no places until that is understood, and then those of the system.
TEST_F(UnderstandSystem, ArchivesOnAReferenceSystemFindTheirPlacesByIt) {
  MemorySource<float> source(SampleType::kFloat32, 60, 50, [](std::int64_t c, std::int64_t r) {
    return static_cast<double>(c) + 100.0 * static_cast<double>(r);
  });
  source.mutable_info().georeference = place_at(Registration::kArea, HorizontalUnit::kDegree, -74.3, 41.0, 0.01, 4326);
  ConvertOptions options;
  options.code_type = CodeType::kF32;
  options.plan.ground.projection = ProjectionRequest::parse("EPSG:2263");
  understand_ground(source.info(), options.plan.ground);
  const TemporaryFolder folder;
  (void)convert(source, folder / "a.isohf", options);

  ArchiveReader archive(folder / "a.isohf");
  EXPECT_FALSE(WorldGeoreference(archive.metadata()).has_geo());
  EXPECT_THAT(error_of([&] { (void)Projection(archive.metadata().projection->spec); }).what(),
              HasSubstr("NAD83 / New York Long Island (ftUS) is not understood yet"));
  understand_world(archive);
  const WorldGeoreference places(archive.metadata());
  ASSERT_TRUE(places.has_geo());
  const auto feet = Crs::parse("EPSG:2263");
  const Georeference grid = *grid_georeference(archive.metadata(), natural_grid(archive.metadata()));
  EXPECT_EQ(grid.metres_per_unit, 1200.0 / 3937.0);
  EXPECT_EQ(grid.system.epsg, 2263);
  const SampleGrid samples = natural_grid(archive.metadata());
  for (const GeoPoint at : {GeoPoint{-74.0, 40.7}, {-73.8, 40.9}, {-74.25, 40.55}}) {
    const MapPoint there = feet->map_from_geo(at);
    const WorldPoint world = places.world_from_geo(at);
    EXPECT_NEAR((world.x - samples.first_x) / grid.metres_per_unit + grid.origin_x, there.easting, 1e-3);
    EXPECT_NEAR(grid.origin_y - (world.z - samples.first_z) / grid.metres_per_unit, there.northing, 1e-3);
    EXPECT_NEAR(places.geo_from_world(world).latitude, at.latitude, 1e-9);
  }
  // A grid in a third system has the elevations of these places.
  std::vector<Warning> warnings;
  const auto utm = understand_grid_system(archive, "EPSG:32618", warnings);
  EXPECT_TRUE(warnings.empty());
  const SampleGrid there = grid_in_system(archive.metadata(), archive.metadata().valid, utm, GridSize{30, 20}, {});
  EXPECT_TRUE(there.goes_by_places());
  EXPECT_EQ(usual_method(archive.metadata(), there), RestoreMethod::kAverage);
  EXPECT_EQ(grid_georeference(archive.metadata(), there)->system.epsg, 32618);
  std::vector<double> rows(600);
  RowReader(archive, there).read(0, 20, rows);
  const auto zone = Crs::parse("EPSG:32618");
  Surface surface(archive);
  for (const std::size_t i : {std::size_t{225}, std::size_t{315}, std::size_t{432}}) {
    const GeoPoint at = zone->geo_from_map({there.first_x + static_cast<double>(i % 30) * there.spacing_x,
                                            there.first_z - static_cast<double>(i / 30) * there.spacing_z});
    EXPECT_NEAR(rows[i], surface.at(at).elevation, 1e-3);
    EXPECT_NEAR(rows[i], (at.longitude + 74.3) * 100.0 + (41.0 - at.latitude) * 10000.0, 0.5);
  }
  EXPECT_THAT(error_of([&] { (void)understand_grid_system(archive, "EPSG:99999", warnings); }).what(),
              HasSubstr("a.isohf: the reference system EPSG:99999"));
  archive.set_world_map(nullptr);
  EXPECT_FALSE(WorldGeoreference(archive.metadata()).has_geo());
}

/// The Moon's simple cylindrical maps in metres, whose edges are poles and beyond by rounding.
class CylindricalMoon : public UnderstandSystem {
 protected:
  static std::unique_ptr<MemorySource<float>> source_of(std::int64_t width, std::int64_t height, double west,
                                                        double north, double spacing) {
    auto source = std::make_unique<MemorySource<float>>(
        SampleType::kFloat32, width, height, [](std::int64_t c, std::int64_t r) { return static_cast<double>(c + r); });
    Georeference& place = source->mutable_info().georeference;
    place = place_at(Registration::kArea, HorizontalUnit::kMetre, west + spacing / 2.0, north - spacing / 2.0, spacing);
    place.system.wkt = "+proj=eqc +lon_0=180 +R=1737400 +units=m";
    place.system.semi_major_axis_m = 1737400.0;
    place.system.inverse_flattening = 0.0;
    return source;
  }
};

TEST_F(CylindricalMoon, ThatEndsAtThePoleLiesOnAPolarMap) {
  for (const double north : {2729101.538173499982804, 2729200.0}) {
    const auto owner = source_of(60, 50, -100000.0, north, 10000.0);
    MemorySource<float>& source = *owner;
    for (const char* const kind : {"auto", "polar-stereographic:90", "local"}) {
      ConvertOptions options;
      options.code_type = CodeType::kF32;
      options.plan.ground.projection = ProjectionRequest::parse(kind);
      understand_ground(source.info(), options.plan.ground);
      const TemporaryFolder folder;
      (void)convert(source, folder / "a.isohf", options);
      ArchiveReader archive(folder / "a.isohf");
      ASSERT_TRUE(archive.metadata().projection) << kind;
      // Column 10.5 of the samples lies on the 180th meridian, the pole half a sample North of row 0.
      EXPECT_NEAR(Surface(archive).at(GeoPoint{180.0, 89.0}).elevation, 9.5 + 2.53, 0.3) << kind;
    }
  }
}

TEST_F(CylindricalMoon, ThatGoesRoundHasAllLongitudes) {
  for (const double spacing : {22742.52, 25000.0}) {
    const SourceInfo info = source_of(480, 219, -240.0 * spacing, 2729000.0, spacing)->info();
    GroundRequest request;
    understand_ground(info, request);
    const SourceFrame frame = make_source_frame(info, request);
    ASSERT_TRUE(frame.ground);
    EXPECT_NEAR(frame.ground->extent.east - frame.ground->extent.west, 360.0, 1e-9);
  }
}

TEST_F(CylindricalMoon, ThatGoesRoundIsOfferedNoRemedyThatIsRefused) {
  const SourceInfo info = source_of(437, 219, -10925000.0, 2750000.0, 25000.0)->info();
  GroundRequest request;
  understand_ground(info, request);
  const SourceFrame frame = make_source_frame(info, request);
  EXPECT_THAT(
      scale_warning(info, frame, request.projection),
      HasSubstr("a part of it (`bbox`) can be laid on a truer map by `projection` auto; `projection` none keeps"));
  request.wrap = Wrap::kAlways;
  EXPECT_THAT(
      error_of([&] { (void)make_source_frame(info, request); }).what(),
      HasSubstr("needs columns all the way round, 10916406.1527 of its map; this input's 437 columns 25000 apart "
                "make 10925000"));
}

/// Files of neighbouring zones are of one resolution, whatever their maps' scales.
TEST_F(UnderstandSystem, AcrossZonesTheOrderOfTheFilesDecidesWhatShows) {
  const TemporaryFolder folder;
  const auto write = [&](const char* name, int epsg, double longitude, double elevation) {
    const MapPoint at = Crs::parse("EPSG:" + std::to_string(epsg))->map_from_geo({longitude, 35.0});
    RasterSpec spec = placed_spec(40, 40, SampleType::kInt16, Registration::kArea);
    spec.georeference->system.epsg = epsg;
    spec.georeference->origin_x = 30.0 * std::round(at.easting / 30.0);
    spec.georeference->origin_y = 30.0 * std::round(at.northing / 30.0);
    raster_of<std::int16_t>(spec, [&](auto, auto) { return elevation; }).cut(folder / name, {0, 0, 40, 40});
    return folder / name;
  };
  const std::string zone11 = write("a.tif", 32611, -114.0, 100.0);
  const std::string zone12 = write("z12.tif", 32612, -114.0, 200.0);
  const ProjectionRequest onto = ProjectionRequest::parse("EPSG:32611");
  for (const bool swapped : {false, true}) {
    const std::vector<std::string> paths = swapped ? std::vector{zone12, zone11} : std::vector{zone11, zone12};
    for (const OverlapRule rule : {OverlapRule::kLast, OverlapRule::kFirst}) {
      MosaicSource mosaic("mosaic", plan_mosaic(paths, {}, std::nullopt, onto), {}, rule);
      const SourceInfo& info = mosaic.info();
      std::vector<float> sample(1);
      mosaic.read_window({info.width / 2, info.height / 2, 1, 1}, std::as_writable_bytes(std::span(sample)));
      EXPECT_EQ(sample[0], swapped == (rule == OverlapRule::kLast) ? 100.0F : 200.0F);
      for (const Warning& warning : info.warnings)
        EXPECT_THAT(warning, testing::Not(HasSubstr("differ in resolution")));
    }
  }
}

/// Grids of shifts end where those for whom they were made do.
TEST_F(UnderstandSystem, GroundBeyondAGridOfShiftsIsMovedByAWayThatShowsIt) {
  ReferenceSystem wgs84;
  wgs84.epsg = 4326;
  const std::string helmert =
      "+proj=tmerc +lat_0=0 +lon_0=9 +k=1 +x_0=3500000 +y_0=0 +ellps=bessel "
      "+towgs84=598.1,73.7,418.2,0.202,0.045,-2.455,6.7 +units=m";
  for (const GeoExtent& ground : {GeoExtent{8.0, 46.83, 8.25, 47.0}, {9.0, 50.0, 9.1, 50.1}}) {
    const WayToSystem way = find_way(wgs84, "EPSG:31467", ground, {});
    EXPECT_FALSE(way.is_ballpark);
    EXPECT_EQ(way.system.operation.find("hgridshift") == std::string::npos, ground.north < 48.0);
    const WayToSystem near = find_way(wgs84, helmert, ground, {});
    const GeoPoint at{ground.west, ground.south};
    expect_near(way.map->map_from_geo(at), near.map->map_from_geo(at), 5.0);
  }
}

/// A shift of the datum moves the pole off the map's own: a cone's far pole, nowhere on its map, lies somewhere then.
TEST_F(UnderstandSystem, GridsLieOnMapsOfOtherDatumsWhereverThesePutThePoles) {
  const auto corners_of = [](double west, double north, const std::string& system) {
    MemorySource<float> source(SampleType::kFloat32, 150, 100,
                               [](std::int64_t c, std::int64_t r) { return static_cast<double>(c + r); });
    source.mutable_info().georeference =
        place_at(Registration::kArea, HorizontalUnit::kDegree, west, north, 1.0 / 1200.0, 4326);
    ConvertOptions options;
    options.code_type = CodeType::kF32;
    const TemporaryFolder folder;
    (void)convert(source, folder / "a.isohf", options);
    ArchiveReader archive(folder / "a.isohf");
    std::vector<Warning> warnings;
    const auto there = understand_grid_system(archive, system, warnings);
    const SampleGrid grid = grid_in_system(archive.metadata(), archive.metadata().valid, there, {}, {});
    const GeoPoint middle =
        there->map->geo_from_map({grid.first_x + grid.spacing_x * static_cast<double>(grid.width - 1) / 2.0,
                                  grid.first_z - grid.spacing_z * static_cast<double>(grid.height - 1) / 2.0});
    EXPECT_NEAR(middle.longitude, west + 0.0625, 2e-3) << system;
    EXPECT_NEAR(middle.latitude, north - 0.0417, 2e-3) << system;
    EXPECT_NEAR(static_cast<double>(grid.width * grid.height), 15000.0, 5000.0) << system;
  };
  corners_of(2.0, 47.0, "EPSG:27572");
  corners_of(2.0, 47.0, "EPSG:27562");
  corners_of(4.5, 50.8, "EPSG:31370");
  corners_of(15.0, 50.0, "EPSG:5514");
  corners_of(14.0, 47.5, "EPSG:31287");
  corners_of(-100.0, 40.0, "EPSG:32040");
  corners_of(-72.0, 41.0, "EPSG:26754");
  const std::string shift = " +ellps=clrk80ign +towgs84=-168,-60,320 +units=m";
  corners_of(2.0, 47.0, "+proj=lcc +lat_1=45 +lat_2=49 +lat_0=47 +lon_0=2" + shift);
  corners_of(2.0, 47.0, "+proj=aea +lat_1=45 +lat_2=49 +lat_0=47 +lon_0=2" + shift);
  corners_of(170.0, 10.0, "+proj=merc +lon_0=0" + shift);
  corners_of(-150.0, -60.0, "+proj=stere +lat_0=-90 +lat_ts=-71" + shift);
  corners_of(15.0, 79.0, "+proj=stere +lat_0=75 +lon_0=15 +datum=WGS84");
}

TEST_F(UnderstandSystem, LongitudesCountFromGreenwichInDegreesWhateverTheSystemDoes) {
  // Paris lies 2.33722917 degrees East of Greenwich; Lambert zone II extended has its origin there, in grads.
  const auto lambert = Crs::parse("EPSG:27572");
  const GeoPoint paris = lambert->geo_from_map({600000.0, 2200000.0});
  EXPECT_NEAR(paris.longitude, 2.33722917, 1e-8);
  EXPECT_NEAR(paris.latitude, 46.8, 1e-9);  // 52 grads
  expect_near(lambert->map_from_geo(paris), {600000.0, 2200000.0}, 1e-6);
}

TEST_F(UnderstandSystem, CoordinatesAreInTheUnitsAskedFor) {
  const GeoPoint place{-73.9857, 40.7484};
  const MapPoint feet = Crs::parse("EPSG:2263")->map_from_geo(place);
  EXPECT_NEAR(feet.easting, 988216.0, 2000.0);  // midtown Manhattan
  const auto metres = Crs::parse("EPSG:2263", 1.0);
  EXPECT_EQ(metres->metres_per_unit(), 1.0);
  const MapPoint there = metres->map_from_geo(place);
  EXPECT_NEAR(there.easting, feet.easting * 1200.0 / 3937.0, 1e-6);
  EXPECT_NEAR(metres->geo_from_map(there).longitude, place.longitude, 1e-11);
}

TEST_F(UnderstandSystem, PlacesBeyondTheMapAreNone) {
  const auto mercator = Crs::parse("EPSG:3857");
  EXPECT_TRUE(std::isnan(mercator->map_from_geo({0.0, 91.0}).northing));
  const auto mollweide = Crs::parse("ESRI:54009");
  EXPECT_TRUE(std::isnan(mollweide->geo_from_map({17e6, 8e6}).latitude));
  // One that fails must not spoil the next.
  EXPECT_NEAR(mollweide->geo_from_map({0.0, 0.0}).latitude, 0.0, 1e-12);
}

TEST_F(UnderstandSystem, ThreadsShareIt) {
  const auto utm = Crs::parse("EPSG:32632");
  const MapPoint expected = utm->map_from_geo({8.0, 47.0});
  std::vector<std::thread> threads;
  std::vector<int> wrong(8, 0);
  for (int& count : wrong) {
    threads.emplace_back([&utm, &count, expected] {
      for (int i = 0; i < 2000; ++i) {
        const MapPoint found = utm->map_from_geo({8.0, 47.0});
        if (found.easting != expected.easting || found.northing != expected.northing) ++count;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, testing::Each(0));
}

/// Lengths of a Mercator map of the sphere, laid over the ellipsoid: a / (N cos) along the parallel and a / (M cos)
/// along the meridian.
TEST_F(UnderstandSystem, ScalesOfWebMercatorAreThoseOfTheEllipsoid) {
  const auto mercator = Crs::parse("EPSG:3857");
  for (const double latitude : {-80.0, -44.5, 0.0, 12.0, 44.5, 71.0}) {
    const double sine = std::sin(latitude * kDegree);
    const double cosine = std::cos(latitude * kDegree);
    const double root = std::sqrt(1.0 - kE2 * sine * sine);
    const double parallel = root / cosine;
    const double meridional = root * root * root / ((1.0 - kE2) * cosine);
    const PlaceScale scale = scale_at(*mercator, mercator->map_from_geo({6.5, latitude}));
    constexpr double kTolerance = 1e-9;
    EXPECT_NEAR(scale.parallel / parallel, 1.0, kTolerance) << latitude;
    EXPECT_NEAR(scale.meridional / meridional, 1.0, kTolerance) << latitude;
    EXPECT_NEAR(scale.least / std::min(parallel, meridional), 1.0, kTolerance);
    EXPECT_NEAR(scale.most / std::max(parallel, meridional), 1.0, kTolerance);
    EXPECT_NEAR(scale.areal / (parallel * meridional), 1.0, kTolerance);
    EXPECT_NEAR(scale.ground_m_per_easting, 1.0 / parallel, kTolerance);
    EXPECT_NEAR(scale.ground_m_per_northing, 1.0 / meridional, kTolerance);
    const double turned = 2.0 * std::asin(std::abs(meridional - parallel) / (meridional + parallel)) / kDegree;
    EXPECT_NEAR(scale.angular_deg, turned, 1e-6);
  }
  // 40 % too long at 44.5 North.
  EXPECT_NEAR(scale_at(*mercator, mercator->map_from_geo({6.5, 44.5})).parallel, 1.39975, 1e-4);
}

TEST_F(UnderstandSystem, ScalesHoldAtAPoleAndAcrossTheAntimeridian) {
  const auto ups = Crs::parse("EPSG:5041");
  const PlaceScale pole = scale_at(*ups, {2000000.0, 2000000.0});
  EXPECT_NEAR(pole.least, 0.994, 1e-8);
  EXPECT_NEAR(pole.most, 0.994, 1e-8);
  const auto pacific = Crs::parse("EPSG:3832");  // Mercator around 150 East
  const PlaceScale antimeridian = scale_at(*pacific, pacific->map_from_geo({180.0, 0.0}));
  EXPECT_NEAR(antimeridian.parallel, 1.0, 1e-9);
  const auto feet = Crs::parse("EPSG:2263");
  EXPECT_NEAR(scale_at(*feet, {984250.0, 200000.0}).mean(), 1.0, 1e-4);
}

TEST_F(UnderstandSystem, GroundUnderARectangleHasItsScalesAndItsPlaces) {
  const auto mercator = Crs::parse("EPSG:3857");
  const MapPoint low = mercator->map_from_geo({6.0, 44.0});
  const MapPoint high = mercator->map_from_geo({7.0, 45.0});
  const auto ground = ground_under(*mercator, {low.easting, low.northing, high.easting, high.northing});
  ASSERT_TRUE(ground);
  EXPECT_NEAR(ground->extent.west, 6.0, 1e-9);
  EXPECT_NEAR(ground->extent.north, 45.0, 1e-9);
  EXPECT_NEAR(ground->centre.longitude, 6.5, 1e-9);
  EXPECT_NEAR(ground->centre.latitude, 44.5, 0.01);
  const double cosine = std::cos(44.5 * kDegree);
  EXPECT_NEAR(ground->mean_scale, 1.0 / cosine, 0.002);
  EXPECT_NEAR(ground->most_scale, std::pow(1.0 - kE2 / 2.0, 1.5) / ((1.0 - kE2) * std::cos(45.0 * kDegree)), 1e-7);
  EXPECT_NEAR(ground->worst_error, ground->most_scale - 1.0, 1e-12);
  EXPECT_NEAR(ground->worst_place.latitude, 45.0, 1e-9);

  const auto plate = Crs::parse("+proj=eqc +datum=WGS84 +type=crs");
  const MapPoint corner = plate->map_from_geo({180.0, 90.0});
  const auto globe = ground_under(*plate, {-corner.easting, -corner.northing, corner.easting, corner.northing});
  ASSERT_TRUE(globe);
  EXPECT_LT(globe->mean_scale, 3.0);  // poles, which are lines of it, count for nothing
  EXPECT_LT(globe->most_scale, 100.0);

  const auto polar = Crs::parse("EPSG:3413");
  const auto cap = ground_under(*polar, {-3e6, -3e6, 3e6, 3e6});
  ASSERT_TRUE(cap);
  EXPECT_EQ(cap->extent.north, 90.0);
  EXPECT_NEAR(cap->extent.east - cap->extent.west, 360.0, 1e-9);
  const auto fiji = ground_under(*mercator, {19.9e6, -2e6, 20.2e6, -1.8e6});
  ASSERT_TRUE(fiji);
  EXPECT_LT(fiji->extent.east - fiji->extent.west, 3.0);
}

GeoTags tags_of(const std::vector<std::uint16_t>& keys, const std::string& ascii = "") {
  GeoTags tags;
  tags.pixel_scale = {10.0, 10.0, 0.0};
  tags.tiepoints = {0.0, 0.0, 0.0, 1000.0, 2000.0, 0.0};
  tags.directory = {1, 1, 1, static_cast<std::uint16_t>(keys.size() / 4)};
  tags.directory.insert(tags.directory.end(), keys.begin(), keys.end());
  tags.ascii = ascii;
  return tags;
}

TEST_F(UnderstandSystem, GeoTiffWithoutALinearUnitHasThatOfItsCode) {
  for (const auto& [code, metres] : {std::pair{2263, 1200.0 / 3937.0}, {2222, 0.3048}, {2056, 1.0}, {32632, 1.0}}) {
    const GeoTiffPlace place =
        place_from_geotiff(tags_of({1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, static_cast<std::uint16_t>(code)}), 10);
    EXPECT_EQ(place.georeference.unit, HorizontalUnit::kMetre);
    EXPECT_EQ(place.georeference.metres_per_unit, metres) << code;
    EXPECT_TRUE(place.warnings.empty());
  }
}

TEST_F(UnderstandSystem, AnEsriStringWithoutAModelIsWhatItSays) {
  const std::string geographic =
      "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],"
      "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]]";
  const std::string feet =
      "PROJCS[\"Mine\"," + geographic + ",PROJECTION[\"Mercator_Auxiliary_Sphere\"],UNIT[\"Foot\",0.3048]]";
  for (const std::uint16_t key : {std::uint16_t{1026}, std::uint16_t{3073}, std::uint16_t{2049}}) {
    const auto place_with = [&](const std::string& wkt) {
      const std::string text = "ESRI PE String = " + wkt + "|";
      return place_from_geotiff(tags_of({1024, 0, 1, 32767, 1025, 0, 1, 1, 2048, 0, 1, 4326, key, 34737,
                                         static_cast<std::uint16_t>(text.size()), 0},
                                        text),
                                10)
          .georeference;
    };
    const Georeference map = place_with(feet);
    EXPECT_EQ(map.unit, HorizontalUnit::kMetre) << key;
    EXPECT_EQ(map.metres_per_unit, 0.3048);
    EXPECT_EQ(map.system.name, "Mine");
    EXPECT_EQ(map.system.wkt, feet);
    EXPECT_EQ(place_with(geographic).unit, HorizontalUnit::kDegree);
  }
}

SourceInfo read_as_prj(const std::string& text) {
  SourceInfo info;
  take_system(text, info);
  return info;
}

constexpr const char* kUtm17 =
    R"(PROJCS["NAD_1983_UTM_Zone_17N",GEOGCS["GCS_North_American_1983",DATUM["D_North_American_1983",)"
    R"(SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],)"
    R"(PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],)"
    R"(PARAMETER["Central_Meridian",-81.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],)"
    R"(UNIT["Meter",1.0]])";

TEST_F(UnderstandSystem, HeightsOfAPrjHaveNameAndUnit) {
  const std::string heights =
      R"(,VERTCS["NAVD_1988",VDATUM["North_American_Vertical_Datum_1988"],)"
      R"(PARAMETER["Vertical_Shift",0.0],PARAMETER["Direction",1.0],UNIT["Foot_US",0.3048006096]])";
  const SourceInfo info = read_as_prj(kUtm17 + heights);
  EXPECT_EQ(info.georeference.system.epsg, 26917) << "by its parameters: the text has no code";
  EXPECT_EQ(info.georeference.metres_per_unit, 1.0) << "not the heights' unit";
  EXPECT_EQ(info.georeference.system.vertical_datum, "NAVD88 height");
  EXPECT_EQ(info.vertical_unit, "US survey foot");
  EXPECT_EQ(info.metres_per_vertical_unit, 1200.0 / 3937.0);
  EXPECT_TRUE(Crs::parse(kUtm17 + heights)->is_same(*Crs::parse("EPSG:26917")));
}

TEST_F(UnderstandSystem, AnglesThatAreNoDegreesFromGreenwichAreRefused) {
  for (const char* beneath : {R"(PRIMEM["Paris",2.5969213],UNIT["Grad",0.01570796326794897])",
                              R"(PRIMEM["Greenwich",0],UNIT["Grad",0.01570796326794897])",
                              R"(PRIMEM["Paris",2.337229],UNIT["Degree",0.0174532925199433])"}) {
    const std::string wkt =
        R"(GEOGCS["NTF",DATUM["NTF",SPHEROID["Clarke",6378249.2,293.46602]],)" + std::string(beneath) + "]";
    SourceInfo info;
    EXPECT_THAT(std::string(error_of([&] { take_system(wkt, info); }).what()), HasSubstr("gdalwarp"));
    EXPECT_EQ(info.georeference.unit, HorizontalUnit::kUnknown);
  }
}

TEST_F(UnderstandSystem, TakesWhatTheUserNames) {
  SourceInfo info;
  take_system("EPSG:2263+6360", info);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(info.georeference.metres_per_unit, 1200.0 / 3937.0);
  EXPECT_EQ(info.georeference.system.epsg, 2263);
  EXPECT_EQ(info.georeference.system.vertical_epsg, 6360);
  EXPECT_EQ(info.metres_per_vertical_unit, 1200.0 / 3937.0);
  take_system("IAU_2015:49900", info);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(info.georeference.system.body, "Mars");
  EXPECT_FALSE(info.georeference.system.epsg);
  EXPECT_THAT(info.georeference.system.wkt, StartsWith("GEOGCRS[\"Mars"));
  EXPECT_EQ(info.georeference.system.vertical_epsg, 6360) << "nothing was said of heights";
  EXPECT_THAT(std::string(error_of([&] { take_system("EPSG:4807", info); }).what()), HasSubstr("Greenwich"));
  EXPECT_THAT(std::string(error_of([&] { take_system("EPSG:32632+5831", info); }).what()), HasSubstr("depths"));
  EXPECT_THAT(std::string(error_of([&] { take_system("EPSG:5773", info); }).what()),
              HasSubstr("no projected or geographic"));
  EXPECT_THAT(std::string(error_of([&] { take_system("no system", info); }).what()), HasSubstr("does not understand"));
}

TEST_F(UnderstandSystem, OneParameterMakesAnotherSystem) {
  const ReferenceSystem utm = system_of(kUtm17);
  EXPECT_EQ(are_same(utm, system_of("EPSG:26917")), true);
  EXPECT_EQ(are_same(utm, system_of("EPSG:26918")), false);
  EXPECT_EQ(are_same(utm, system_of("EPSG:32617")), false) << "of another datum";
  EXPECT_EQ(are_same(utm, ReferenceSystem{}), std::nullopt);
  const ReferenceSystem laea = system_of("+proj=laea +lat_0=47 +lon_0=11 +ellps=GRS80");
  EXPECT_EQ(are_same(laea, laea), true);
  for (const char* other :
       {"+proj=laea +lat_0=47.0001 +lon_0=11 +ellps=GRS80", "+proj=laea +lat_0=47 +lon_0=11 +x_0=1 +ellps=GRS80",
        "+proj=laea +lat_0=47 +lon_0=11 +ellps=intl", "+proj=laea +lat_0=47 +lon_0=11 +ellps=GRS80 +units=us-ft",
        "+proj=aeqd +lat_0=47 +lon_0=11 +ellps=GRS80"}) {
    EXPECT_EQ(are_same(laea, system_of(other)), false) << other;
  }
}

TEST_F(UnderstandSystem, OnOtherBodiesAnEllipsoidIsADatum) {
  const auto system = [](const std::string& text) {
    ReferenceSystem found;
    found.wkt = Crs::parse(text)->wkt(WktDialect::kWkt2);
    return found;
  };
  const ReferenceSystem mars = system("IAU_2015:49900");
  EXPECT_EQ(are_same(mars, system("+proj=longlat +R=3396190")), true);
  EXPECT_EQ(are_same(mars, system("+proj=longlat +R=3396190 +pm=10")), false);
  EXPECT_EQ(are_same(mars, system("+proj=longlat +a=3396190 +b=3376200")), false);
  EXPECT_EQ(are_same(system("IAU_2015:49910"), system("+proj=eqc +R=3396190")), true);
  EXPECT_EQ(are_same(system("IAU_2015:49910"), system("+proj=eqc +R=3396190 +lon_0=1")), false);
  // On the Earth it is none: Bessel's is that of a dozen.
  EXPECT_EQ(are_same(system("EPSG:4301"), system("EPSG:4289")), false);
}

TEST_F(UnderstandSystem, MapsThatKeysSpellOutAreMapsOfTheirParameters) {
  // Lambert azimuthal equal area, 47 N 11 E, on ETRS89, kilometres; then one parameter less, and an unknown method.
  const auto keys = [](std::uint16_t method, bool has_latitude) {
    GeoTags tags = tags_of({1024,  0,     1,
                            1,     1025,  0,
                            1,     1,     2048,
                            0,     1,     4258,
                            3072,  0,     1,
                            32767, 3074,  0,
                            1,     32767, 3075,
                            0,     1,     method,
                            3076,  0,     1,
                            9036,  3088,  34736,
                            1,     0,     static_cast<std::uint16_t>(has_latitude ? 3089 : 3092),
                            34736, 1,     1});
    tags.doubles = {11.0, has_latitude ? 47.0 : 1.0};
    return place_from_geotiff(tags, 10);
  };
  const GeoTiffPlace laea = keys(10, true);
  EXPECT_TRUE(laea.warnings.empty());
  const auto expected = Crs::parse("+proj=laea +lat_0=47 +lon_0=11 +ellps=GRS80 +units=km");
  expect_near(Crs::parse(laea.georeference.system.wkt)->map_from_geo({12.0, 48.0}),
              expected->map_from_geo({12.0, 48.0}), 1e-9);
  EXPECT_EQ(are_same(laea.georeference.system, keys(10, false).georeference.system), false);
  ASSERT_EQ(keys(99, true).warnings.size(), 1U);
  EXPECT_THAT(keys(99, true).warnings[0].c_str(), HasSubstr("99"));
}
}  // namespace
}  // namespace isohf::test
