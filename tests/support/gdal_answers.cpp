#include "support/gdal_answers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"

namespace isohf::test {

using nlohmann::json;

bool has_gdal() {
  return run_gdal({"gdalinfo", "--version"}).exit_code == 0 &&
         run_gdal({"gdallocationinfo", "--help"}).exit_code != 127;
}

RunResult run_gdal(std::vector<std::string> command, const std::string& input, bool with_aux) {
  command.insert(command.begin(), {"/usr/bin/env", with_aux ? "GDAL_PAM_ENABLED=YES" : "GDAL_PAM_ENABLED=NO",
                                   "AAIGRID_DATATYPE=Float64"});
  RunOptions options;
  options.input = input;
  return run_program(command, options);
}

void expect_same_place(const json& ours, const json& gdal) {
  const auto& gt = gdal.at("geoTransform");
  const double dx = gt[1];
  const double dy = std::abs(gt[5].get<double>());
  const double height = gdal.at("size")[1];
  const double north = gt[5].get<double>() > 0.0 ? gt[3].get<double>() + dy * height : gt[3].get<double>();
  ASSERT_FALSE(ours.at("origin").is_null());
  EXPECT_NEAR(ours.at("origin").at("x").get<double>(), gt[0].get<double>() + dx / 2, 1e-6 * dx);
  EXPECT_NEAR(ours.at("origin").at("y").get<double>(), north - dy / 2, 1e-6 * dy);
  EXPECT_NEAR(ours.at("spacing").at("x").get<double>(), dx, 1e-9 * dx);
  EXPECT_NEAR(ours.at("spacing").at("y").get<double>(), dy, 1e-9 * dy);
}

void expect_same_samples(const std::string& file, bool turned) {
  const auto source = open_raster(file, {});
  const SourceInfo& info = source->info();
  std::mt19937 random(11);
  std::string places;
  std::vector<double> expected;
  for (int i = 0; i < 50; ++i) {
    const auto column = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(info.width));
    const auto row = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(info.height));
    expected.push_back(value_at(info.sample_type, read_window(*source, {column, row, 1, 1}), 0));
    places += std::to_string(column) + " " + std::to_string(turned ? info.height - 1 - row : row) + "\n";
  }
  const RunResult result = run_gdal({"gdallocationinfo", "-valonly", file}, places);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream values(result.out);
  for (const double sample : expected) {
    std::string text;
    ASSERT_TRUE(values >> text);
    const double theirs = std::stod(text);
    if (std::isnan(sample)) {
      EXPECT_TRUE(std::isnan(theirs));
    } else {
      EXPECT_NEAR(sample, theirs, 1e-13 * std::max(1.0, std::abs(theirs)));
    }
  }
}

}  // namespace isohf::test
