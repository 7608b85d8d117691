#include "isohf/surface/source_axis.h"

#include <gtest/gtest.h>

#include "isohf/base/error.h"

namespace isohf {
namespace {

TEST(SourceAxis, PutsSamplesWhereTheyLie) {
  const SourceAxis area(10, 15.0, 30.0, Registration::kArea, Outside::kClamp);
  EXPECT_DOUBLE_EQ(area.position(15.0), 0.0);
  EXPECT_DOUBLE_EQ(area.position(15.0 + 9 * 30.0), 9.0);
  EXPECT_DOUBLE_EQ(area.position(30.0), 0.5);
  const SourceAxis point(10, 0.0, 30.0, Registration::kPoint, Outside::kClamp);
  EXPECT_DOUBLE_EQ(point.position(45.0), 1.5);
}

TEST(SourceAxis, AreaTakesTheEdgeValueInTheOuterHalfPixelWhateverLiesOutside) {
  for (const Outside outside : {Outside::kCover, Outside::kClamp, Outside::kVoid}) {
    const SourceAxis area(10, 15.0, 30.0, Registration::kArea, outside);
    EXPECT_DOUBLE_EQ(area.position(0.0), 0.0) << to_string(outside);
    EXPECT_DOUBLE_EQ(area.position(300.0), 9.0) << to_string(outside);
    EXPECT_TRUE(area.has_elevation(0.0));
    EXPECT_TRUE(area.has_elevation(300.0));
  }
}

TEST(SourceAxis, BeyondTheEndsFollowsTheRule) {
  const auto axis = [](Outside outside) { return SourceAxis(10, 0.0, 1.0, Registration::kPoint, outside); };
  EXPECT_DOUBLE_EQ(axis(Outside::kClamp).position(-3.0), 0.0);
  EXPECT_DOUBLE_EQ(axis(Outside::kClamp).position(40.0), 9.0);
  EXPECT_DOUBLE_EQ(axis(Outside::kCover).position(-3.25), -3.25);
  EXPECT_DOUBLE_EQ(axis(Outside::kCover).position(12.5), 12.5);
  EXPECT_TRUE(axis(Outside::kClamp).has_elevation(-3.0));
  EXPECT_TRUE(axis(Outside::kCover).has_elevation(-3.0));
  EXPECT_FALSE(axis(Outside::kVoid).has_elevation(-3.0));
  EXPECT_FALSE(axis(Outside::kVoid).has_elevation(9.001));
  EXPECT_TRUE(axis(Outside::kVoid).has_elevation(9.0));
}

TEST(Outside, NamesRoundTripAndOthersAreRefused) {
  for (const Outside outside : {Outside::kCover, Outside::kClamp, Outside::kVoid}) {
    EXPECT_EQ(outside_from_string(to_string(outside)), outside);
  }
  EXPECT_THROW((void)outside_from_string("crop"), Error);
}

}  // namespace
}  // namespace isohf
