#include "isohf/sampling/source/source_axis.h"

#include <gtest/gtest.h>

namespace isohf {
namespace {

TEST(SourceAxis, PutsSamplesWhereTheyLie) {
  const SourceAxis area(10, 15.0, 30.0, Registration::kArea, 60.0);
  EXPECT_DOUBLE_EQ(area.place(15.0).position, 0.0);
  EXPECT_DOUBLE_EQ(area.place(15.0 + 9 * 30.0).position, 9.0);
  EXPECT_DOUBLE_EQ(area.place(30.0).position, 0.5);
  const SourceAxis point(10, 0.0, 30.0, Registration::kPoint, 60.0);
  EXPECT_DOUBLE_EQ(point.place(45.0).position, 1.5);
  EXPECT_FALSE(point.place(45.0).continued);
}

TEST(SourceAxis, TheOuterHalfPixelOfAnAreaIsCoveredGround) {
  const SourceAxis area(10, 15.0, 30.0, Registration::kArea, 60.0);
  EXPECT_DOUBLE_EQ(area.end_world(), 300.0);
  EXPECT_DOUBLE_EQ(SourceAxis(10, 15.0, 30.0, Registration::kPoint, 60.0).end_world(), 285.0);
  for (const double world : {0.0, 300.0}) {
    const SourceAxis::Place place = area.place(world);
    EXPECT_TRUE(place.has_elevation);
    EXPECT_TRUE(place.continued);
  }
}

TEST(SourceAxis, BeyondTheEndsTheSlopeGoesOnAndThenTheSurfaceIsLevelOrEnds) {
  const SourceAxis axis(10, 0.0, 1.0, Registration::kPoint, 2.5);
  const SourceAxis::Place near = axis.place(-1.25);
  EXPECT_TRUE(near.continued);
  EXPECT_DOUBLE_EQ(near.edge, 0.0);
  EXPECT_DOUBLE_EQ(near.position, 1.25);
  const SourceAxis::Place far = axis.place(40.0);
  EXPECT_DOUBLE_EQ(far.edge, 9.0);
  EXPECT_DOUBLE_EQ(far.position, 6.5) << "level after 2.5 samples";
  EXPECT_TRUE(far.has_elevation);
  const SourceAxis positions = SourceAxis::of_positions(10, Registration::kPoint, 2.5);
  EXPECT_TRUE(positions.place(11.5).has_elevation);
  EXPECT_FALSE(positions.place(11.501).has_elevation);
  EXPECT_FALSE(positions.place(-3.0).has_elevation);
}

}  // namespace
}  // namespace isohf
