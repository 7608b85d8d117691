/// convert --max-error: the surface as drawn is within E of every input sample, or there is no archive; and what plan
/// and convert expect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class MaxError : public testing::Test {
 protected:
  /// Smooth hills, with rough ones in the South-East, and voids.
  MaxError() {
    write_int16_tiff(folder / "a.tif", 300, 200, [](std::int64_t c, std::int64_t r) {
      if (r > 150 && c < 40 && (r + c) % 17 == 0) return std::int16_t{-32768};
      const double x = static_cast<double>(c);
      const double z = static_cast<double>(r);
      const double rough = c > 200 && r > 100 ? 12.0 * std::sin(1.7 * x) * std::cos(1.3 * z) : 0.0;
      return static_cast<std::int16_t>(std::lround(700 + 300 * std::sin(0.05 * x) * std::cos(0.04 * z) + rough));
    });
  }

  RunResult convert(std::vector<std::string> more) {
    return run_isohf(
        with_more({"convert", folder / "a.tif", folder / "a.isohf", "--overwrite", "--nodata=-32768"}, more));
  }
  json against() {
    const RunResult result = run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.out;
    return json::parse(result.out).at("against");
  }

  TemporaryFolder folder;
};

TEST_F(MaxError, HoldsAtEverySampleAsVerifyMeasuresIt) {
  double bytes_of_last = 1e9;
  for (const double most : {0.6, 3.0, 12.0, 60.0}) {
    const RunResult result = convert({"--max-error", std::to_string(most), "--json"});
    ASSERT_EQ(result.exit_code, 0) << most << result.err;
    const json summary = json::parse(result.out);
    const json found = against();
    EXPECT_LE(found.at("max").get<double>(), most);
    const json& stated = summary.at("metadata").at("accuracy");
    EXPECT_EQ(stated, summary.at("accuracy"));
    EXPECT_EQ(stated.at("max"), found.at("max"));
    EXPECT_EQ(stated.at("rms"), found.at("rms"));
    EXPECT_EQ(stated.at("samples_compared"), found.at("samples_compared"));
    EXPECT_EQ(stated.at("samples_lost"), found.at("samples_lost"));
    EXPECT_EQ(stated.at("max_error").get<double>(), most);
    EXPECT_LE(stated.at("max_rounding").get<double>(), std::max(most / 8.0, 0.25));
    // What is allowed is used: fewer bytes for more of it.
    EXPECT_LE(summary.at("archive_bytes").get<double>(), bytes_of_last) << most;
    bytes_of_last = summary.at("archive_bytes").get<double>();
  }
  EXPECT_LT(bytes_of_last, 25000.0);
}

