#include "output/svg_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace isohf::chart {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(SvgChart, NamesCurvesAndEscapesText) {
  Curve curve = {"a < b & c", "#112233", true, {1, 2, 3}, {1, 10, 1000}};
  const Chart chart = {"title", "x", "y", "note", {curve}};
  for (const std::string& svg :
       {line_chart(chart, Scale::kFromZero), line_chart(chart, Scale::kLogarithmic), polar_chart(chart)}) {
    EXPECT_THAT(svg, testing::StartsWith("<svg "));
    EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
    EXPECT_THAT(svg, HasSubstr("a &lt; b &amp; c"));
    EXPECT_THAT(svg, HasSubstr("#112233"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
  }
}

TEST(SvgChart, DrawsASinglePoint) {
  const Chart chart = {"", "", "", "", {{"one", "red", false, {5}, {0}}}};
  EXPECT_THAT(line_chart(chart, Scale::kFromZero), Not(HasSubstr("nan")));
  EXPECT_THAT(polar_chart(chart), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace isohf::chart
