#include "reading/hud.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "memory_tiles.h"
#include "reading/place.h"

namespace isohf::view {
namespace {

TEST(Hud, RoundsLengthsDownToOneTwoAndFive) {
  EXPECT_DOUBLE_EQ(round_length(1.0), 1.0);
  EXPECT_DOUBLE_EQ(round_length(1.99), 1.0);
  EXPECT_DOUBLE_EQ(round_length(4999.0), 2000.0);
  EXPECT_DOUBLE_EQ(round_length(5000.0), 5000.0);
  EXPECT_DOUBLE_EQ(round_length(0.07), 0.05);
}

TEST(Hud, WritesLengthsAsPeopleDo) {
  EXPECT_EQ(describe_length(500.0, "metre"), "500 m");
  EXPECT_EQ(describe_length(20000.0, "metre"), "20 km");
  EXPECT_EQ(describe_length(0.5, "degree"), "0.5 degree");
  EXPECT_EQ(describe_length(3.0, ""), "3 world units");
  EXPECT_EQ(describe_length(31146.6, "metre"), "31.147 km");
  EXPECT_EQ(describe_length(40.0, "foot"), "40 ft");
}

TEST(Hud, BlendsColoursBetweenStopsAndKeepsThemSharpAtDoubledOnes) {
  const std::vector<ColourStop> stops{{-10.0, 0, 0, 0}, {0.0, 0, 0, 255}, {0.0, 0, 255, 0}, {10.0, 255, 255, 255}};
  EXPECT_FLOAT_EQ(colour_at(stops, -5.0).blue, 0.5F);
  EXPECT_FLOAT_EQ(colour_at(stops, -20.0).blue, 0.0F);
  EXPECT_FLOAT_EQ(colour_at(stops, 0.0).green, 1.0F);
  EXPECT_FLOAT_EQ(colour_at(stops, 0.0).blue, 0.0F);
  EXPECT_FLOAT_EQ(colour_at(stops, 99.0).red, 1.0F);
}

TEST(Hud, TellsHoursOnItsSliderAlone) {
  EXPECT_FALSE(Hud::slider_hours(640.0, 100.0, 1280, 720, 1.0));
  const auto noon = Hud::slider_hours(640.0, 692.0, 1280, 720, 1.0);
  ASSERT_TRUE(noon);
  EXPECT_NEAR(*noon, 12.0, 0.01);
  EXPECT_LT(*Hud::slider_hours(500.0, 692.0, 1280, 720, 1.0), 8.0);
}

TEST(Place, HasTheHeightsOfTheTriangles) {
  const test::MemoryTiles source(TileGrid::make(TileShape::make(12, 11, 3), 3, 2, 100.0, 100.0));
  Ground ground(source);
  const double height = *ground.height({123.0, 45.0});
  const Place place = source.describe({123.0, 45.0}, height);
  EXPECT_DOUBLE_EQ(place.elevation, height);
  EXPECT_EQ(json_of(place).at("elevation").get<double>(), height) << "rounded is what people read";
  const Profile profile = profile_between(source, ground, {10.0, 10.0}, {250.0, 190.0});
  EXPECT_DOUBLE_EQ(profile.length, 300.0);
  EXPECT_DOUBLE_EQ(profile.heights.front(), *ground.height({10.0, 10.0}));
  EXPECT_DOUBLE_EQ(profile.heights.back(), *ground.height({250.0, 190.0}));
}

TEST(Place, IsNamedInAllItsWays) {
  Place place{{10.0, 20.0}, 12.345, "metre", 1, MapPoint{500000.0, 4000000.0}, GeoPoint{-70.5, -33.25}};
  const std::vector<std::string> lines = lines_of(place);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0], "x 10  z 20  elevation 12.3 m");
  EXPECT_EQ(lines[1], "E 500000.00  N 4000000.00");
  EXPECT_EQ(lines[2], "33.250000 S  70.500000 W");
  place.at = {10862717.93, 0.125};
  EXPECT_EQ(lines_of(place)[0], "x 10862718  z 0.125  elevation 12.3 m");
}

}  // namespace
}  // namespace isohf::view