TEST_F(MaxError, RunsThroughEverySampleWhereNothingLessHolds) {
  // Noise: each sample for itself.
  write_int16_tiff(folder / "a.tif", 150, 130, [](std::int64_t c, std::int64_t r) {
    const auto mixed = static_cast<std::uint32_t>(c * 73856093 ^ r * 19349663) * 2654435761U;
    return static_cast<std::int16_t>(c == 70 && r > 20 && r < 40 ? -32768 : mixed >> 20U);
  });
  const RunResult result = convert({"--max-error", "0.5", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json found = against();
  EXPECT_LE(found.at("max").get<double>(), 0.5);
  EXPECT_EQ(found.at("samples_lost"), 0) << "next to voids, too";
  EXPECT_EQ(found.at("samples_compared"), 150 * 130 - 19);
}

// 65536 values and 65535 codes: doubled, the usual step rounds by 1.
TEST_F(MaxError, IntegersThatTakeAllCodesGetTheFinestStep) {
  std::ofstream raw(folder / "full.r16", std::ios::binary);
  for (int i = 0; i < 257 * 257; ++i) {
    const double x = i % 257 / 256.0;
    const double y = i / 257 / 256.0;
    const auto sample = static_cast<std::uint16_t>(std::lround(65535.0 * (0.5 * x + 0.5 * y)));
    raw.write(reinterpret_cast<const char*>(&sample), sizeof sample);
  }
  raw.close();
  const RunResult made = run_isohf(
      {"convert", folder / "full.r16", folder / "a.isohf", "--raw", "257x257:u16le", "--max-error", "0.9", "-q"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
}

TEST_F(MaxError, WhatTheUserGaveStaysAndIsNamedWhereItIsInTheWay) {
  const RunResult result = convert({"--max-error", "3", "--density", "0.25"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("cannot be held to --max-error 3"));
  EXPECT_THAT(result.err, HasSubstr("the smallest error reached is "));
  EXPECT_THAT(result.err, HasSubstr("leave --density"));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"}) << "no archive that breaks the promise";
  ASSERT_EQ(
      convert({"--max-error", "60", "--density", "0.25", "--filter", "bilinear", "--step", "0.5", "--quiet"}).exit_code,
      0);
  const json info = json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out).at("metadata");
  EXPECT_EQ(info.at("filter"), "bilinear");
  EXPECT_EQ(info.at("samples").at("scale"), 0.5);
  EXPECT_EQ(run_isohf({"plan", folder / "a.tif", "--max-error", "3"}).exit_code, 2);
}

TEST_F(MaxError, BytesDoNotDependOnThreadsOrMemoryAndAResumedRunGivesTheSame) {
  ASSERT_EQ(convert({"--max-error", "5", "--quiet"}).exit_code, 0);
  const std::string bytes = read_file(folder / "a.isohf");
  ASSERT_EQ(convert({"--max-error", "5", "--quiet", "--threads", "1", "--memory", "100M", "--resume"}).exit_code, 0);
  EXPECT_TRUE(read_file(folder / "a.isohf") == bytes);
}

TEST_F(MaxError, InfoPrintsWhatWasMeasuredAndVerifyFindsWhatIsNotTrue) {
  ASSERT_EQ(convert({"--max-error", "5", "--quiet"}).exit_code, 0);
  const RunResult info = run_isohf({"info", folder / "a.isohf"});
  EXPECT_THAT(info.out,
              testing::ContainsRegex("\nerror +rms [0-9.]+.*, largest [0-9.]+.* input samples.*5.* was allowed"));
  // Of another input of the same size nothing that is stated holds.
  write_int16_tiff(folder / "b.tif", 300, 200,
                   [](std::int64_t c, std::int64_t) { return static_cast<std::int16_t>(c); });
  const RunResult other = run_isohf({"verify", folder / "a.isohf", "--against", folder / "b.tif"});
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_THAT(other.out, HasSubstr("ISOHF-0025 error: the metadata state an error of rms"));
}

TEST_F(MaxError, PlanAndSummaryExpectTheErrorThatIsFound) {
  for (const std::vector<std::string>& way : std::vector<std::vector<std::string>>{{}, {"--density", "0.3"}}) {
    const json planned =
        json::parse(run_isohf(with_more({"plan", folder / "a.tif", "--nodata=-32768", "--json"}, way)).out)
            .at("expected_error");
    const json expected = json::parse(convert(with_more({"--json"}, way)).out).at("expected_error");
    const json found = against();
    const auto rms = found.at("rms").get<double>();
    // All samples are looked at; plan does not know how far the border's slope goes on, and with it the codes' range.
    EXPECT_NEAR(expected.at("rms").get<double>(), rms, 1e-3 * rms);
    EXPECT_NEAR(planned.at("rms").get<double>(), rms, 1e-2 * rms);
    EXPECT_LE(planned.at("largest_seen").get<double>(), 1.0001 * found.at("max").get<double>());
    EXPECT_GT(planned.at("samples").get<int>(), 4000);
  }
  EXPECT_THAT(convert({}).out, HasSubstr("an estimate"));
}

}  // namespace
}  // namespace isohf::test
