/// Every file of the shared data folder, opened as a user would open it, against the reference beside it, which another
/// reader wrote.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "formats/open_options.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/raster.h"
#include "isohf/sampling/source/source_statistics.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"

namespace isohf::test {
namespace {

nlohmann::json reference_of(const std::filesystem::path& file) {
  return nlohmann::json::parse(std::ifstream(real_data() / "ref" / (file.filename().string() + ".json")));
}

/// GDAL's rows of some files run from South to North, ours never do: its row r is then our row height - 1 - r.
bool is_turned(const nlohmann::json& ref) {
  return ref.at("geotransform").is_array() && ref.at("geotransform")[5].get<double>() > 0.0;
}

std::int64_t our_row(const nlohmann::json& ref, const nlohmann::json& pixel, std::int64_t height) {
  const std::int64_t row = pixel.at("row");
  return is_turned(ref) ? height - 1 - row : row;
}

/// GDAL's geotransform names the corner of the pixel, isohf the sample itself.
void expect_reference_place(const Georeference& place, const nlohmann::json& gt, std::int64_t height) {
  if (gt.is_null()) {
    EXPECT_FALSE(place.has_origin);
    return;
  }
  const double dx = gt[1];
  const double dy = gt[5];
  // Sums of half pixels in another order differ in the last bits of coordinates up to 1e7.
  const double tolerance = 1e-9 * std::max({1.0, std::abs(gt[0].get<double>()), std::abs(gt[3].get<double>())});
  EXPECT_TRUE(place.has_origin);
  EXPECT_NEAR(place.spacing_x, dx, 1e-15 * dx);
  EXPECT_NEAR(place.spacing_y, std::abs(dy), 1e-15 * std::abs(dy));
  EXPECT_NEAR(place.origin_x, gt[0].get<double>() + dx / 2, tolerance);
  const double first_row = dy > 0.0 ? static_cast<double>(height) - 0.5 : 0.5;
  EXPECT_NEAR(place.origin_y, gt[3].get<double>() + first_row * dy, tolerance);
}

/// Holds what `source` delivers against the reference of the same file.
void expect_as_reference(HeightSource& source, const nlohmann::json& ref) {
  const SourceInfo& info = source.info();
  ASSERT_EQ(info.width, ref.at("width").get<std::int64_t>());
  ASSERT_EQ(info.height, ref.at("height").get<std::int64_t>());
  std::string type = ref.at("dtype");
  std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
  EXPECT_EQ(to_string(info.sample_type), type);

  const Georeference& geo = info.georeference;
  expect_reference_place(geo, ref.at("geotransform"), info.height);
  if (ref.at("area_or_point").is_string()) {
    EXPECT_EQ(geo.registration, ref.at("area_or_point") == "Point" ? Registration::kPoint : Registration::kArea);
  }
  if (ref.at("crs").is_object() && ref.at("crs").at("epsg").is_number()) {
    EXPECT_EQ(geo.system.epsg, ref.at("crs").at("epsg").get<int>());
  }
  EXPECT_EQ(info.z_scale, ref.at("scale").get<double>());
  EXPECT_EQ(info.z_offset, ref.at("offset").get<double>());

  const std::vector<double> values = values_of(info.sample_type, read_whole(source));
  double lowest = INFINITY;
  double highest = -INFINITY;
  double sum = 0.0;
  std::int64_t voids = 0;
  for (const double value : values) {
    if (is_void(info, value)) {
      ++voids;
      continue;
    }
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
    sum += value;
  }
  EXPECT_EQ(voids, ref.at("nodata_count").get<std::int64_t>() + ref.at("inf_count").get<std::int64_t>());
  EXPECT_EQ(lowest, ref.at("raw_min").get<double>());
  EXPECT_EQ(highest, ref.at("raw_max").get<double>());
  const double mean = sum / static_cast<double>(static_cast<std::int64_t>(values.size()) - voids);
  // The reference sums in another order.
  EXPECT_NEAR(mean, ref.at("raw_mean").get<double>(), 1e-9 * std::max(1.0, std::abs(mean)));
  for (const char* list : {"pixels", "corners"}) {
    for (const auto& pixel : ref.at(list)) {
      const std::int64_t column = pixel.at("col");
      const double value = values[static_cast<std::size_t>(our_row(ref, pixel, info.height) * info.width + column)];
      if (pixel.at("raw").is_string()) {
        EXPECT_FALSE(std::isfinite(value)) << pixel;
      } else {
        EXPECT_EQ(value, pixel.at("raw").get<double>()) << pixel;
      }
    }
  }
}

/// What a user has to say about a file.
OpenOptions options_for(const std::string& name, const nlohmann::json& ref) {
  OpenOptions options;
  if (name.ends_with(".r16")) {
    options.raw = RawLayout{ref.at("width"), ref.at("height"), SampleType::kUint16, false};
  }
  const std::map<std::string, std::string> encodings = {{"terrarium.png", "terrarium"},
                                                        {"n44e006_mapbox.png", "mapbox"},
                                                        {"gale_rgba_float_16_57775_31917.png", "rgba-float"}};
  if (const auto found = encodings.find(name); found != encodings.end()) options.encoding = found->second;
  return options;
}

/// References that hold something else than the file's elevations.
const std::map<std::string, std::string> kOtherSamples = {
    {"ldem_4_cropped.img",
     "the label's pointer ^IMAGE lies inside the label: the reference holds label text as samples (2573 is a line "
     "break), isohf reads what follows the label, and says so"}};

/// Files of formats that isohf does not read, and what converts them.
const std::map<std::string, std::string> kRefused = {{"besseggen_utm.dem", "gdal_translate {} OUT.tif"},
                                                     {"jacksboro_fault_dem.npz", "np.load(\"{}\")"}};

/// References whose place is not ours, and why.
const std::map<std::string, std::string> kOtherPlaces = {
    {"ldem_4_cropped.img", "the reference has metres of an equidistant cylindrical projection, isohf degrees"}};

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

/// Whether the reference has what isohf reads: types, places and systems, and raw samples.
bool is_compared_whole(const std::string& name, const nlohmann::json& ref) {
  if (name.ends_with(".png")) return ref.at("dtype") == "UInt16";
  return !name.ends_with(".img") && !name.ends_with(".npy");
}

/// What holds of every file of a kind, beyond its reference.
void expect_kind(HeightSource& source, const std::filesystem::path& file, const nlohmann::json& ref) {
  static const std::map<std::string, std::string> kFormats = {
      {".asc", "ESRI ASCII grid"}, {".dt0", "DTED"},    {".dt1", "DTED"},
      {".flt", "GridFloat"},       {".bil", "EHdr"},    {".hgt", "SRTM HGT"},
      {".npy", "NumPy"},           {".exr", "OpenEXR"}, {".png", "PNG"},
      {".cub", "ISIS3 cube"},      {".img", "PDS3"},    {".tif", "GeoTIFF"},
      {".TIF", "GeoTIFF"}};
  const SourceInfo& info = source.info();
  const Georeference& place = info.georeference;
  const std::string name = file.filename();
  const std::string ending = file.extension();
  if (const auto found = kFormats.find(ending); found != kFormats.end()) {
    EXPECT_EQ(info.format, found->second);
  }
  if (ending == ".dt0" || ending == ".dt1" || name.find(".hgt") != std::string::npos) {
    EXPECT_EQ(info.vertical_unit, "metre");
    EXPECT_EQ(place.system.body, "Earth");
  }
  if (name.find(".hgt") != std::string::npos) {
    EXPECT_EQ(place.system.vertical_datum, "EGM96");
  }
  if (ending == ".cub") {
    EXPECT_EQ(place.unit, HorizontalUnit::kMetre);
    EXPECT_EQ(place.system.name, ref.at("crs").at("name").get<std::string>());
    EXPECT_EQ(place.system.body, name == "Ares4_Marth_Crater.cub" ? "Mars" : "Moon");
  }
  if (ending == ".r16" || ending == ".exr") {
    EXPECT_EQ(place.registration, Registration::kUnknown);
    EXPECT_FALSE(place.has_origin);
  }
  const bool is_grid = ending == ".flt" || ending == ".bil";
  const bool has_prj = std::filesystem::exists(std::filesystem::path(file).replace_extension(".prj"));
  if (is_grid) {
    EXPECT_EQ(place.system.wkt.empty() && !place.system.epsg, !has_prj);
    // The header stands for the grid as well.
    const auto by_header = open_raster(std::filesystem::path(file).replace_extension(".hdr").string(), {});
    EXPECT_EQ(read_whole(*by_header), read_whole(source));
  }
  // Degrees that nothing declares; a label that ends behind its samples' beginning; a place that is in other arrays.
  const std::set<std::string> kOfFormats = {".dt0", ".dt1", ".hgt", ".zip", ".cub", ".tif", ".TIF"};
  if (kOfFormats.contains(ending) || (is_grid && has_prj)) {
    EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  }
  if ((is_grid && !has_prj) || name == "ldem_4_cropped.img") {
    EXPECT_EQ(info.warnings.size(), 1U);
  }
}

TEST(SharedData, EveryFileIsReadAsItsReferenceSays) {
  if (!std::filesystem::is_directory(real_data() / "ref")) GTEST_SKIP() << kNoRealFiles;
  set_module_folder(ISOHF_BIN_DIR);  // one of them lies on ETRS89 by keys
  std::set<std::string> seen;
  for (const auto& entry : std::filesystem::directory_iterator(real_data() / "ref")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    const std::filesystem::path file = file_of(name);
    ASSERT_FALSE(file.empty()) << "no such file";
    seen.insert(name);
    if (const auto refused = kRefused.find(name); refused != kRefused.end()) {
      EXPECT_THAT(error_of([&] { (void)open_raster(file.string(), {}); }).what(),
                  ::testing::HasSubstr(fmt::format(fmt::runtime(refused->second), file.string())));
      continue;
    }
    const nlohmann::json ref = reference_of(file);
    if (name.ends_with(".r16")) {  // the square that the refusal suggests is the file's
      EXPECT_THAT(error_of([&] { (void)open_raster(file.string(), {}); }).what(),
                  ::testing::HasSubstr(fmt::format("`raw` {0}x{0}:u16le", ref.at("width").get<int>())));
    }
    const auto source = open_raster(file.string(), options_for(name, ref));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.width, ref.at("width").get<std::int64_t>());
    EXPECT_EQ(info.height, ref.at("height").get<std::int64_t>());
    if (is_compared_whole(name, ref)) {
      expect_as_reference(*source, ref);
    } else {
      if (!kOtherPlaces.contains(name)) expect_place(info, ref);
      if (!kOtherSamples.contains(name)) expect_samples(*source, ref);
    }
    expect_kind(*source, file, ref);
  }
  EXPECT_EQ(seen.size(), 69U) << "the folder's manifest lists so many";
  for (const auto& exceptions : {kOtherSamples, kOtherPlaces, kRefused}) {
    for (const auto& [name, why] : exceptions) EXPECT_TRUE(seen.contains(name)) << name << ": " << why;
  }
}

TEST(SharedData, ALabelIsReadAsItsSamplesAre) {
  const auto label = real_data() / "megt90n000cb.lbl";
  if (!std::filesystem::exists(label)) GTEST_SKIP() << kNoRealFiles;
  const auto source = open_raster(label.string(), {});
  const SourceInfo& info = source->info();
  expect_place(info, reference_of("megt90n000cb.img"));
  expect_samples(*source, reference_of("megt90n000cb.img"));
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(info.georeference.registration, Registration::kArea);
  EXPECT_EQ(info.georeference.system.body, "Mars");
  EXPECT_EQ(info.georeference.system.semi_major_axis_m, 3396000.0);
  EXPECT_EQ(info.georeference.system.inverse_flattening, 0.0);
  EXPECT_EQ(info.vertical_unit, "metre");
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
}

TEST(SharedData, TiffsTellTheirBodies) {
  if (real_files({".tif"}).empty()) GTEST_SKIP() << kNoRealFiles;
  const auto system = [](const std::string& name) {
    return open_raster((real_data() / name).string(), {})->info().georeference.system;
  };
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").body, "Mars");
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").semi_major_axis_m, 3396190.0);
  EXPECT_EQ(system("missionDEM_gale_hirise.tif").inverse_flattening, 0.0);
  EXPECT_EQ(system("derived/mola_4ppd_lon360.tif").body, "Mars");
  EXPECT_EQ(system("derived/mola_4ppd_lon360.tif").name, "GCS_Mars_2000_Sphere");
  EXPECT_EQ(system("N2000000E3000000_noepsg.tif").body, "Earth");
  EXPECT_FALSE(system("N2000000E3000000_noepsg.tif").epsg);
  EXPECT_EQ(system("mt_fuji_90m.tif").body, "Earth");
  EXPECT_EQ(system("N00E010_utm32.tif").name, "WGS 84 / UTM zone 32N");
}

}  // namespace
}  // namespace isohf::test
