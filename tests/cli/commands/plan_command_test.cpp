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

TEST(PlanCommand, InputGivesTheWholePlanAndWritesNothing) {
  const TemporaryFolder folder;
  write_int16_tiff(folder / "a.tif", 300, 200,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(c + r); });
  const RunResult text = run_isohf({"plan", folder / "a.tif", "--shape", "52x67"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.err, "");
  EXPECT_THAT(text.out, HasSubstr("\ntiles        6 x 4 of 52x67, "));
  EXPECT_LE(std::count(text.out.begin(), text.out.end(), '\n'), 8) << text.out;
  const RunResult result =
      run_isohf({"plan", folder / "a.tif", "--shape", "52x67", "--sample-spacing", "10", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json plan = json::parse(result.out);
  EXPECT_EQ(plan.at("grid").at("tiles"), 24);
  EXPECT_EQ(plan.at("shape").at("columns"), 52);
  EXPECT_EQ(plan.at("lattice_samples"), 24 * 52 * 67);
  EXPECT_TRUE(plan.at("input").at("in_metres").get<bool>());
  EXPECT_GT(plan.at("estimated_memory_bytes").get<double>(), 0.0);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"});
}

TEST(PlanCommand, WarningsOfItsDocumentNameOptions) {
  const TemporaryFolder folder;
  write_file(folder / "a.asc", "ncols 4\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n1 2 3 4\n5 6 -9999 8\n");
  const RunResult result = run_isohf({"plan", folder / "a.asc", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json warnings = json::parse(result.out).at("input").at("warnings");
  ASSERT_EQ(warnings.size(), 1U) << warnings;
  EXPECT_THAT(warnings.at(0).get<std::string>(), HasSubstr("give --nodata -9999"));
}

}  // namespace
}  // namespace isohf::test
