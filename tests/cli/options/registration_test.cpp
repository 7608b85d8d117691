/// The half-pixel test: a ramp whose samples stand for areas or for points, in every format that says so in its own
/// way, lies where it should after convert, in sample, restore and verify.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "formats/write/raster_sink.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;

constexpr std::int64_t kWidth = 96;
constexpr std::int64_t kHeight = 80;
constexpr double kSpacing = 10.0;
constexpr double kWest = 500000.0;  ///< of sample (0, 0), in metres
constexpr double kNorth = 4000000.0;
constexpr double kSlopeX = 2.0;  ///< elevation for a sample
constexpr double kSlopeZ = 3.0;

double ramp(double column, double row) {
  return 100.0 + kSlopeX * column + kSlopeZ * row;
}

/// The share of a sample by which a place may be wrong.
constexpr double kShift = 1e-6;
/// The same as elevations show it: what a shift of this size would change them by, on average. Single ones are floats,
/// good to 2^-24 of 600 at each of a few steps. Lattices that end on the raster's edges meet its samples at few
/// different places, so that a quarter of that rounding remains in the average.
constexpr double kMeanShift = 2e-6;
constexpr double kRounding = 1e-4;

/// Writes the ramp with create_raster.
template <typename T>
void write_ramp(const std::string& path, SampleType type, std::optional<Registration> registration) {
  RasterSpec spec;
  spec.width = kWidth;
  spec.height = kHeight;
  spec.sample_type = type;
  if (registration) spec.georeference = place_at(*registration, HorizontalUnit::kMetre, kWest, kNorth, kSpacing);
  std::vector<T> samples;
  for (std::int64_t r = 0; r < kHeight; ++r) {
    for (std::int64_t c = 0; c < kWidth; ++c) {
      samples.push_back(static_cast<T>(ramp(static_cast<double>(c), static_cast<double>(r))));
    }
  }
  write_raster(path, spec, std::as_bytes(std::span(samples)));
}

std::string ascii_ramp(const char* kind) {
  // The first sample of a grid by its corners lies half a cell further in.
  const double half = std::string(kind) == "corner" ? kSpacing / 2 : 0.0;
  std::ostringstream text;
  text.precision(12);
  text << "ncols " << kWidth << "\nnrows " << kHeight << "\nxll" << kind << " " << kWest - half << "\nyll" << kind
       << " " << kNorth - kSpacing * (kHeight - 1) - half << "\ncellsize " << kSpacing << "\n";
  for (std::int64_t r = 0; r < kHeight; ++r) {
    for (std::int64_t c = 0; c < kWidth; ++c) text << ramp(static_cast<double>(c), static_cast<double>(r)) << " ";
    text << "\n";
  }
  return text.str();
}

