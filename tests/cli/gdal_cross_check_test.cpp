/// What isohf understands of the shared data, against what GDAL's programs say of the same files. GDAL is a test tool
/// here; nothing links it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "formats/registry.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;

/// Runs one of GDAL's programs; statistics go to no file beside the raster. ASCII grids are read as float64, which
/// holds the numbers as written; GDAL would round them to float32.
RunResult run_gdal(std::vector<std::string> command, const std::string& input = {}) {
  command.insert(command.begin(), {"/usr/bin/env", "GDAL_PAM_ENABLED=NO", "AAIGRID_DATATYPE=Float64"});
  RunOptions options;
  options.input = input;
  return run_program(command, options);
}

bool has_gdal() {
  return run_gdal({"gdalinfo", "--version"}).exit_code == 0 &&
         run_gdal({"gdallocationinfo", "--help"}).exit_code != 127;
}

/// Links to all files of the shared data in one folder: gdalinfo -stats leaves files beside EHdr grids whatever it is
/// told. Returns those that are rasters.
std::vector<std::filesystem::path> link_shared_files(const TemporaryFolder& folder) {
  const std::filesystem::path root = std::filesystem::path(ISOHF_SOURCE_DIR) / ".." / "shared" / "data";
  std::vector<std::filesystem::path> files;
  for (const auto& from : {root, root / "derived"}) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(from, error)) {
      if (!entry.is_regular_file()) continue;
      const std::filesystem::path link = folder / entry.path().filename().string();
      std::filesystem::create_symlink(std::filesystem::canonical(entry.path()), link);
      // Not sidecars, text, and samples without a header, which GDAL cannot open either.
      const std::string ending = entry.path().extension();
      if (ending != ".md" && ending != ".hdr" && ending != ".prj" && ending != ".r16") files.push_back(link);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Where the two differ on purpose.
enum class Difference { kNone, kSamples, kPlace, kRows };
struct Known {
  Difference difference;
  const char* why;
};
const std::map<std::string, Known> kKnown = {
    {"ldem_4_cropped.img",
     {Difference::kSamples, "GDAL reads the label's text as samples, the pointer lies inside it"}},
    {"megt90n000cb.lbl", {Difference::kPlace, "GDAL has metres of the map projection, isohf degrees of the label"}},
    {"megt90n000cb.img", {Difference::kPlace, "as its label"}},
    {"besseggen_utm.dem",
     {Difference::kRows, "GDAL moves the grid to multiples of its spacing, half a post off, and adds a row of voids"}},
};

Difference known_difference(const std::string& name) {
  const auto found = kKnown.find(name);
  return found == kKnown.end() ? Difference::kNone : found->second.difference;
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

/// GDAL's statistics are of samples, isohf's of elevations.
void expect_same_statistics(const json& ours, const json& band, int void_rows_of_theirs) {
  const json& statistics = ours.at("statistics");
  const double scale = ours.at("z_scale");
  const double offset = ours.at("z_offset");
  const auto found = band.at("metadata").find("");
  const auto number = [&](const char* metadata, const char* member) {
    if (found != band.at("metadata").end() && found->contains(metadata)) {
      return std::stod(found->at(metadata).get<std::string>());
    }
    return band.at(member).get<double>();
  };
  const auto expect = [&](const char* what, const char* metadata, const char* member) {
    const double theirs = number(metadata, member) * scale + offset;
    // Thirteen digits are printed; EHdr files have three behind the point.
    const bool has_metadata = found != band.at("metadata").end() && found->contains(metadata);
    const double tolerance = has_metadata ? 1e-11 * std::max(1.0, std::abs(theirs)) : 6e-4;
    EXPECT_NEAR(statistics.at(what).get<double>(), theirs, tolerance) << what;
  };
  expect("min", "STATISTICS_MINIMUM", "minimum");
  expect("max", "STATISTICS_MAXIMUM", "maximum");
  expect("mean", "STATISTICS_MEAN", "mean");
  if (found != band.at("metadata").end() && found->contains("STATISTICS_VALID_PERCENT")) {
    const double samples = statistics.at("samples");
    const double theirs = samples + ours.at("width").get<double>() * void_rows_of_theirs;
    const double valid = 100.0 * (samples - statistics.at("voids").get<double>()) / theirs;
    EXPECT_NEAR(valid, std::stod(found->at("STATISTICS_VALID_PERCENT").get<std::string>()), 0.0101);
  }
}

double sample_as_number(SampleType type, const std::byte* at) {
  const auto load = [&](auto value) {
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case SampleType::kUint8:
      return load(std::uint8_t{});
    case SampleType::kUint16:
      return load(std::uint16_t{});
    case SampleType::kInt16:
      return load(std::int16_t{});
    case SampleType::kInt32:
      return load(std::int32_t{});
    case SampleType::kFloat32:
      return load(float{});
    case SampleType::kFloat64:
      return load(double{});
    default:
      ADD_FAILURE() << "no file of GDAL's has samples of type " << to_string(type);
      return 0.0;
  }
}

/// Fifty samples at random places.
void expect_same_samples(const std::string& file, bool turned) {
  const auto source = open_source(file, {});
  const SourceInfo& info = source->info();
  std::mt19937 random(11);
  std::string places;
  std::vector<double> expected;
  for (int i = 0; i < 50; ++i) {
    const auto column = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(info.width));
    const auto row = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(info.height));
    std::vector<std::byte> raw(size_bytes(info.sample_type));
    source->read_window({column, row, 1, 1}, raw);
    expected.push_back(sample_as_number(info.sample_type, raw.data()));
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

TEST(GdalCrossCheck, SaysTheSameOfEveryFileThatBothRead) {
  const TemporaryFolder folder;
  const std::vector<std::filesystem::path> files = link_shared_files(folder);
  if (files.empty()) GTEST_SKIP() << "the shared data folder is not here";
  if (!has_gdal()) GTEST_SKIP() << "gdalinfo and gdallocationinfo are not installed (Debian: gdal-bin)";
  int compared = 0;
  for (const std::filesystem::path& path : files) {
    const std::string file = path;
    SCOPED_TRACE(file);
    const RunResult theirs = run_gdal({"gdalinfo", "-json", "-stats", file});
    if (theirs.exit_code != 0) continue;  // OpenEXR, NumPy, PDS3 data beside its label
    const json gdal = json::parse(theirs.out);
    if (gdal.at("bands").size() != 1) continue;  // packed elevations: GDAL sees colours
    const RunResult result = run_isohf({"info", file, "--stats", "--json", "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json ours = json::parse(result.out);
    const json& band = gdal.at("bands")[0];
    const std::string name = path.filename();
    EXPECT_EQ(ours.at("width"), gdal.at("size")[0]);
    const Difference difference = known_difference(name);
    const int more_rows = difference == Difference::kRows ? 1 : 0;
    EXPECT_EQ(ours.at("height").get<int>() + more_rows, gdal.at("size")[1].get<int>());
    std::string type = band.at("type");
    std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
    if (gdal.at("driverShortName") != "AAIGrid") {
      EXPECT_EQ(ours.at("sample_type"), type);
    }
    const bool has_place = gdal.contains("geoTransform") && gdal.at("geoTransform")[1] != 1.0;
    if (has_place && (difference == Difference::kNone)) expect_same_place(ours, gdal);
    if (difference != Difference::kSamples) {
      expect_same_statistics(ours, band, more_rows);
      const bool turned = gdal.contains("geoTransform") && gdal.at("geoTransform")[5] > 0.0;
      expect_same_samples(file, turned);
    }
    ++compared;
  }
  EXPECT_GE(compared, 40);
}

}  // namespace
}  // namespace isohf::test
