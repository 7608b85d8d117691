/// The .json beside a PNG, read again; raster_sink_test.cpp and raw_source_test.cpp have that of raw samples.
#include "formats/georeference/raster_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// 2 x 2 codes 0, 100, 65535 and a void one, in degrees on posts.
RasterSpec picture_spec() {
  RasterSpec spec = raster_spec(2, 2, SampleType::kUint16);
  spec.describe = true;
  spec.overwrite = true;
  spec.z_scale = 0.25;
  spec.z_offset = -400.0;
  spec.vertical_unit = "metre";
  spec.void_value = 7.0;
  spec.georeference = place_at(Registration::kPoint, HorizontalUnit::kDegree, -7.1, 45.3, 1.0 / 1200, 4326);
  spec.georeference->spacing_y = 1.0 / 3600;
  return spec;
}

void write_picture(const std::string& path) {
  const std::uint16_t codes[] = {0, 100, 65535, 7};
  write_raster(path, picture_spec(), std::as_bytes(std::span(codes)));
}

std::vector<float> elevations_of(HeightSource& source) {
  std::vector<float> elevations(4);
  heights_from_samples(source.info(), 0.0, read_whole(source), elevations);
  return elevations;
}

class RasterDescription : public InFolder {
 protected:
  const std::string path = folder / "a.png";
};

TEST_F(RasterDescription, GivesAPngPlaceAndMeaning) {
  write_picture(path);
  const auto source = open_raster(path, {});
  const SourceInfo& info = source->info();
  const Georeference& place = info.georeference;
  const Georeference wanted = *picture_spec().georeference;
  EXPECT_EQ(place.registration, wanted.registration);
  EXPECT_EQ(place.unit, wanted.unit);
  EXPECT_EQ(grid_of(place), grid_of(wanted));
  EXPECT_EQ(place.system.epsg, 4326);
  EXPECT_EQ(info.vertical_unit, "metre");
  EXPECT_THAT(info.warnings, IsEmpty());
  const std::vector<float> found = elevations_of(*source);
  EXPECT_EQ(found[0], -400.0F);
  EXPECT_EQ(found[1], -375.0F);
  EXPECT_EQ(found[2], 15983.75F);
  EXPECT_TRUE(std::isnan(found[3]));
}

TEST_F(RasterDescription, KeepsWhatHeightsAreAbove) {
  RasterSpec spec = picture_spec();
  const std::uint16_t codes[] = {0, 100, 65535, 7};
  for (const std::optional<int> code : {std::optional(5703), std::optional<int>()}) {
    spec.georeference->system.vertical_datum = "NAVD88 height";
    spec.georeference->system.vertical_epsg = code;
    write_raster(folder / "a.r16", spec, std::as_bytes(std::span(codes)));
    const ReferenceSystem system = open_raster(folder / "a.r16", {})->info().georeference.system;
    EXPECT_EQ(system.vertical_datum, "NAVD88 height");
    EXPECT_EQ(system.vertical_epsg, code);
    EXPECT_EQ(system.epsg, 4326);
  }
}

TEST_F(RasterDescription, OfRowsInAnotherOrderIsRefused) {
  write_picture(folder / "a.png");
  std::string text = read_file(folder / "a.png.json");
  const std::string order = "north to south";
  text.replace(text.find(order), order.size(), "south to north");
  write_file(folder / "a.png.json", text);
  EXPECT_THAT(failure_of(folder / "a.png", nullptr, [&] { (void)open_raster(folder / "a.png", {}); }),
              HasSubstr("row_order is south to north"));
}

TEST_F(RasterDescription, IsOverruledByTheUser) {
  write_picture(path);
  OpenOptions options;
  options.z_scale = 4.0;
  options.z_offset = 1600.0;
  options.void_values = {100.0};
  options.registration = Registration::kArea;
  const auto source = open_raster(path, options);
  EXPECT_EQ(source->info().georeference.registration, Registration::kArea);
  EXPECT_EQ(source->info().georeference.origin_x, -7.1);
  const std::vector<float> found = elevations_of(*source);
  EXPECT_TRUE(std::isnan(found[1]));
  EXPECT_EQ(found[3], 7.0F);
}

TEST_F(RasterDescription, OfAnotherProgramIsLeftAsideWithAWarning) {
  write_picture(path);
  std::filesystem::remove(path + ".json");
  std::filesystem::remove(path + ".aux.xml");  // which says the same in GDAL's words
  std::filesystem::remove(folder / "a.pgw");
  write_file(path + ".json", R"({"z_scale": 9, "tiles": []})");
  const auto source = open_raster(path, {});
  EXPECT_EQ(source->info().z_scale, 1.0);
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings.front(), HasSubstr("names no format"));
}

TEST_F(RasterDescription, IsRefusedWhereItIsDamaged) {
  write_picture(path);
  std::ifstream in(path + ".json");
  const std::string good{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const auto error_with = [&](const std::string& text) {
    std::filesystem::remove(path + ".json");
    write_file(path + ".json", text);
    const Error error = error_of([&] { (void)open_raster(path, {}); });
    const std::string what = error.what();
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_THAT(what, HasSubstr("a.png.json: "));
    EXPECT_THAT(what, HasSubstr("; mend it or move it away"));
    return what;
  };
  const auto says = [&](const std::string& found, const std::string& replacement) {
    std::string text = good;
    const std::size_t at = text.find(found);
    EXPECT_NE(at, std::string::npos) << found;
    return error_with(text.replace(at, found.size(), replacement));
  };
  const std::size_t end = good.find_last_of('}');
  for (std::size_t length = 0; length <= end; ++length) {
    EXPECT_THAT(error_with(good.substr(0, length)), HasSubstr("is not a JSON object")) << length;
  }
  EXPECT_THAT(error_with(std::string(70000, ' ')), HasSubstr("has 70000 bytes, must have 65536 at most"));
  EXPECT_THAT(says(R"("png")", R"("raw samples")"), HasSubstr("format is raw samples, must be png"));
  EXPECT_THAT(says(R"("png")", "4"), HasSubstr("format is no text"));
  EXPECT_THAT(says(R"("width": 2)", R"("width": 3)"),
              HasSubstr("is of 3 x 2 samples of uint16, the file beside it has 2 x 2 of uint16"));
  EXPECT_THAT(says("uint16", "uint8"), HasSubstr("2 x 2 samples of uint8"));
  EXPECT_THAT(says("uint16", "u16"), HasSubstr("sample_type"));
  EXPECT_THAT(says("0.25", "0"), HasSubstr("z_scale is 0"));
  EXPECT_THAT(says("0.25", "1e999"), HasSubstr("a.png.json"));
  EXPECT_THAT(says(R"("void_value": 7.0)", R"("void_value": 7.5)"), HasSubstr("no uint16 sample can hold"));
  EXPECT_THAT(says(R"("point")", R"("posts")"), HasSubstr("registration is posts, must be area, point or unknown"));
  EXPECT_THAT(says(R"("degree")", R"("degrees")"), HasSubstr("horizontal_unit is degrees"));
  EXPECT_THAT(says(R"("spacing_x": )", R"("spacing_x": -)"), HasSubstr("is not positive"));
  EXPECT_THAT(says(R"("origin_y")", R"("origin_why")"), HasSubstr("has one of origin_x and origin_y"));
  EXPECT_THAT(says("4326", "4326.5"), HasSubstr("crs_epsg is no EPSG code"));
}

}  // namespace
}  // namespace isohf::test
