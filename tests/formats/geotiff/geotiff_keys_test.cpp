#include "formats/geotiff/geotiff_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"
#include "support/error_of.h"
#include "support/rasters/place_at.h"

namespace isohf {
namespace {

/// A directory of keys; reals and texts go to their tags.
class Keys {
 public:
  Keys() { tags_.directory = {1, 1, 0, 0}; }
  Keys& code(std::uint16_t key, std::uint16_t value) { return add({key, 0, 1, value}); }
  Keys& real(std::uint16_t key, double value) {
    tags_.doubles.push_back(value);
    return add({key, 34736, 1, static_cast<std::uint16_t>(tags_.doubles.size() - 1)});
  }
  Keys& text(std::uint16_t key, const std::string& value) {
    const auto begin = static_cast<std::uint16_t>(tags_.ascii.size());
    tags_.ascii += value + '|';
    return add({key, 34737, static_cast<std::uint16_t>(value.size() + 1), begin});
  }
  GeoTags placed() {
    tags_.pixel_scale = {10, 20, 0};
    tags_.tiepoints = {0, 0, 0, 1000, 2000, 0};
    return tags_;
  }

 private:
  Keys& add(const std::vector<std::uint16_t>& entry) {
    tags_.directory.insert(tags_.directory.end(), entry.begin(), entry.end());
    ++tags_.directory[3];
    return *this;
  }
  GeoTags tags_;
};

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint16_t kModel = 1024;
constexpr std::uint16_t kRaster = 1025;
constexpr std::uint16_t kUserDefined = 32767;

GeoTiffPlace place_of(Keys keys) {
  return place_from_geotiff(keys.placed(), 100);
}

/// Where the system of some keys has a place of the map, in degrees.
GeoPoint degrees_of(const Keys& keys, MapPoint at) {
  const GeoTiffPlace place = place_of(keys);
  EXPECT_TRUE(place.warnings.empty()) << place.warnings.front();
  return Crs::parse(system_text(place.georeference.system))->geo_from_map(at);
}

TEST(GeoTiffPlace, TiePointNamesACornerOfAreasAndTheSampleOfPoints) {
  struct Row {
    std::uint16_t raster;  // 0: no key, which the standard reads as areas
    std::vector<double> tie;
    Registration registration;
    double x;
    double y;
  };
  for (const Row& row : {Row{1, {0, 0, 0, 1000, 2000, 0}, Registration::kArea, 1005, 1990},
                         Row{2, {0, 0, 0, 1000, 2000, 0}, Registration::kPoint, 1000, 2000},
                         Row{0, {0, 0, 0, 1000, 2000, 0}, Registration::kArea, 1005, 1990},
                         Row{2, {3, 5, 0, 1000, 2000, 0}, Registration::kPoint, 970, 2100}}) {
    Keys keys = Keys().code(kModel, 1);
    if (row.raster != 0) keys.code(kRaster, row.raster);
    GeoTags tags = keys.placed();
    tags.tiepoints = row.tie;
    const Georeference by_scale = place_from_geotiff(tags, 100).georeference;
    EXPECT_EQ(by_scale.registration, row.registration);
    EXPECT_THAT(test::grid_of(by_scale), ElementsAre(row.x, row.y, 10, 20));
    tags.pixel_scale.clear();
    tags.tiepoints.clear();
    tags.transformation = {
        10, 0, 0, row.tie[3] - 10 * row.tie[0], 0, -20, 0, row.tie[4] + 20 * row.tie[1], 0, 0, 0, 0, 0, 0, 0, 1};
    EXPECT_EQ(test::grid_of(place_from_geotiff(tags, 100).georeference), test::grid_of(by_scale));
  }
}

TEST(GeoTiffPlace, RowsFromTheSouthAreCountedFromTheNorth) {
  GeoTags tags = Keys().code(kModel, 1).code(kRaster, 2).placed();
  tags.pixel_scale.clear();
  tags.transformation = {10, 0, 0, 1000, 0, 20, 0, 2000, 0, 0, 0, 0, 0, 0, 0, 1};
  const GeoTiffPlace place = place_from_geotiff(tags, 11);
  EXPECT_TRUE(place.rows_from_south);
  EXPECT_EQ(place.georeference.spacing_y, 20);
  EXPECT_EQ(place.georeference.origin_y, 2200);
}

TEST(GeoTiffPlace, SystemsHaveTheCodesAndUnitsOfTheirKeys) {
  struct Row {
    Keys keys;
    std::optional<int> epsg;
    HorizontalUnit unit;
    double metres_per_unit;
  };
  const auto us_foot = 1200.0 / 3937.0;
  const auto map = [](std::uint16_t code) { return Keys().code(kModel, 1).code(3072, code); };
  for (const Row& row :
       {Row{map(32632), 32632, HorizontalUnit::kMetre, 1.0}, Row{map(2263), 2263, HorizontalUnit::kMetre, us_foot},
        Row{map(2222), 2222, HorizontalUnit::kMetre, 0.3048},
        Row{map(32632).code(3076, 9003), 32632, HorizontalUnit::kMetre, us_foot},
        Row{Keys().code(kModel, 2).code(2048, 4326), 4326, HorizontalUnit::kDegree, 1.0},
        Row{map(kUserDefined), {}, HorizontalUnit::kMetre, 1.0},
        Row{Keys().code(kModel, 2).code(2048, 0), {}, HorizontalUnit::kDegree, 1.0},
        // The code of a map's base is not that of the raster.
        Row{map(kUserDefined).code(2048, 4258), {}, HorizontalUnit::kMetre, 1.0},
        // gdal_translate -co GEOTIFF_KEYS_FLAVOR=ESRI_PE
        Row{Keys().code(kModel, kUserDefined).code(3072, 32611).code(3076, 9001), 32611, HorizontalUnit::kMetre, 1.0},
        Row{Keys().code(kModel, kUserDefined), {}, HorizontalUnit::kUnknown, 1.0},
        Row{Keys().code(kModel, 1).code(3076, 9002), {}, HorizontalUnit::kMetre, 0.3048},
        Row{Keys().code(kModel, 1).code(3076, 9036), {}, HorizontalUnit::kMetre, 1000.0},
        Row{Keys().code(kModel, 1).code(3076, kUserDefined).real(3077, 500.0), {}, HorizontalUnit::kMetre, 500.0},
        Row{Keys().code(kModel, 1).code(3076, 9999), {}, HorizontalUnit::kUnknown, 1.0}}) {
    const Georeference place = place_of(row.keys).georeference;
    EXPECT_EQ(place.system.epsg, row.epsg);
    EXPECT_EQ(place.unit, row.unit);
    EXPECT_EQ(place.metres_per_unit, row.metres_per_unit);
  }
}

TEST(GeoTiffPlace, AnglesBecomeDegrees) {
  const auto spacing = [](const Keys& keys) {
    const Georeference geo = place_of(keys).georeference;
    return geo.unit == HorizontalUnit::kDegree ? geo.spacing_x : -1.0;
  };
  const auto keys = [] { return Keys().code(kModel, 2); };
  EXPECT_EQ(spacing(keys()), 10.0);
  EXPECT_EQ(spacing(keys().code(2054, 9102)), 10.0);
  EXPECT_EQ(spacing(keys().code(2048, 4326).code(2054, 9104)), 10.0 / 3600.0);
  EXPECT_EQ(spacing(keys().code(2054, 9105)), 9.0);
  EXPECT_EQ(spacing(keys().code(2054, 9101)), 10.0 * 180.0 / std::numbers::pi);
  EXPECT_EQ(spacing(keys().code(2054, kUserDefined).real(2055, std::numbers::pi / 180.0)), 10.0);
  EXPECT_EQ(spacing(keys().code(2054, 9999)), -1.0);
}

TEST(GeoTiffPlace, LocalSystemsAndUnknownCodesAreLosses) {
  // GDAL's keys of a LOCAL_CS.
  const GeoTiffPlace local = place_of(Keys().code(kRaster, 1).text(1026, "Mine grid").code(3076, 9001));
  ASSERT_EQ(local.warnings.size(), 1U);
  EXPECT_EQ(local.warnings[0].kind, Warning::Kind::kLoss);
  EXPECT_THAT(local.warnings[0], HasSubstr("\"Mine grid\" is neither a map nor degrees"));
  const GeoTiffPlace unknown = place_of(Keys().code(kModel, 1).code(3072, 1).code(3076, 9002));
  ASSERT_EQ(unknown.warnings.size(), 1U);
  EXPECT_THAT(unknown.warnings[0], HasSubstr("EPSG:1"));
  EXPECT_EQ(unknown.georeference.metres_per_unit, 0.3048);
  // Nothing but how samples lie is not a system.
  EXPECT_TRUE(place_of(Keys().code(kRaster, 1)).warnings.empty());
}

TEST(GeoTiffPlace, EllipsoidsTellTheBodyInTheirUnit) {
  const auto system = [](const Keys& keys) { return place_of(keys).georeference.system; };
  const auto degrees = [] { return Keys().code(kModel, 2); };
  const ReferenceSystem mars = system(degrees().real(2057, 3396190.0).real(2058, 3396190.0));
  EXPECT_EQ(mars.body, "Mars");
  EXPECT_EQ(mars.inverse_flattening, 0.0);
  EXPECT_EQ(system(degrees().real(2057, 1737400.0)).body, "Moon");
  EXPECT_EQ(system(degrees().text(2049, "GCS_Moon_2000")).body, "Moon");
  EXPECT_EQ(system(degrees().code(2048, 4326)).semi_major_axis_m, 6378137.0);
  EXPECT_EQ(system(Keys().code(kModel, 1).code(3072, 27700)).body, "Earth");
  EXPECT_EQ(system(degrees()).body, "");
  EXPECT_EQ(system(degrees().text(2049, "Marshall Islands")).body, "");
  // Clarke 1858 in Clarke's feet; then metres in a file whose unit is the foot.
  const ReferenceSystem clarke = system(degrees().code(2052, 9005).real(2057, 20926348.0).real(2059, 294.26));
  EXPECT_NEAR(*clarke.semi_major_axis_m, 6378293.6, 0.1);
  EXPECT_EQ(clarke.body, "Earth");
  EXPECT_EQ(*system(degrees().code(2052, 9002).real(2057, 6378137.0).real(2059, 298.25)).semi_major_axis_m, 6378137.0);
}

TEST(GeoTiffPlace, NamesComeFromSystemsAndCitations) {
  const auto name = [](const Keys& keys) { return place_of(keys).georeference.system.name; };
  EXPECT_EQ(name(Keys().code(kModel, 1).text(1026, "UTM 32").text(2049, "WGS 84")), "UTM 32");
  EXPECT_EQ(name(Keys().code(kModel, 1).code(3072, 32632).text(1026, "zone")), "WGS 84 / UTM zone 32N");
  EXPECT_EQ(name(Keys().code(kModel, 2).text(2049, "GCS Name = GCS_Mars|Datum = D_Mars|").real(2057, 3396190.0)),
            "GCS_Mars");
}

TEST(GeoTiffPlace, MapsAreSpelledOutByKeys) {
  // Lambert's conic of France in metres, on Clarke's ellipsoid, from Paris by code, by its longitude, and from Greenwich.
  const auto conic = [] {
    return Keys().code(kModel, 1).code(kRaster, 1).code(2048, kUserDefined).code(2050, kUserDefined);
  };
  const auto parameters = [](Keys keys, double longitude) {
    keys.real(2057, 6378249.2).real(2058, 6356515.0).code(3072, kUserDefined).code(3074, kUserDefined);
    return keys.code(3075, 9)
        .code(3076, 9001)
        .real(3080, longitude)
        .real(3081, 46.8)
        .real(3082, 600000.0)
        .real(3083, 2200000.0)
        .real(3092, 0.99987742);
  };
  const MapPoint centre{600000.0, 2200000.0};
  for (const Keys& keys :
       {parameters(conic().code(2051, 8903), 0.0),
        parameters(conic().code(2051, kUserDefined).real(2061, 2.33722917), 0.0), parameters(conic(), 2.33722917)}) {
    const GeoPoint found = degrees_of(keys, centre);
    EXPECT_NEAR(found.longitude, 2.33722917, 1e-7);
    EXPECT_NEAR(found.latitude, 46.8, 1e-9);
  }
  // The zone of UTM by its number, in feet.
  const GeoPoint utm =
      degrees_of(Keys().code(kModel, 1).code(2048, 4326).code(3072, kUserDefined).code(3074, 16032).code(3076, 9002),
                 {500000.0 / 0.3048, 0.0});
  EXPECT_NEAR(utm.longitude, 9.0, 1e-9);
  EXPECT_NEAR(utm.latitude, 0.0, 1e-9);
  const GeoTiffPlace unknown = place_of(
      Keys().code(kModel, 1).code(2048, 4326).code(3072, kUserDefined).code(3074, kUserDefined).code(3075, 99));
  ASSERT_EQ(unknown.warnings.size(), 1U);
  EXPECT_THAT(unknown.warnings[0], HasSubstr("99"));
}

TEST(GeoTiffPlace, SystemsThatAreNotReadAreRefused) {
  const auto code = [](const Keys& keys) { return test::error_of([&] { (void)place_of(keys); }).code(); };
  EXPECT_EQ(code(Keys().code(kModel, 2).code(2048, 4807)), ErrorCode::kUnsupported);  // grads from Paris
  EXPECT_EQ(code(Keys().code(kModel, 2).code(2051, 8903).real(2057, 6378249.2)), ErrorCode::kUnsupported);
  EXPECT_EQ(code(Keys().code(kModel, 1).code(3072, 2053)), ErrorCode::kUnsupported);  // counts westings
}

TEST(GeoTiffPlace, VerticalKeysAreCarried) {
  const GeoTiffPlace place = place_of(Keys().code(kModel, 2).code(4096, 5703).code(4099, 9003));
  EXPECT_EQ(place.georeference.system.vertical_epsg, 5703);
  EXPECT_EQ(place.georeference.system.vertical_datum, "NAVD88 height");
  EXPECT_EQ(place.vertical_unit, "US survey foot");
  EXPECT_EQ(place.metres_per_vertical_unit, 1200.0 / 3937.0);
  EXPECT_EQ(place_of(Keys().code(kModel, 2).code(4096, 5030)).georeference.system.vertical_datum, "the ellipsoid");
}

TEST(GeoTiffPlace, PixelScaleAndTiePointScaleElevations) {
  struct Row {
    bool has_heights;
    double scale;
    double tie_z;
    double tie_k;
    double z_scale;
    double z_offset;
    std::size_t warnings;
  };
  for (const Row& row : {Row{true, 0.01, 50, 0, 0.01, 50, 0}, Row{true, 0.5, 10, 3, 0.5, 8.5, 0},
                         Row{true, 0, 0, 0, 1, 0, 0}, Row{true, 1, 0, 0, 1, 0, 0}, Row{true, 0, 50, 0, 1, 0, 1},
                         Row{false, 0.01, 50, 0, 1, 0, 1}, Row{false, 1, 0, 0, 1, 0, 0}}) {
    Keys keys = Keys().code(kModel, 1).code(3072, 32632);
    if (row.has_heights) keys.code(4096, 5773);
    GeoTags tags = keys.placed();
    tags.pixel_scale[2] = row.scale;
    tags.tiepoints[2] = row.tie_k;
    tags.tiepoints[5] = row.tie_z;
    const GeoTiffPlace place = place_from_geotiff(tags, 100);
    EXPECT_EQ(place.z_scale, row.z_scale);
    EXPECT_EQ(place.z_offset, row.z_offset);
    EXPECT_EQ(place.warnings.size(), row.warnings);
  }
}

TEST(GeoTiffPlace, GroundControlPointsAreNotGuessedFrom) {
  GeoTags tags;
  tags.tiepoints = {0, 0, 0, 5, 6, 0, 9, 9, 0, 14, 15, 0};
  const GeoTiffPlace place = place_from_geotiff(tags, 10);
  EXPECT_FALSE(place.georeference.has_origin);
  EXPECT_EQ(place.warnings.size(), 1U);
  tags.pixel_scale = {1, 1, 0};
  tags.tiepoints.clear();
  EXPECT_FALSE(place_from_geotiff(tags, 10).georeference.has_origin);
}

TEST(GeoTiffPlace, MalformedKeysAreRefusedOrGiveAPlace) {
  std::mt19937 random(7);
  int refused = 0;
  int placed = 0;
  for (int i = 0; i < 3000; ++i) {
    GeoTags tags = Keys().code(kModel, 2).code(2048, 4326).real(2057, 6378137.0).text(2049, "WGS 84").placed();
    const std::size_t at = random() % tags.directory.size();
    tags.directory[at] = static_cast<std::uint16_t>(random());
    tags.directory.resize(random() % (tags.directory.size() + 1));
    if (random() % 4 == 0) tags.doubles.clear();
    if (random() % 4 == 0) tags.ascii.clear();
    if (random() % 4 == 0) tags.pixel_scale.resize(random() % 4);
    if (random() % 4 == 0) tags.tiepoints.resize(random() % 7);
    if (random() % 4 == 0) tags.transformation.resize(random() % 17, 1.0);
    try {
      const Georeference place = place_from_geotiff(tags, 10).georeference;
      ASSERT_TRUE(place.spacing_x > 0.0 && std::isfinite(place.spacing_x)) << i;
      ASSERT_TRUE(place.spacing_y > 0.0 && std::isfinite(place.spacing_y)) << i;
      ASSERT_TRUE(std::isfinite(place.origin_x) && std::isfinite(place.origin_y)) << i;
      placed += place.has_origin ? 1 : 0;
    } catch (const Error& error) {
      ASSERT_NE(error.code(), ErrorCode::kIo) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(placed, 100);
  EXPECT_GT(refused, 10);
}

TEST(BodyOf, PrefersTheNameToTheSize) {
  EXPECT_EQ(body_of("D_Moon_2000", 6378137.0), "Moon");
  EXPECT_EQ(body_of("Lunar polar", std::nullopt), "Moon");
  EXPECT_EQ(body_of("", 6377397.155), "Earth");
  EXPECT_EQ(body_of("", 0.0), "");
  EXPECT_EQ(body_of("", 1.0e6), "");
}

}  // namespace
}  // namespace isohf
