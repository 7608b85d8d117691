#include "isohf/projection/choose_projection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

using testing::HasSubstr;

ProjectionProblem problem_of(const GeoExtent& ground, bool goes_round = false) {
  return {"dem.tif", "", {}, ground, goes_round, false};
}

ProjectionChoice choose(const std::string& request, const GeoExtent& ground, bool goes_round = false) {
  return choose_projection(ProjectionRequest::parse(request), problem_of(ground, goes_round));
}

std::string refusal_of(const std::string& request, const ProjectionProblem& problem) {
  const Error error = test::error_of([&] { (void)choose_projection(ProjectionRequest::parse(request), problem); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << request;
  return error.what();
}

TEST(ChooseProjection, AutoKeepsSmallGroundsEquirectangular) {
  // Every one-degree cell between latitudes -60 and 60, where SRTM has them.
  for (int south = -60; south < 60; ++south) {
    const ProjectionChoice choice =
        choose("auto", {6.0, static_cast<double>(south), 7.0, static_cast<double>(south) + 1.0});
    EXPECT_EQ(choice.spec.kind, ProjectionKind::kEquirectangular) << south;
    EXPECT_LE(choice.error.worst, kEquirectangularError) << south;
    EXPECT_THAT(choice.why, HasSubstr("2 %"));
  }
}

TEST(ChooseProjection, AutoTakesTheConformalKindThatErrsLeast) {
  const ProjectionChoice wide = choose("auto", {-5.0, 42.0, 9.0, 51.0});
  EXPECT_EQ(wide.spec.kind, ProjectionKind::kLambertConformal);
  EXPECT_DOUBLE_EQ(wide.spec.parallel_1, 43.5);
  EXPECT_DOUBLE_EQ(wide.spec.parallel_2, 49.5);
  EXPECT_DOUBLE_EQ(wide.spec.longitude_0, 2.0);
  EXPECT_LT(wide.error.worst, 0.005);
  const ProjectionChoice tall = choose("auto", {-72.0, -55.0, -68.0, -20.0});
  EXPECT_EQ(tall.spec.kind, ProjectionKind::kTransverseMercator);
  EXPECT_LT(tall.error.worst, 0.001);
  EXPECT_THAT(tall.why, HasSubstr("equirectangular would err by"));
  const ProjectionChoice cap = choose("auto", {-180.0, 60.0, 180.0, 90.0}, true);
  EXPECT_EQ(cap.spec.kind, ProjectionKind::kPolarStereographic);
  EXPECT_LT(cap.error.worst, 0.04);
  const ProjectionChoice sector = choose("auto", {0.0, 65.0, 90.0, 90.0});
  EXPECT_EQ(sector.spec.kind, ProjectionKind::kPolarStereographic);
}

TEST(ChooseProjection, AutoKeepsGlobesEquirectangular) {
  const ProjectionChoice globe = choose("auto", {-180.0, -90.0, 180.0, 90.0}, true);
  EXPECT_EQ(globe.spec.kind, ProjectionKind::kEquirectangular);
  EXPECT_THAT(globe.why, HasSubstr("all the way round"));
}

TEST(ChooseProjection, AutoKeepsRowsWhereTheyAreNeeded) {
  ProjectionProblem problem = problem_of({-5.0, 42.0, 9.0, 51.0});
  problem.wraps_x = true;
  const ProjectionChoice choice = choose_projection({}, problem);
  EXPECT_EQ(choice.spec.kind, ProjectionKind::kEquirectangular);
  EXPECT_THAT(choice.why, HasSubstr("--wrap-x"));
  EXPECT_THAT(refusal_of("lambert-conformal", problem),
              HasSubstr("dem.tif: `projection` lambert-conformal: `wrap_x` needs the input's rows to stay rows; "
                        "`projection` equirectangular works"));
}

TEST(ChooseProjection, GroundsThatDoNotSuitAreRefusedWithWhatWorks) {
  const GeoExtent cap{-180.0, 60.0, 180.0, 90.0};
  const GeoExtent globe{-180.0, -90.0, 180.0, 90.0};
  EXPECT_THAT(refusal_of("lambert-conformal", problem_of(cap, true)),
              HasSubstr("reaches latitude 90, a cone shows up to 89; `projection` polar-stereographic works"));
  EXPECT_THAT(refusal_of("transverse-mercator", problem_of(globe, true)),
              HasSubstr("180 degrees from the central meridian, at most 80"));
  EXPECT_THAT(refusal_of("utm", problem_of({0.0, 80.0, 6.0, 85.0})), HasSubstr("from latitude -80 to 84"));
  EXPECT_THAT(refusal_of("polar-stereographic", problem_of({0.0, -10.0, 90.0, 80.0})), HasSubstr("beyond the equator"));
  EXPECT_THAT(refusal_of("local", problem_of(globe, true)), HasSubstr("a quarter of the way round"));
  EXPECT_THAT(refusal_of("equirectangular", problem_of({0.0, 89.9, 10.0, 90.0})),
              HasSubstr("`projection` transverse-mercator works"));
  EXPECT_THAT(refusal_of("transverse-mercator:-70", problem_of({0.0, 0.0, 5.0, 5.0})), HasSubstr("would err by"));
  ProjectionProblem mars = problem_of({10.0, 10.0, 11.0, 11.0});
  mars.body = "Mars";
  mars.ellipsoid = {3396190.0, 0.0};
  EXPECT_THAT(refusal_of("utm", mars), HasSubstr("UTM zones are the Earth's, the input shows Mars"));
}

TEST(ChooseProjection, ParametersAreTaken) {
  EXPECT_DOUBLE_EQ(choose("local:6.25,44.5", {6.0, 44.0, 7.0, 45.0}).spec.longitude_0, 6.25);
  const ProjectionSpec cone = choose("lambert-conformal:44,46,8", {6.0, 44.0, 7.0, 45.0}).spec;
  EXPECT_DOUBLE_EQ(cone.parallel_1, 44.0);
  EXPECT_DOUBLE_EQ(cone.parallel_2, 46.0);
  EXPECT_DOUBLE_EQ(cone.longitude_0, 8.0);
  EXPECT_EQ(choose("utm:31N", {6.0, 44.0, 7.0, 45.0}).spec.longitude_0, 3.0);
  EXPECT_DOUBLE_EQ(choose("polar-stereographic:-71,15", {0.0, -90.0, 90.0, -60.0}).spec.parallel_1, -71.0);
  EXPECT_EQ(choose("none", {6.0, 44.0, 7.0, 45.0}).spec.kind, ProjectionKind::kNone);
}

TEST(ChooseProjection, ExtentsAcrossTheAntimeridianHaveTheirMiddleThere) {
  const ProjectionSpec spec = choose("transverse-mercator", {179.5, 60.0, 181.0, 62.0}).spec;
  EXPECT_DOUBLE_EQ(spec.longitude_0, -179.75);
  // Norway's wide zone, and Svalbard's.
  EXPECT_EQ(choose("utm", {5.0, 60.0, 6.0, 61.0}).spec.utm_zone, 32);
  EXPECT_EQ(choose("utm", {10.0, 78.0, 11.0, 79.0}).spec.utm_zone, 33);
}

}  // namespace
}  // namespace isohf
