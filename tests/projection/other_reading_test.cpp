#include "isohf/projection/other_reading.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace isohf {
namespace {

constexpr MapBounds kZone{400000.0, 4994000.0, 408000.0,
                          5000000.0};  // in UTM zone 32N, 7.73 to 7.83 E, 45.1 to 45.15 N
constexpr MapBounds kDegrees{-118.3, 34.2, -117.9, 34.5};

MapBounds at(double x, double y) {
  return {x, y, x, y};
}

std::vector<PairReading> of_zone() {
  const std::shared_ptr<const ReferenceMap> map = utm_map("EPSG:32632", std::nullopt);
  return {own_reading(kZone, false), geographic_reading([map](GeoPoint place) { return map->map_from_geo(place); })};
}

std::vector<PairReading> of_degrees() {
  const auto same = [](GeoPoint place) { return MapPoint{place.longitude, place.latitude}; };
  return {own_reading(kDegrees, true), geographic_reading(same), utm_reading({-118.1, 34.35}, same)};
}

std::string words(const MapBounds& asked, const MapBounds& covered, const std::vector<PairReading>& readings) {
  const auto other = other_reading(asked, covered, readings);
  return other ? other->words : "";
}

TEST(OtherReading, RecognisesSwappedNumbersAndOtherSystems) {
  EXPECT_EQ(words(at(4997000.0, 404000.0), kZone, of_zone()), "northing, easting");
  EXPECT_EQ(words(at(7.78, 45.12), kZone, of_zone()), "longitude, latitude");
  EXPECT_EQ(words(at(45.12, 7.78), kZone, of_zone()), "latitude, longitude");
  EXPECT_EQ(words(at(34.3, -118.1), kDegrees, of_degrees()), "latitude, longitude");
  EXPECT_EQ(words(at(34.3, 241.9), kDegrees, of_degrees()), "latitude, longitude");
  EXPECT_EQ(words(at(398000.0, 3800000.0), kDegrees, of_degrees()), "easting, northing in UTM zone 11N");
}

TEST(OtherReading, IsNoneWherePlacesLieElsewhere) {
  for (const auto& [x, y] : {std::pair(100.0, 10.0), {0.0, 0.0}, {45.0, 100.0}, {1e9, 1e9}, {5e6, 5e6}}) {
    EXPECT_EQ(words(at(x, y), kZone, of_zone()), "");
    EXPECT_EQ(words(at(x, y), kDegrees, of_degrees()), "");
  }
}

TEST(OtherReading, OfABoxThatLiesInsideAsItIsIsNotTheSwappedOne) {
  // Degrees on a map of a whole body, on which 10 by 20 metres lie as well.
  const MapBounds globe{-5458000.0, -2729000.0, 5458000.0, 2729000.0};
  constexpr double kMetres = 30000.0;
  const std::vector<PairReading> readings = {own_reading(globe, false), geographic_reading([](GeoPoint place) {
                                               return MapPoint{kMetres * place.longitude, kMetres * place.latitude};
                                             })};
  const auto box = other_reading({10.0, 20.0, 40.0, 40.0}, globe, readings);
  ASSERT_TRUE(box);
  EXPECT_EQ(box->words, "longitude, latitude");
  EXPECT_EQ(box->bounds.east, 40.0 * kMetres);
}

TEST(OtherReading, GivesTheBoxToType) {
  const auto box = other_reading({34.25, -118.2, 34.45, -118.0}, kDegrees, of_degrees());
  ASSERT_TRUE(box);
  EXPECT_EQ(box->bounds.west, -118.2);
  EXPECT_EQ(box->bounds.south, 34.25);
  EXPECT_EQ(box->bounds.east, -118.0);
  EXPECT_EQ(box->bounds.north, 34.45);
  // A larger one counts where any part of it lies inside.
  EXPECT_TRUE(other_reading({7.0, 44.5, 8.5, 45.7}, kZone, of_zone()));
}

}  // namespace
}  // namespace isohf
