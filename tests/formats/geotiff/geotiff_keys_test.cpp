#include "formats/geotiff/geotiff_keys.h"
#include "isohf/projection/body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "isohf/error.h"
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

constexpr std::uint16_t kModel = 1024;
constexpr std::uint16_t kRaster = 1025;

TEST(GeoTiffPlace, TiePointNamesACornerOfAreasAndTheSampleOfPoints) {
  GeoTiffPlace place = place_from_geotiff(Keys().code(kModel, 1).code(kRaster, 1).placed(), 100);
  EXPECT_EQ(place.georeference.registration, Registration::kArea);
  EXPECT_EQ(place.georeference.origin_x, 1005);
  EXPECT_EQ(place.georeference.origin_y, 1990);
  place = place_from_geotiff(Keys().code(kModel, 1).code(kRaster, 2).placed(), 100);
  EXPECT_EQ(place.georeference.registration, Registration::kPoint);
  EXPECT_EQ(place.georeference.origin_x, 1000);
  EXPECT_EQ(place.georeference.origin_y, 2000);
  // Without the key the standard means areas.
  place = place_from_geotiff(Keys().code(kModel, 1).placed(), 100);
  EXPECT_EQ(place.georeference.registration, Registration::kArea);
}

TEST(GeoTiffPlace, TiePointMayLieAnywhereInTheRaster) {
  GeoTags tags = Keys().code(kModel, 1).code(kRaster, 2).placed();
  tags.tiepoints = {3, 5, 0, 1000, 2000, 0};
  const GeoTiffPlace place = place_from_geotiff(tags, 100);
  EXPECT_EQ(place.georeference.origin_x, 970);
  EXPECT_EQ(place.georeference.origin_y, 2100);
}

