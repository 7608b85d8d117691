/// --nodata, --valid-range and --fill, from the command line to what verify makes of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// Land with a hole of -32768, a spike of 9999 and a lake of 12 under a limit.
class VoidOptions : public testing::Test {
 protected:
  VoidOptions() {
    write_int16_tiff(folder / "a.tif", 160, 120, [](std::int64_t c, std::int64_t r) {
      const auto x = static_cast<double>(c);
      const auto z = static_cast<double>(r);
      if (std::hypot(x - 60, z - 50) < 9) return static_cast<std::int16_t>(-32768);
      if (c == 120 && r > 20 && r < 24) return static_cast<std::int16_t>(9999);
      if (std::hypot(x - 110, z - 90) < 5) return static_cast<std::int16_t>(12);
      return static_cast<std::int16_t>(300 + 100 * std::sin(x / 20) + z);
    });
  }

  /// Converts, expects nothing on standard error, and returns the summary.
  json convert(std::vector<std::string> options, const std::string& name = "a.isohf") const {
    const RunResult result =
        run_isohf(with_more({"convert", folder / "a.tif", folder / name, "--overwrite", "--json"}, options));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return result.exit_code == 0 ? json::parse(result.out) : json();
  }

  TemporaryFolder folder;
};

constexpr int kHole = 249;
constexpr int kSpike = 3;
constexpr int kLake = 69;

TEST_F(VoidOptions, NodataTakesSeveralValues) {
  const json summary = convert({"--nodata", "-32768,9999"});
  EXPECT_EQ(summary.at("source_voids").at("found"), kHole + kSpike);
  EXPECT_EQ(summary.at("metadata").at("source").at("voids").at("values"), json::array({-32768.0, 9999.0}));
  // Verify takes them from the archive.
  const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_EQ(verified.err, "");
}

TEST_F(VoidOptions, ValidRangeMakesVoidsAndCountsThem) {
  const json summary = convert({"--nodata", "-32768", "--valid-range", "100:5000"});
  EXPECT_EQ(summary.at("source_voids").at("found"), kHole + kSpike + kLake);
  EXPECT_EQ(summary.at("source_voids").at("by_valid_range"), kSpike + kLake);
  EXPECT_EQ(summary.at("source_voids").at("left"), kHole + kSpike + kLake);
  EXPECT_EQ(summary.at("metadata").at("source").at("voids").at("valid_range"), json::array({100.0, 5000.0}));
  EXPECT_GT(summary.at("metadata").at("statistics").at("min"), 150.0);
  EXPECT_LT(summary.at("metadata").at("statistics").at("max"), 600.0);
  EXPECT_EQ(run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif"}).exit_code, 0);
}

TEST_F(VoidOptions, FillLeavesNoHoleAndVerifyRepeatsIt) {
  const json summary = convert({"--valid-range", "100:5000", "--fill"});
  const int voids = kHole + kSpike + kLake;
  EXPECT_EQ(summary.at("source_voids").at("found"), voids);
  EXPECT_EQ(summary.at("source_voids").at("by_valid_range"), voids);  // the file declares none
  EXPECT_EQ(summary.at("source_voids").at("filled"), voids);
  EXPECT_EQ(summary.at("source_voids").at("left"), 0);
  EXPECT_EQ(summary.at("metadata").at("source").at("voids").at("fill_distance"), 100);
  EXPECT_EQ(summary.at("metadata").at("statistics").at("voids"), 0);
  EXPECT_GE(summary.at("metadata").at("statistics").at("min"), 150.0);
  const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif", "--json"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_EQ(json::parse(verified.out).at("against").at("samples_void"), 0);
}

TEST_F(VoidOptions, FillDistanceBoundsTheFilling) {
  const json summary = convert({"--nodata", "-32768,9999", "--fill=4"});
  const json& voids = summary.at("source_voids");
  EXPECT_EQ(voids.at("found"), kHole + kSpike);
  EXPECT_GT(voids.at("left").get<int>(), 30);
  EXPECT_LT(voids.at("left").get<int>(), kHole / 2);
  EXPECT_EQ(voids.at("filled").get<int>() + voids.at("left").get<int>(), kHole + kSpike);
}

TEST_F(VoidOptions, SummarySaysHowManyVoidsThereAre) {
  const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--nodata", "-32768,9999"});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("; nodata in 252 samples\n"));
  const RunResult treated = run_isohf(
      {"convert", folder / "a.tif", folder / "b.isohf", "--nodata", "-32768", "--valid-range", "100:5000", "--fill"});
  EXPECT_THAT(treated.out, HasSubstr("; nodata in 321 samples, 72 by --valid-range; 321 filled, 0 left\n"));
}

TEST_F(VoidOptions, NonsenseIsAUsageError) {
  for (const char* option :
       {"--fill=0", "--fill=5000", "--valid-range=9:3", "--valid-range=7", "--nodata=-32768,far", "--nodata=40000"}) {
    const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "b.isohf", option});
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

}  // namespace
}  // namespace isohf::test
