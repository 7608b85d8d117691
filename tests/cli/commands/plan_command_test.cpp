#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(PlanCommand, CandidatesLieNearTheBudgetBestAspectFirst) {
  const RunResult result = run_isohf({"plan", "--levels", "4", "--shape", "10000", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json candidates = json::parse(result.out).at("candidates");
  ASSERT_FALSE(candidates.empty());
  EXPECT_LE(candidates.size(), 10U);
  double last = 0.0;
  for (const json& shape : candidates) {
    const double distortion = std::abs(shape.at("aspect").get<double>() - 1.0);
    EXPECT_GE(distortion, last);
    last = distortion;
    EXPECT_EQ(shape.at("levels"), 4);
    EXPECT_EQ(shape.at("index_arrays").size(), 4U);
    EXPECT_EQ(shape.at("raw_bytes"), 2 * shape.at("stored_vertices").get<int>());
  }
}

TEST(PlanCommand, ShapeIsDescribedOrAnsweredWithTheNearestValidOne) {
  const json candidates = json::parse(run_isohf({"plan", "--shape", "212x243", "--json"}).out).at("candidates");
  ASSERT_EQ(candidates.size(), 1U);
  EXPECT_EQ(candidates[0].at("triangles"), 100080);
  const RunResult bad = run_isohf({"plan", "--shape", "48x55", "--levels", "3"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_EQ(bad.out, "");
  EXPECT_THAT(bad.err, HasSubstr("nearest valid shape is 48x59"));
}

TEST(PlanCommand, InputGivesTheWholePlanAndWritesNothing) {
  const TemporaryFolder folder;
  write_int16_tiff(folder / "a.tif", 300, 200,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(c + r); });
  const RunResult text = run_isohf({"plan", folder / "a.tif", "--tiles", "6x4", "--shape", "52x67"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.err, "");
  EXPECT_THAT(text.out, HasSubstr("6 x 4 = 24 tiles"));
  const RunResult result =
      run_isohf({"plan", folder / "a.tif", "--tiles", "6x4", "--shape", "52x67", "--sample-spacing", "10", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json plan = json::parse(result.out);
  EXPECT_EQ(plan.at("grid").at("tiles"), 24);
  EXPECT_EQ(plan.at("shape").at("columns"), 52);
  EXPECT_EQ(plan.at("lattice_samples"), 24 * 52 * 67);
  EXPECT_TRUE(plan.at("input").at("in_metres").get<bool>());
  EXPECT_GT(plan.at("estimated_memory_bytes").get<double>(), 0.0);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"});

  const RunResult dry = run_isohf({"convert", "--dry-run", folder / "a.tif", "--tiles", "6x4", "--shape", "52x67",
                                   "--sample-spacing", "10", "--json"});
  EXPECT_EQ(dry.out, result.out);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"});
}

}  // namespace
}  // namespace isohf::test
