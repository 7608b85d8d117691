#include "session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace isohf::view {
namespace {

using State = ShadowSun::State;
constexpr double kDegree = std::numbers::pi / 180.0;

TEST(ShadowSun, IsTheSunItselfDueEastAndWest) {
  const ShadowSeedInfo hulls;
  for (const double elevation : {2.0, 7.5, 30.0, 80.0}) {
    const ShadowSun east = shadow_sun(&hulls, 90.0, elevation, 1.0);
    EXPECT_EQ(east.state, State::kExact);
    EXPECT_EQ(east.sun.travel, LightTravel::kWestward);
    EXPECT_NEAR(east.sun.elevation_deg, elevation, 1e-9);
    const ShadowSun west = shadow_sun(&hulls, 270.0, elevation, 1.0);
    EXPECT_EQ(west.sun.travel, LightTravel::kEastward);
    EXPECT_NEAR(west.sun.elevation_deg, elevation, 1e-9);
  }
}

TEST(ShadowSun, RisesInTheRowsPlaneAsItTurnsAway) {
  const ShadowSeedInfo hulls;
  for (const double azimuth : {100.0, 130.0, 170.0, 190.0, 350.0, -10.0}) {
    const ShadowSun sun = shadow_sun(&hulls, azimuth, 10.0, 1.0);
    EXPECT_EQ(sun.sun.travel, std::sin(azimuth * kDegree) > 0.0 ? LightTravel::kWestward : LightTravel::kEastward);
    EXPECT_NEAR(std::tan(sun.sun.elevation_deg * kDegree) * std::abs(std::sin(azimuth * kDegree)),
                std::tan(10.0 * kDegree), 1e-12);
  }
  EXPECT_EQ(shadow_sun(&hulls, 0.0, 10.0, 1.0).state, State::kNone);
  EXPECT_EQ(shadow_sun(&hulls, 180.0, 10.0, 1.0).state, State::kNone);
}

TEST(ShadowSun, StandsLowerOverTrueHeightsThanOverExaggeratedOnes) {
  const ShadowSun sun = shadow_sun(nullptr, 90.0, 20.0, 1.0);
  EXPECT_EQ(sun.state, State::kNoSeeds);
  const ShadowSeedInfo hulls;
  const ShadowSun exaggerated = shadow_sun(&hulls, 90.0, 20.0, 3.0);
  EXPECT_NEAR(std::tan(exaggerated.sun.elevation_deg * kDegree), std::tan(20.0 * kDegree) / 3.0, 1e-12);
  EXPECT_NEAR(exaggerated.seen_deg, 20.0, 1e-9);
}

TEST(ShadowSun, CastsNothingAtNightNorFromOverhead) {
  const ShadowSeedInfo hulls;
  for (const double elevation : {-5.0, 0.0, 90.0}) {
    EXPECT_EQ(shadow_sun(&hulls, 90.0, elevation, 1.0).state, State::kNone) << elevation;
  }
}

TEST(ShadowSun, FallsBackOnTheNearestThatSeedsHoldFor) {
  const ShadowSeedInfo hulls;
  const ShadowSun low = shadow_sun(&hulls, 90.0, 0.5, 1.0);
  EXPECT_EQ(low.state, State::kNearest);
  EXPECT_EQ(low.sun.elevation_deg, hulls.sun_min_deg);
  ShadowSeedInfo angles;
  angles.kind = ShadowSeedInfo::Kind::kAngles;
  angles.sun_deg = {5.0, 15.0, 30.0};
  EXPECT_EQ(shadow_sun(&angles, 90.0, 15.0, 1.0).state, State::kExact);
  EXPECT_EQ(shadow_sun(&angles, 90.0, 11.0, 1.0).state, State::kNearest);
  EXPECT_EQ(shadow_sun(&angles, 90.0, 11.0, 1.0).sun.elevation_deg, 15.0);
  EXPECT_EQ(shadow_sun(&angles, 90.0, 80.0, 1.0).sun.elevation_deg, 30.0);
}

}  // namespace
}  // namespace isohf::view
