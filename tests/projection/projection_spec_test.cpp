#include "isohf/projection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "isohf/error.h"
#include "isohf/projection/projection_wkt.h"
#include "support/error_of.h"

namespace isohf {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal_of(const std::string& text) {
  const Error error = test::error_of([&] { (void)ProjectionRequest::parse(text); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << text;
  return error.what();
}

TEST(ProjectionRequest, ReadsKindsAndParameters) {
  EXPECT_TRUE(ProjectionRequest::parse("auto").is_auto);
  EXPECT_EQ(ProjectionRequest::parse("none").kind, ProjectionKind::kNone);
  EXPECT_THAT(ProjectionRequest::parse("local:-3.5,47.25").parameters, ElementsAre(-3.5, 47.25));
  EXPECT_THAT(ProjectionRequest::parse("transverse-mercator:9").parameters, ElementsAre(9.0));
  EXPECT_THAT(ProjectionRequest::parse("lambert-conformal:46,49,3").parameters, ElementsAre(46.0, 49.0, 3.0));
  EXPECT_THAT(ProjectionRequest::parse("polar-stereographic:-71").parameters, ElementsAre(-71.0));
  EXPECT_EQ(ProjectionRequest::parse("utm:32N").utm_zone, 32);
  EXPECT_EQ(ProjectionRequest::parse("utm:5s").utm_zone, -5);
  EXPECT_EQ(ProjectionRequest::parse("utm").utm_zone, 0);
}

TEST(ProjectionRequest, TakesReferenceSystems) {
  for (const char* text : {"EPSG:2154", "epsg:2154", "ESRI:54009", "IAU_2015:49910", "urn:ogc:def:crs:EPSG::2154",
                           "+proj=laea +lat_0=52 +lon_0=10", "PROJCS[\"a\"]", "{\"type\": \"ProjectedCRS\"}"}) {
    const ProjectionRequest request = ProjectionRequest::parse(text);
    EXPECT_EQ(request.kind, ProjectionKind::kSystem) << text;
    EXPECT_FALSE(request.is_auto);
    EXPECT_EQ(request.system, text);
    EXPECT_EQ(request.name(), text);
  }
  EXPECT_THAT(refusal_of("system"), HasSubstr("or a reference system: EPSG:3035"));
  EXPECT_THAT(refusal_of("utn:32N"), HasSubstr("must be one of auto"));
}

TEST(ProjectionRequest, SaysWhatItFoundAndWhatMustBe) {
  EXPECT_THAT(refusal_of("mercator"), HasSubstr("found 'mercator', must be one of auto, none, equirectangular, local"));
  EXPECT_THAT(refusal_of("utm:61N"), HasSubstr("a zone from 1 to 60"));
  EXPECT_THAT(refusal_of("utm:32"), HasSubstr("N or S"));
  EXPECT_THAT(refusal_of("none:1"), HasSubstr("no parameters"));
  EXPECT_THAT(refusal_of("local:5"), HasSubstr("local:LON,LAT"));
  EXPECT_THAT(refusal_of("local:5,"), HasSubstr("local:LON,LAT"));
  EXPECT_THAT(refusal_of("local:5,91"), HasSubstr("a latitude within 90"));
  EXPECT_THAT(refusal_of("lambert-conformal:46,x"), HasSubstr("lambert-conformal:LAT1,LAT2[,LON]"));
  EXPECT_THAT(refusal_of("lambert-conformal:46,nan"), HasSubstr("lambert-conformal:LAT1,LAT2[,LON]"));
  EXPECT_THAT(refusal_of("transverse-mercator:9,0"), HasSubstr("a scale between"));
  EXPECT_THAT(refusal_of("polar-stereographic:0"), HasSubstr("North or South of the equator"));
  EXPECT_THAT(refusal_of(""), HasSubstr("must be one of"));
}

TEST(ProjectionKind, NamesComeBack) {
  for (const ProjectionKind kind : {ProjectionKind::kNone, ProjectionKind::kEquirectangular, ProjectionKind::kLocal,
                                    ProjectionKind::kTransverseMercator, ProjectionKind::kUtm,
                                    ProjectionKind::kLambertConformal, ProjectionKind::kPolarStereographic}) {
    EXPECT_EQ(projection_kind_from_string(to_string(kind)), kind);
  }
}

TEST(ProjectionWkt, NamesMethodParametersAndEllipsoid) {
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kLambertConformal;
  spec.parallel_1 = 46.0;
  spec.parallel_2 = 49.0;
  spec.latitude_0 = 47.5;
  spec.longitude_0 = 13.25;
  EXPECT_EQ(projection_wkt(spec, ""),
            "PROJCS[\"lambert-conformal\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
            "84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION["
            "\"Lambert_Conformal_Conic_2SP\"],PARAMETER[\"standard_parallel_1\",46],PARAMETER[\"standard_parallel_2\","
            "49],PARAMETER[\"latitude_of_origin\",47.5],PARAMETER[\"central_meridian\",13.25],PARAMETER[\"false_"
            "easting\",0],PARAMETER[\"false_northing\",0],UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\","
            "NORTH]]");
  spec.ellipsoid = {3396190.0, 0.0};
  EXPECT_THAT(projection_wkt(spec, "Mars \"2000\""), HasSubstr("SPHEROID[\"Mars '2000'\",3396190,0]"));
}

TEST(ProjectionEpsg, IsThatOfUtmOnWgs84Alone) {
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kUtm;
  spec.utm_zone = 32;
  EXPECT_EQ(projection_epsg(spec, 4326), 32632);
  spec.utm_zone = -5;
  EXPECT_EQ(projection_epsg(spec, 4326), 32705);
  EXPECT_EQ(projection_epsg(spec, 4258), std::nullopt);
  spec.kind = ProjectionKind::kTransverseMercator;
  EXPECT_EQ(projection_epsg(spec, 4326), std::nullopt);
}

}  // namespace
}  // namespace isohf
