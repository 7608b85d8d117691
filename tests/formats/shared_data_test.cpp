/// Every file of the shared data folder, opened as a user would open it, against the reference beside it, which another
/// reader wrote. The formats' own tests look closer; this one sees to it that no file is left out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "formats/open_options.h"
#include "formats/raster_reference.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/raster.h"
#include "isohf/surface/source/source_statistics.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"

namespace isohf::test {
namespace {

/// What a user has to say about a file.
OpenOptions options_for(const std::string& name, const nlohmann::json& ref) {
  OpenOptions options;
  if (name.ends_with(".r16")) {
    options.raw = RawLayout{ref.at("width"), ref.at("height"), SampleType::kUint16, false};
  }
  const std::map<std::string, std::string> encodings = {{"terrarium.png", "terrarium"},
                                                        {"n44e006_mapbox.png", "mapbox"},
                                                        {"gale_rgba_float_16_57775_31917.png", "rgba-float"}};
  if (const auto found = encodings.find(name); found != encodings.end()) options.channel = found->second;
  return options;
}

/// References that hold something else than the file's elevations.
const std::map<std::string, std::string> kOtherSamples = {
    {"ldem_4_cropped.img",
     "the label's pointer ^IMAGE lies inside the label: the reference holds label text as samples (2573 is a line "
     "break), isohf reads what follows the label, and says so"}};

/// A file of a format that isohf does not read.
const std::string kRefused = "besseggen_utm.dem";

/// References whose place is not ours, and why.
const std::map<std::string, std::string> kOtherPlaces = {
    {"ldem_4_cropped.img", "the reference has metres of an equidistant cylindrical projection, isohf degrees"},
    {"jacksboro_fault_dem.npz",
     "the place is in other arrays of the file, whose y runs the wrong way; NumPy has none"}};

void expect_place(const SourceInfo& info, const nlohmann::json& ref) {
  const char* const key =
      ref.contains("geotransform_from_label_bounds_deg") ? "geotransform_from_label_bounds_deg" : "geotransform";
  const Georeference& place = info.georeference;
  if (ref.at(key).is_null()) {
    EXPECT_FALSE(place.has_origin);
    return;
  }
  const auto& gt = ref.at(key);
  const double dx = gt[1];
  const double dy = std::abs(gt[5].get<double>());
  const bool turned = gt[5].get<double>() > 0.0;  // GDAL's rows run North; ours never do
  const double north = turned ? gt[3].get<double>() + dy * static_cast<double>(info.height) : gt[3].get<double>();
  ASSERT_TRUE(place.has_origin);
  // A millionth of a sample.
  EXPECT_NEAR(place.origin_x, gt[0].get<double>() + dx / 2, 1e-6 * dx);
  EXPECT_NEAR(place.origin_y, north - dy / 2, 1e-6 * dy);
  EXPECT_NEAR(place.spacing_x, dx, 1e-9 * dx);
  EXPECT_NEAR(place.spacing_y, dy, 1e-9 * dy);
}

void expect_samples(HeightSource& source, const nlohmann::json& ref) {
  const SourceInfo& info = source.info();
  const std::vector<std::byte> raw = read_whole(source);
  SourceSurvey survey(info, true);
  survey.add(raw);
  const SourceScan scan = survey.scan();
  EXPECT_EQ(scan.voids, ref.at("nodata_count").get<std::int64_t>() + ref.at("inf_count").get<std::int64_t>());
  EXPECT_EQ(scan.valid, ref.at("valid_count").get<std::int64_t>());
  // Packed elevations are multiples of 0.1 and 1/256 in one way of computing them, and nearly so in another.
  const auto tolerance = [](double value) { return 1e-12 * std::max(1.0, std::abs(value)); };
  const double least = ref.at("min");
  const double most = ref.at("max");
  EXPECT_NEAR(scan.range.min, least, tolerance(least));
  EXPECT_NEAR(scan.range.max, most, tolerance(most));
  // Sums in another order.
  EXPECT_NEAR(survey.mean().value_or(NAN), ref.at("mean").get<double>(), 1e-9 * std::max(1.0, std::abs(most)));
  for (const char* list : {"pixels", "corners"}) {
    for (const auto& pixel : ref.at(list)) {
      const std::int64_t row = our_row(ref, pixel, info.height);
      const std::int64_t column = pixel.at("col");
      const double sample = value_at(info.sample_type, raw, static_cast<std::size_t>(row * info.width + column));
      if (pixel.at("value").is_null()) {
        EXPECT_TRUE(is_void(info, sample)) << column << ", " << row;
      } else {
        const double value = pixel.at("value");
        EXPECT_NEAR(sample * info.z_scale + info.z_offset, value, tolerance(value)) << column << ", " << row;
      }
    }
  }
}

std::filesystem::path file_of(const std::string& name) {
  for (const auto& folder : {real_data(), real_data() / "derived"}) {
    if (std::filesystem::exists(folder / name)) return folder / name;
  }
  return {};
}

TEST(SharedData, EveryFileIsReadAsItsReferenceSays) {
  if (!std::filesystem::is_directory(real_data() / "ref")) GTEST_SKIP() << kNoRealFiles;
  std::set<std::string> seen;
  for (const auto& entry : std::filesystem::directory_iterator(real_data() / "ref")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    const std::filesystem::path file = file_of(name);
    ASSERT_FALSE(file.empty()) << "no such file";
    seen.insert(name);
    if (name == kRefused) {
      EXPECT_THAT(error_of([&] { (void)open_raster(file.string(), {}); }).what(),
                  ::testing::HasSubstr("gdal_translate " + file.string() + " OUT.tif"));
      continue;
    }
    const nlohmann::json ref = reference_of(file);
    const auto source = open_raster(file.string(), options_for(name, ref));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.width, ref.at("width").get<std::int64_t>());
    EXPECT_EQ(info.height, ref.at("height").get<std::int64_t>());
    if (!kOtherPlaces.contains(name)) expect_place(info, ref);
    if (!kOtherSamples.contains(name)) expect_samples(*source, ref);
  }
  EXPECT_EQ(seen.size(), 69U) << "the folder's manifest lists so many";
  for (const auto& exceptions : {kOtherSamples, kOtherPlaces}) {
    for (const auto& [name, why] : exceptions) EXPECT_TRUE(seen.contains(name)) << name << ": " << why;
  }
}

TEST(SharedData, LabelTextIsNoElevation) {
  const auto file = real_data() / "ldem_4_cropped.img";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << kNoRealFiles;
  const auto source = open_raster(file.string(), {});
  SourceSurvey survey(source->info(), false);
  survey.add(read_whole(*source));
  // The Moon's North pole lies within a kilometre of the mean radius; the text would be 10 km above it.
  EXPECT_GT(survey.scan().range.min, 1737400.0 - 1000.0);
  EXPECT_LT(survey.scan().range.max, 1737400.0 + 1000.0);
  EXPECT_EQ(source->info().warnings.size(), 1U);
}

}  // namespace
}  // namespace isohf::test
