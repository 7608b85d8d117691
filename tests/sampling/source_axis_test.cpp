#include "isohf/sampling/source/source_axis.h"

#include <gtest/gtest.h>

#include "isohf/error.h"

namespace isohf {
namespace {

TEST(SourceAxis, PutsSamplesWhereTheyLie) {
  const SourceAxis area(10, 15.0, 30.0, Registration::kArea, Outside::kClamp, 60.0);
  EXPECT_DOUBLE_EQ(area.place(15.0).position, 0.0);
  EXPECT_DOUBLE_EQ(area.place(15.0 + 9 * 30.0).position, 9.0);
  EXPECT_DOUBLE_EQ(area.place(30.0).position, 0.5);
  const SourceAxis point(10, 0.0, 30.0, Registration::kPoint, Outside::kClamp, 60.0);
  EXPECT_DOUBLE_EQ(point.place(45.0).position, 1.5);
  EXPECT_FALSE(point.place(45.0).continued);
}

TEST(SourceAxis, TheOuterHalfPixelOfAnAreaIsCoveredGround) {
  for (const Outside outside : {Outside::kCover, Outside::kClamp, Outside::kVoid}) {
    const SourceAxis area(10, 15.0, 30.0, Registration::kArea, outside, 60.0);
    for (const double world : {0.0, 300.0}) {
      const SourceAxis::Place place = area.place(world);
      EXPECT_TRUE(place.has_elevation) << to_string(outside);
      EXPECT_EQ(place.continued, outside != Outside::kClamp) << to_string(outside);
    }
  }
}

TEST(SourceAxis, BeyondTheEndsFollowsTheRule) {
  const auto axis = [](Outside outside) { return SourceAxis(10, 0.0, 1.0, Registration::kPoint, outside, 2.5); };
  EXPECT_DOUBLE_EQ(axis(Outside::kClamp).place(-3.0).position, 0.0);
  EXPECT_DOUBLE_EQ(axis(Outside::kClamp).place(40.0).position, 9.0);
  EXPECT_FALSE(axis(Outside::kClamp).place(40.0).continued);
  const SourceAxis::Place near = axis(Outside::kCover).place(-1.25);
  EXPECT_TRUE(near.continued);
  EXPECT_DOUBLE_EQ(near.edge, 0.0);
  EXPECT_DOUBLE_EQ(near.position, 1.25);
  const SourceAxis::Place far = axis(Outside::kCover).place(40.0);
  EXPECT_DOUBLE_EQ(far.edge, 9.0);
  EXPECT_DOUBLE_EQ(far.position, 6.5) << "level after 2.5 samples";
  EXPECT_FALSE(axis(Outside::kVoid).place(-3.0).has_elevation);
  EXPECT_FALSE(axis(Outside::kVoid).place(9.001).has_elevation);
  EXPECT_TRUE(axis(Outside::kVoid).place(9.0).has_elevation);
}

TEST(Outside, NamesRoundTripAndOthersAreRefused) {
  for (const Outside outside : {Outside::kCover, Outside::kClamp, Outside::kVoid}) {
    EXPECT_EQ(outside_from_string(to_string(outside)), outside);
  }
  EXPECT_THROW((void)outside_from_string("crop"), Error);
}

}  // namespace
}  // namespace isohf