class RegistrationOf : public testing::Test {
 protected:
  json info(const std::string& path) const {
    const RunResult result = run_isohf({"info", path, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out);
  }

  void convert(const std::string& path, const std::vector<std::string>& options) const {
    std::vector<std::string> arguments = {"convert", path,  folder / "a.isohf", "--overwrite",
                                          "--type",  "f32", "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const RunResult result = run_isohf(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
  }

  /// World place of the first sample is half a spacing inside for areas, at 0 for points; and the ramp lies there.
  void expect_surface(bool area) const {
    const json source = json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out).at("metadata").at("source");
    EXPECT_EQ(source.at("registration"), area ? "area" : "point");
    const double first = area ? kSpacing / 2 : 0.0;
    EXPECT_NEAR(source.at("first_sample").at("x").get<double>(), first, kShift * kSpacing);
    EXPECT_NEAR(source.at("first_sample").at("z").get<double>(), first, kShift * kSpacing);
    EXPECT_NEAR(source.at("spacing").at("x").get<double>(), kSpacing, 1e-9);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> column(3.0, kWidth - 4.0);
    std::uniform_real_distribution<double> row(3.0, kHeight - 4.0);
    std::ostringstream places;
    places.precision(17);
    std::vector<double> expected;
    for (int i = 0; i < 4000; ++i) {
      const double c = column(random);
      const double r = row(random);
      places << first + c * kSpacing << " " << first + r * kSpacing << "\n";
      expected.push_back(ramp(c, r));
    }
    RunOptions options;
    options.input = places.str();
    const RunResult result = run_isohf({"sample", folder / "a.isohf", "--json"}, options);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::istringstream lines(result.out);
    double sum = 0.0;
    for (const double elevation : expected) {
      std::string line;
      ASSERT_TRUE(std::getline(lines, line));
      const double found = json::parse(line).at("elevation");
      EXPECT_NEAR(found, elevation, kRounding);
      sum += found - elevation;
    }
    EXPECT_LT(std::abs(sum / static_cast<double>(expected.size())), kMeanShift * (kSlopeX + kSlopeZ));
  }

  void expect_verified(const std::string& path) const {
    const RunResult result =
        run_isohf({"verify", folder / "a.isohf", "--against", path, "--json", "--max-error", "0.0001"});
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    const json against = json::parse(result.out).at("against");
    EXPECT_EQ(against.at("samples_compared"), kWidth * kHeight);
    EXPECT_EQ(against.at("vertices").at("wrong"), 0);
  }

  /// Restored samples are the ramp's, and lie where the input's lay.
  void expect_restored() const {
    const RunResult result = run_isohf({"export", folder / "a.isohf", folder / "back.tif", "--overwrite", "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json before = info(folder / "a.isohf").at("metadata").at("source");
    const json& crs = before.at("crs");
    const json after = info(folder / "back.tif");
    EXPECT_EQ(after.at("registration"), before.at("registration"));
    EXPECT_EQ(after.at("origin").is_null(), crs.at("origin_x").is_null());
    for (const std::string axis : {"x", "y"}) {
      EXPECT_NEAR(after.at("spacing").at(axis).get<double>(), crs.at("spacing_" + axis).get<double>(), 1e-9);
      if (crs.at("origin_x").is_null()) continue;
      EXPECT_NEAR(after.at("origin").at(axis).get<double>(), crs.at("origin_" + axis).get<double>(), kShift * kSpacing);
    }
    const Raster restored = read_raster(folder / "back.tif");
    ASSERT_EQ(restored.info.width, kWidth);
    ASSERT_EQ(restored.info.height, kHeight);
    double sum = 0.0;
    int count = 0;
    constexpr std::int64_t kMargin = 24;  // at the edges, where the ramp goes on for two steps alone, splines swing
    for (std::int64_t r = kMargin; r < kHeight - kMargin; ++r) {
      for (std::int64_t c = kMargin; c < kWidth - kMargin; ++c) {
        const double expected = ramp(static_cast<double>(c), static_cast<double>(r));
        const double found = double{restored.at(c, r)};
        ASSERT_NEAR(found, expected, 2 * kRounding) << c << ", " << r;
        sum += found - expected;
        ++count;
      }
    }
    EXPECT_LT(std::abs(sum / count), kMeanShift * (kSlopeX + kSlopeZ));
  }

  void expect_all(const std::string& path, bool area, const std::vector<std::string>& options) const {
    SCOPED_TRACE(path);
    convert(path, options);
    expect_surface(area);
    expect_verified(path);  // the archive says how it was made
    expect_restored();
  }

  void expect_origin(const std::string& path, const char* registration) const {
    const json found = info(path);
    EXPECT_EQ(found.at("registration"), registration);
    EXPECT_NEAR(found.at("origin").at("x").get<double>(), kWest, kShift * kSpacing);
    EXPECT_NEAR(found.at("origin").at("y").get<double>(), kNorth, kShift * kSpacing);
  }

  TemporaryFolder folder;
};

TEST_F(RegistrationOf, GeoTiffIsWhatTheFileSays) {
  write_ramp<float>(folder / "area.tif", SampleType::kFloat32, Registration::kArea);
  write_ramp<float>(folder / "point.tif", SampleType::kFloat32, Registration::kPoint);
  expect_origin(folder / "area.tif", "area");
  expect_origin(folder / "point.tif", "point");
  expect_all(folder / "area.tif", true, {});
  expect_all(folder / "point.tif", false, {});
}

TEST_F(RegistrationOf, GeoTiffCanBeOverruled) {
  write_ramp<std::int16_t>(folder / "area.tif", SampleType::kInt16, Registration::kArea);
  expect_all(folder / "area.tif", false, {"--registration", "point"});
  // What its samples stand for changes, where they lie does not.
  const json found = info(folder / "a.isohf");
  EXPECT_EQ(found.at("metadata").at("source").at("crs").at("origin_x"), kWest);
  EXPECT_EQ(found.at("bounds").at("west"), kWest);
}

TEST_F(RegistrationOf, ExrAndPngAreWhatTheUserSays) {
  write_ramp<float>(folder / "r.exr", SampleType::kFloat32, std::nullopt);
  write_ramp<std::uint16_t>(folder / "r.png", SampleType::kUint16, std::nullopt);
  for (const char* name : {"r.exr", "r.png"}) {
    expect_all(folder / name, true, {"--sample-spacing", "10", "--registration", "area"});
    expect_all(folder / name, false, {"--sample-spacing", "10", "--registration", "point"});
    expect_all(folder / name, false, {"--sample-spacing", "10"});  // without a georeference: posts
  }
}

TEST_F(RegistrationOf, SurvivesRestoringASourceWithoutGeoreference) {
  write_ramp<float>(folder / "r.exr", SampleType::kFloat32, std::nullopt);
  for (const char* registration : {"area", "point"}) {
    convert(folder / "r.exr", {"--registration", registration});
    for (const char* extension : {".tif", ".r32"}) {
      const std::string path = folder / ("back" + std::string(extension));
      const RunResult result = run_isohf({"export", folder / "a.isohf", path, "--overwrite", "-q"});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      const json found = info(path);
      EXPECT_EQ(found.at("registration"), registration) << path;
      EXPECT_TRUE(found.at("origin").is_null()) << path;
      EXPECT_EQ(found.at("spacing").at("x"), 1.0) << path;
      EXPECT_EQ(found.at("warnings").size(), 0U) << path;
    }
  }
}

TEST_F(RegistrationOf, AsciiGridsCornerAndCentreAreTheSamePlace) {
  for (const char* kind : {"corner", "center"}) {
    const std::string path = folder / (std::string(kind) + ".asc");
    write_file(path, ascii_ramp(kind));
    expect_origin(path, "area");
    expect_all(path, true, {});
  }
}

TEST_F(RegistrationOf, HgtLiesOnPosts) {
  constexpr int kSide = 1201;
  std::string samples;
  for (int r = 0; r < kSide; ++r) {
    for (int c = 0; c < kSide; ++c) {
      const int sample = 100 + 2 * c + 3 * r;
      samples += static_cast<char>(sample >> 8);
      samples += static_cast<char>(sample & 0xFF);
    }
  }
  write_file(folder / "N10E020.hgt", samples);
  const json found = info(folder / "N10E020.hgt");
  EXPECT_EQ(found.at("registration"), "point");
  EXPECT_EQ(found.at("origin").at("x"), 20.0);
  EXPECT_EQ(found.at("origin").at("y"), 11.0);
  EXPECT_EQ(found.at("bounds").at("east"), 21.0);
  EXPECT_EQ(found.at("bounds").at("south"), 10.0);
}

}  // namespace
}  // namespace isohf::test
