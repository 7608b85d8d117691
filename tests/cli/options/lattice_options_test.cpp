#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kCoast = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";

json parsed(const std::vector<std::string>& arguments) {
  const RunResult result = run_isohf(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return json::parse(result.out);
}

TEST(LengthOption, TakesUnitsWhereTheWorldIsInMetres) {
  const TemporaryFolder folder;
  write_int16_tiff(folder / "a.tif", 300, 200,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(100 + c + r); });
  const auto column_spacing = [&](const std::string& spacing) {
    return parsed({"plan", folder / "a.tif", "--sample-spacing", "10", "--spacing", spacing, "--json"})
        .at("grid")
        .at("column_spacing")
        .get<double>();
  };
  EXPECT_NEAR(column_spacing("30"), 30.0, 1e-9);
  EXPECT_NEAR(column_spacing("30m"), 30.0, 1e-9);
  EXPECT_NEAR(column_spacing("0.03 km"), 30.0, 1e-9);
  EXPECT_NEAR(column_spacing("3e1m"), 30.0, 1e-9);
  EXPECT_NEAR(column_spacing("100ft"), 30.48, 1e-9);
  EXPECT_NEAR(column_spacing("100us-ft"), 100.0 * 1200.0 / 3937.0, 1e-9);
  const json feet = parsed({"plan", folder / "a.tif", "--sample-spacing", "100ft", "--json"});
  EXPECT_NEAR(feet.at("input").at("spacing_x").get<double>(), 30.48, 1e-9);
  for (const char* bad : {"30q", "m", "-3m", "0m", "1e400m", "3 4 m", ""}) {
    const RunResult refused =
        run_isohf({"plan", folder / "a.tif", "--sample-spacing", "10", std::string("--spacing=") + bad});
    EXPECT_EQ(refused.exit_code, 2) << bad;
    if (*bad != 0) {
      EXPECT_THAT(refused.err, HasSubstr("must be a number greater than 0, alone or with a unit")) << bad;
    }
  }
}

TEST(LengthOption, AUnitIsRefusedWhereTheWorldHasNone) {
  const TemporaryFolder folder;
  write_int16_tiff(folder / "a.tif", 300, 200,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(100 + c + r); });
  const RunResult plan = run_isohf({"plan", folder / "a.tif", "--spacing", "30m"});
  EXPECT_EQ(plan.exit_code, 2);
  EXPECT_THAT(plan.err, HasSubstr("a.tif: --spacing has a unit"));
  ASSERT_EQ(run_isohf({"convert", folder / "a.tif", folder / "a.isohf"}).exit_code, 0);
  const RunResult refused = run_isohf({"export", folder / "a.isohf", folder / "b.tif", "--spacing", "2m"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("a.isohf: --spacing has a unit"));
  EXPECT_EQ(run_isohf({"export", folder / "a.isohf", folder / "b.tif", "--spacing", "2"}).exit_code, 0);
}

TEST(DensityOption, TakesFractions) {
  EXPECT_NEAR(parsed({"plan", kCoast, "--density", "1/2", "--json"}).at("density").get<double>(), 0.5, 1e-9);
  for (const char* bad : {"1/0", "1/", "/2", "-1/2", "1/2/3", "a/2"}) {
    const RunResult refused = run_isohf({"plan", kCoast, std::string("--density=") + bad});
    EXPECT_EQ(refused.exit_code, 2) << bad;
    EXPECT_THAT(refused.err, HasSubstr("or a fraction as in 1/2")) << bad;
  }
}

TEST(SourceStatistics, SizesAreToldBesideTheSourcesOwnSamples) {
  const TemporaryFolder folder;
  write_int16_tiff(folder / "a.tif", 200, 150,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(100 + 10 * (c + r)); });
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{}, {"--density", "1", "--shape", "148x179"}}) {
    const json summary =
        parsed(with_more({"convert", folder / "a.tif", folder / "a.isohf", "--overwrite", "--json"}, options));
    EXPECT_EQ(summary.at("source_samples"), 200 * 150);
    EXPECT_EQ(summary.at("source_bytes"), 2 * 200 * 150);
    const double tile_bytes = summary.at("tile_bytes");
    EXPECT_DOUBLE_EQ(summary.at("bits_per_source_sample").get<double>(), 8.0 * tile_bytes / (200.0 * 150.0));
    EXPECT_DOUBLE_EQ(summary.at("ratio_to_source").get<double>(), 2.0 * 200.0 * 150.0 / tile_bytes);
    const json info = parsed({"info", folder / "a.isohf", "--json"});
    for (const char* member : {"source_samples", "source_bytes", "bits_per_source_sample", "ratio_to_source"}) {
      EXPECT_EQ(info.at(member), summary.at(member)) << member;
    }
    EXPECT_THAT(run_isohf({"info", folder / "a.isohf"}).out, HasSubstr("smaller than the source's 60 kB of int16"));
  }
}

}  // namespace
}  // namespace isohf::test