TEST(GeoTiffPlace, TransformationEqualsScaleAndTiePoint) {
  for (const std::uint16_t raster : {std::uint16_t{1}, std::uint16_t{2}}) {
    GeoTags tags = Keys().code(kModel, 1).code(kRaster, raster).placed();
    const Georeference by_scale = place_from_geotiff(tags, 100).georeference;
    tags.pixel_scale.clear();
    tags.tiepoints.clear();
    tags.transformation = {10, 0, 0, 1000, 0, -20, 0, 2000, 0, 0, 0, 0, 0, 0, 0, 1};
    const Georeference by_matrix = place_from_geotiff(tags, 100).georeference;
    EXPECT_EQ(test::grid_of(by_scale), test::grid_of(by_matrix));
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

TEST(GeoTiffPlace, CodesAreNumbersOnlyWhereDefined) {
  EXPECT_EQ(place_from_geotiff(Keys().code(kModel, 1).code(3072, 32632).placed(), 9).georeference.system.epsg, 32632);
  EXPECT_EQ(place_from_geotiff(Keys().code(kModel, 2).code(2048, 4326).placed(), 9).georeference.system.epsg, 4326);
  EXPECT_FALSE(place_from_geotiff(Keys().code(kModel, 1).code(3072, 32767).placed(), 9).georeference.system.epsg);
  EXPECT_FALSE(place_from_geotiff(Keys().code(kModel, 2).code(2048, 0).placed(), 9).georeference.system.epsg);
  // The code of a projected system's base is not that of the raster.
  EXPECT_FALSE(place_from_geotiff(Keys().code(kModel, 1).code(2048, 4258).code(3072, 32767).placed(), 9)
                   .georeference.system.epsg);
}

TEST(GeoTiffPlace, LinearUnitsBecomeMetres) {
  const auto unit = [](Keys keys) { return place_from_geotiff(keys.code(kModel, 1).placed(), 9).georeference; };
  EXPECT_EQ(unit(Keys()).unit, HorizontalUnit::kMetre);
  EXPECT_EQ(unit(Keys().code(3076, 9001)).metres_per_unit, 1.0);
  EXPECT_EQ(unit(Keys().code(3076, 9002)).metres_per_unit, 0.3048);
  EXPECT_EQ(unit(Keys().code(3076, 9003)).metres_per_unit, 1200.0 / 3937.0);
  EXPECT_EQ(unit(Keys().code(3076, 32767).real(3077, 1000.0)).metres_per_unit, 1000.0);
  EXPECT_EQ(unit(Keys().code(3076, 9999)).unit, HorizontalUnit::kUnknown);
}

TEST(GeoTiffPlace, AnglesBecomeDegrees) {
  const auto spacing = [](Keys keys) {
    const Georeference geo = place_from_geotiff(keys.code(kModel, 2).placed(), 9).georeference;
    return geo.unit == HorizontalUnit::kDegree ? geo.spacing_x : -1.0;
  };
  EXPECT_EQ(spacing(Keys()), 10.0);
  EXPECT_EQ(spacing(Keys().code(2054, 9102)), 10.0);
  EXPECT_EQ(spacing(Keys().code(2054, 9104)), 10.0 / 3600.0);
  EXPECT_EQ(spacing(Keys().code(2054, 9101)), 10.0 * 180.0 / std::numbers::pi);
  EXPECT_EQ(spacing(Keys().code(2054, 32767).real(2055, std::numbers::pi / 180.0)), 10.0);
  EXPECT_EQ(spacing(Keys().code(2054, 9999)), -1.0);
}

TEST(GeoTiffPlace, KeysTellTheKindOfAModelOfOnesOwn) {
  // What gdal_translate -co GEOTIFF_KEYS_FLAVOR=ESRI_PE writes.
  GeoTiffPlace place = place_from_geotiff(Keys().code(kModel, 32767).code(3072, 32611).code(3076, 9001).placed(), 100);
  EXPECT_EQ(place.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(place.georeference.system.epsg, 32611);
  place = place_from_geotiff(Keys().code(kModel, 32767).code(2048, 4326).placed(), 100);
  EXPECT_EQ(place.georeference.unit, HorizontalUnit::kDegree);
  place = place_from_geotiff(Keys().code(kModel, 32767).placed(), 100);
  EXPECT_EQ(place.georeference.unit, HorizontalUnit::kUnknown);
}

TEST(GeoTiffPlace, LocalSystemsAreMissedAloud) {
  // What GDAL writes of LOCAL_CS.
  const GeoTiffPlace local =
      place_from_geotiff(Keys().code(kRaster, 1).text(1026, "Mine grid").code(3076, 9001).placed(), 100);
  ASSERT_EQ(local.warnings.size(), 1U);
  EXPECT_EQ(local.warnings[0].kind, Warning::Kind::kLoss);
  EXPECT_NE(local.warnings[0].find("\"Mine grid\" is neither a map nor degrees"), std::string::npos);
  // Nothing but how samples lie is no system.
  EXPECT_TRUE(place_from_geotiff(Keys().code(kRaster, 1).placed(), 100).warnings.empty());
}

TEST(GeoTiffPlace, EllipsoidsTellTheBody) {
  const auto system = [](Keys keys) { return place_from_geotiff(keys.placed(), 9).georeference.system; };
  EXPECT_EQ(system(Keys().code(kModel, 2).real(2057, 3396190.0).real(2058, 3396190.0)).body, "Mars");
  EXPECT_EQ(system(Keys().code(kModel, 2).real(2057, 3396190.0).real(2058, 3396190.0)).inverse_flattening, 0.0);
  EXPECT_EQ(system(Keys().code(kModel, 2).real(2057, 1737400.0)).body, "Moon");
  EXPECT_EQ(system(Keys().code(kModel, 2).text(2049, "GCS_Moon_2000")).body, "Moon");
  EXPECT_EQ(system(Keys().code(kModel, 2).code(2048, 4326)).semi_major_axis_m, 6378137.0);
  EXPECT_EQ(system(Keys().code(kModel, 1).code(3072, 27700)).body, "Earth");
  EXPECT_EQ(system(Keys().code(kModel, 2)).body, "");
  EXPECT_EQ(system(Keys().code(kModel, 2).text(2049, "Marshall Islands")).body, "");
}

TEST(GeoTiffPlace, NamesComeFromCitations) {
  const auto name = [](Keys keys) { return place_from_geotiff(keys.placed(), 9).georeference.system; };
  EXPECT_EQ(name(Keys().code(kModel, 1).text(1026, "UTM 32").text(2049, "WGS 84")).name, "UTM 32");
  EXPECT_EQ(name(Keys().code(kModel, 2).text(2049, "GCS Name = GCS_Mars|Datum = D_Mars|")).name, "GCS_Mars");
  const ReferenceSystem esri = name(Keys().code(kModel, 1).text(3073, "ESRI PE String = PROJCS[\"Moon_Eq\",UNIT[]]"));
  EXPECT_EQ(esri.name, "Moon_Eq");
  EXPECT_EQ(esri.wkt, "PROJCS[\"Moon_Eq\",UNIT[]]");
}

TEST(GeoTiffPlace, VerticalKeysAreCarried) {
  const GeoTiffPlace place = place_from_geotiff(Keys().code(kModel, 2).code(4096, 5703).code(4099, 9003).placed(), 9);
  EXPECT_EQ(place.georeference.system.vertical_epsg, 5703);
  EXPECT_EQ(place.georeference.system.vertical_datum, "NAVD88");
  EXPECT_EQ(place.vertical_unit, "US survey foot");
  EXPECT_EQ(place.metres_per_vertical_unit, 1200.0 / 3937.0);
}

TEST(GeoTiffPlace, GroundControlPointsAreNotGuessedFrom) {
  GeoTags tags;
  tags.tiepoints = {0, 0, 0, 5, 6, 0, 9, 9, 0, 14, 15, 0};
  const GeoTiffPlace place = place_from_geotiff(tags, 10);
  EXPECT_FALSE(place.placed);
  EXPECT_FALSE(place.georeference.has_origin);
  EXPECT_EQ(place.warnings.size(), 1U);
  tags.pixel_scale = {1, 1, 0};
  tags.tiepoints.clear();
  EXPECT_TRUE(place_from_geotiff(tags, 10).placed);
  EXPECT_FALSE(place_from_geotiff(tags, 10).georeference.has_origin);
}

TEST(GeoTiffPlace, MalformedKeysAreRefusedOrGiveAPlace) {
  std::mt19937 random(7);
  int refused = 0;
  int placed = 0;
  for (int i = 0; i < 20000; ++i) {
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
  EXPECT_GT(placed, 1000);
  EXPECT_GT(refused, 100);
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
