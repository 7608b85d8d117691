/// --nodata, --valid-range and --fill, from the command line to what verify and restore make of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "formats/write/raster_sink.h"
#include "support/rasters/place_at.h"
#include "support/rasters/plain_tiff.h"
#include "support/rasters/raster.h"
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
    std::vector<std::string> arguments = {"convert", folder / "a.tif", folder / name, "--overwrite", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const RunResult result = run_isohf(arguments);
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
  const json summary = convert({"--nodata", "-32768,9999", "--fill-distance", "4"});
  const json& voids = summary.at("source_voids");
  EXPECT_EQ(voids.at("found"), kHole + kSpike);
  EXPECT_GT(voids.at("left").get<int>(), 30);
  EXPECT_LT(voids.at("left").get<int>(), kHole / 2);
  EXPECT_EQ(voids.at("filled").get<int>() + voids.at("left").get<int>(), kHole + kSpike);
}

TEST_F(VoidOptions, FillingDoesNotDependOnThreads) {
  (void)convert({"--valid-range", "100:5000", "--fill", "--threads", "1"}, "one.isohf");
  (void)convert({"--valid-range", "100:5000", "--fill", "--threads", "7"}, "seven.isohf");
  EXPECT_EQ(read_file(folder / "one.isohf"), read_file(folder / "seven.isohf"));
}

/// Columns first to first + columns of land with a hole, as a GeoTIFF at its place.
void write_piece(const std::string& path, std::int64_t first, std::int64_t columns) {
  constexpr std::int64_t kRows = 90;
  RasterSpec spec;
  spec.width = columns;
  spec.height = kRows;
  spec.sample_type = SampleType::kInt16;
  spec.void_value = -32768;
  spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre,
                               400000.0 + 30.0 * static_cast<double>(first), 5000000.0, 30.0);
  std::vector<std::int16_t> samples;
  for (std::int64_t r = 0; r < kRows; ++r) {
    for (std::int64_t c = first; c < first + columns; ++c) {
      const bool is_void = std::hypot(static_cast<double>(c) - 61, static_cast<double>(r) - 40) < 14;
      samples.push_back(static_cast<std::int16_t>(is_void ? -32768 : 500 + (c * c + 7 * r * c) % 97));
    }
  }
  write_raster(path, spec, std::as_bytes(std::span(samples)));
}

TEST_F(VoidOptions, FillingReachesOverTheBordersOfAMosaic) {
  write_piece(folder / "whole.tif", 0, 130);
  write_piece(folder / "west.tif", 0, 60);
  write_piece(folder / "east.tif", 60, 70);
  const auto hash = [&](std::vector<std::string> inputs) {
    inputs.insert(inputs.begin(), "convert");
    inputs.insert(inputs.end(), {folder / "m.isohf", "--overwrite", "--fill", "--json"});
    const RunResult result = run_isohf(inputs);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const json summary = json::parse(result.out);
    EXPECT_GT(summary.at("source_voids").at("filled").get<int>(), 600);
    EXPECT_EQ(summary.at("source_voids").at("left"), 0);
    return summary.at("metadata").at("content_sha256").get<std::string>();
  };
  EXPECT_EQ(hash({folder / "whole.tif"}), hash({folder / "west.tif", folder / "east.tif"}));
}

TEST_F(VoidOptions, LosslessKeepsTheFilesOwnSamples) {
  const json summary = convert({"--valid-range", "100:5000", "--fill", "--lossless"});
  EXPECT_EQ(summary.at("metadata").at("statistics").at("voids"), 0);
  const RunResult restored = run_isohf({"export", folder / "a.isohf", folder / "back.tif"});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  const auto statistics = [&](const std::string& name) {
    return json::parse(run_isohf({"info", folder / name, "--stats", "--json", "-q"}).out).at("statistics");
  };
  EXPECT_EQ(statistics("back.tif"), statistics("a.tif"));
  EXPECT_EQ(statistics("back.tif").at("min"), -32768.0);
  EXPECT_EQ(run_isohf({"verify", folder / "a.isohf"}).exit_code, 0);
}

TEST_F(VoidOptions, SummarySaysHowManyVoidsThereAre) {
  const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--nodata", "-32768,9999"});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("252 samples of the input\n"));
  const RunResult treated = run_isohf(
      {"convert", folder / "a.tif", folder / "b.isohf", "--nodata", "-32768", "--valid-range", "100:5000", "--fill"});
  EXPECT_THAT(treated.out, HasSubstr("321 samples of the input, 72 by --valid-range; 321 filled, 0 left"));
}

TEST_F(VoidOptions, NonsenseIsAUsageError) {
  const std::vector<std::vector<std::string>> cases = {{"--fill-distance", "0"},   {"--fill-distance", "5000"},
                                                       {"--valid-range", "9:3"},   {"--valid-range", "7"},
                                                       {"--nodata", "-32768,far"}, {"--nodata", "40000"}};
  for (const std::vector<std::string>& options : cases) {
    const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "b.isohf", options[0], options[1]});
    EXPECT_EQ(result.exit_code, 2) << options[1];
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

TEST_F(VoidOptions, TilesWithoutElevationAreAbsent) {
  // The West half is void: its tiles take no bytes, and the count of written tiles holds them.
  write_int16_tiff(folder / "half.tif", 256, 128, [](std::int64_t c, std::int64_t r) {
    return static_cast<std::int16_t>(c < 128 ? -32768 : 5 + c + r);
  });
  const RunResult result = run_isohf({"convert", folder / "half.tif", folder / "half.isohf", "--nodata", "-32768",
                                      "--shape", "28x35", "--levels", "2", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary.at("tiles_written"), summary.at("tiles_expected"));
  EXPECT_GT(summary.at("tiles_void").get<int>(), summary.at("tiles_expected").get<int>() / 3);
  const json tiles = json::parse(run_isohf({"info", folder / "half.isohf", "--tiles", "--json"}).out).at("tiles");
  int absent = 0;
  for (const json& tile : tiles) absent += tile.at("stored").get<bool>() ? 0 : 1;
  EXPECT_EQ(absent, summary.at("tiles_void"));
  EXPECT_THAT(run_isohf({"info", folder / "half.isohf"}).out, HasSubstr(" wholly void"));
}

}  // namespace
}  // namespace isohf::test
