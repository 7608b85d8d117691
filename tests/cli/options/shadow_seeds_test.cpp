#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class ShadowSeedsOption : public testing::Test {
 protected:
  ShadowSeedsOption() {
    write_int16_tiff(folder / "a.tif", 200, 120, [](std::int64_t c, std::int64_t r) {
      return static_cast<std::int16_t>(
          std::lround(700 + 30 * std::sin(0.4 * static_cast<double>(c)) * std::cos(0.1 * static_cast<double>(r))));
    });
  }

  /// What `info` says of the seeds after converting with these arguments.
  json seeds_after(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"convert", "--overwrite", "--shape", "52x67"});
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out)
        .at("metadata")
        .value("shadow_seeds", json());
  }

  TemporaryFolder folder;
};

TEST_F(ShadowSeedsOption, StandsAloneBeforeAFileName) {
  const json seeds = seeds_after({"--shadow-seeds", folder / "a.tif", folder / "a.isohf"});
  EXPECT_EQ(seeds.at("kind"), "hulls");
  EXPECT_EQ(seeds.at("sun_min_deg"), 2.0);
  EXPECT_GT(seeds.at("members"), 0);
  EXPECT_GT(seeds.at("bytes"), 0);
  EXPECT_EQ(run_isohf({"verify", folder / "a.isohf"}).exit_code, 0);
}

TEST_F(ShadowSeedsOption, TakesALowestSun) {
  EXPECT_EQ(seeds_after({folder / "a.tif", folder / "a.isohf", "--sun-min", "7.5", "--shadow-seeds"}).at("sun_min_deg"),
            7.5);
}

TEST_F(ShadowSeedsOption, IsOffByDefault) {
  EXPECT_TRUE(seeds_after({folder / "a.tif", folder / "a.isohf"}).is_null());
}

TEST_F(ShadowSeedsOption, SummarySaysWhatTheyTake) {
  const RunResult result =
      run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--shape", "52x67", "--shadow-seeds", "-v"});
  EXPECT_THAT(result.out, HasSubstr("\nseeds "));
}

TEST_F(ShadowSeedsOption, RefusesWhatIsNoSun) {
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--sun-min", "3"}, {"--shadow-seeds", "--sun-min", "0"}, {"--shadow-seeds", "--sun-min", "x"}}) {
    const RunResult result = run_isohf(with_more({"convert", folder / "a.tif", folder / "a.isohf"}, wrong));
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, testing::AnyOf(HasSubstr("--shadow-seeds"), HasSubstr("--sun-min")));
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"});
  }
}

}  // namespace
}  // namespace isohf::test
