/// What isohf understands of the shared data, against what GDAL's programs say of the same files. GDAL is a test tool
/// here; nothing links it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "support/gdal_answers.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;

/// Links to all files of the shared data in one folder: gdalinfo -stats leaves files beside EHdr grids whatever it is
/// told. Returns those that are rasters.
std::vector<std::filesystem::path> link_real_files(const TemporaryFolder& folder) {
  std::vector<std::filesystem::path> links;
  for (const auto& file : real_files()) {
    const std::filesystem::path link = folder / file.filename();
    std::filesystem::create_symlink(std::filesystem::canonical(file), link);
    // Not sidecars, text, and samples without a header, which GDAL cannot open either.
    const std::string ending = file.extension();
    if (ending != ".md" && ending != ".hdr" && ending != ".prj" && ending != ".r16") links.push_back(link);
  }
  std::sort(links.begin(), links.end());
  return links;
}

/// Where the two differ on purpose.
enum class Difference { kNone, kSamples, kPlace, kWholeRows };
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
     {Difference::kWholeRows,
      "GDAL moves the grid to multiples of its spacing, half a post off, and adds a row of voids"}},
};

Difference known_difference(const std::string& name) {
  const auto found = kKnown.find(name);
  return found == kKnown.end() ? Difference::kNone : found->second.difference;
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

TEST(GdalCrossCheck, SaysTheSameOfEveryFileThatBothRead) {
  const TemporaryFolder folder;
  const std::vector<std::filesystem::path> files = link_real_files(folder);
  if (files.empty()) GTEST_SKIP() << kNoRealFiles;
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
    const int more_rows = difference == Difference::kWholeRows ? 1 : 0;
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
