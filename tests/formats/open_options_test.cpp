#include "formats/open_options.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/error_of.h"

namespace isohf {
namespace {

constexpr double kFloatMax = std::numeric_limits<float>::max();

SourceInfo sample_info(SampleType type) {
  SourceInfo info;
  info.path = "a.tif";
  info.width = info.height = 10;
  info.sample_type = type;
  info.void_values = {-1.0};
  return info;
}

TEST(VoidValueAsStored, RoundsToTheTypesPrecision) {
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, -3.4e38), static_cast<double>(-3.4e38F));
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, 0.1), static_cast<double>(0.1F));
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, 1e-42), static_cast<double>(1e-42F));
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat64, 0.1), 0.1);
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat16, 0.1), static_cast<double>(float_from_half(0x2E66)));
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, 0.0), 0.0);
}

TEST(VoidValueAsStored, TakesRoundedTextsOfTheLargestFloat) {
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, -3.40282346638529e+38), -kFloatMax);
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, -3.4028234663852886e+38), -kFloatMax);
  EXPECT_EQ(void_value_as_stored(SampleType::kFloat32, 3.4028235e+38), kFloatMax);
  EXPECT_FALSE(void_value_as_stored(SampleType::kFloat32, -1.7976931348623157e308));
}

TEST(VoidValueAsStored, RefusesWhatAnIntegerTypeCannotHold) {
  EXPECT_EQ(void_value_as_stored(SampleType::kInt16, -32768.0), -32768.0);
  EXPECT_FALSE(void_value_as_stored(SampleType::kInt16, 32768.0));
  EXPECT_FALSE(void_value_as_stored(SampleType::kUint8, -1.0));
  EXPECT_FALSE(void_value_as_stored(SampleType::kInt32, 0.5));
  EXPECT_FALSE(void_value_as_stored(SampleType::kUint16, std::nan("")));
  EXPECT_TRUE(std::isnan(*void_value_as_stored(SampleType::kFloat32, std::nan(""))));
}

TEST(ApplyOpenOptions, AScaleOfTheUnitsSizeMakesMetres) {
  for (const auto& [scale, unit] : {std::pair(0.3048, "metre"), {0.1, "foot"}, {1.0, "foot"}}) {
    SourceInfo info = sample_info(SampleType::kInt16);
    info.vertical_unit = "foot";
    info.metres_per_vertical_unit = 0.3048;
    info.z_scale = 0.5;
    info.z_offset = 100.0;
    OpenOptions options;
    options.z_scale = scale;
    apply_open_options(info, options);
    EXPECT_EQ(info.z_scale, 0.5 * scale);
    EXPECT_EQ(info.z_offset, 100.0 * scale);
    EXPECT_EQ(info.vertical_unit, unit);
    EXPECT_EQ(info.metres_per_vertical_unit, info.vertical_unit == "metre" ? 1.0 : 0.3048);
    EXPECT_EQ(info.warnings.size(), info.vertical_unit == "metre" ? 1U : 0U);
  }
}

TEST(ApplyOpenOptions, OverridesWhatTheFileSays) {
  SourceInfo info = sample_info(SampleType::kFloat32);
  OpenOptions options;
  options.registration = Registration::kPoint;
  options.void_values = {-9999.0};
  options.z_scale = 0.5;
  options.z_offset = 7.0;
  apply_open_options(info, options);
  EXPECT_EQ(info.georeference.registration, Registration::kPoint);
  EXPECT_EQ(info.void_values, std::vector<double>{-9999.0});
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 7.0);
  EXPECT_TRUE(info.warnings.empty());
}

TEST(ApplyOpenOptions, ScaleAndOffsetActOnWhatTheFileStates) {
  const auto with = [](std::optional<double> scale, std::optional<double> offset) {
    SourceInfo info = sample_info(SampleType::kInt16);
    info.z_scale = -0.25;
    info.z_offset = 8.0;
    OpenOptions options;
    options.z_scale = scale;
    options.z_offset = offset;
    apply_open_options(info, options);
    return std::pair(info.z_scale, info.z_offset);
  };
  EXPECT_EQ(with({}, {}), std::pair(-0.25, 8.0));
  EXPECT_EQ(with(2.0, {}), std::pair(-0.5, 16.0));
  EXPECT_EQ(with({}, -3.0), std::pair(-0.25, 5.0));
  EXPECT_EQ(with(-2.0, 1.0), std::pair(0.5, -15.0));
}

TEST(ApplyOpenOptions, LeavesEverythingWithoutOptions) {
  SourceInfo info = sample_info(SampleType::kInt16);
  info.georeference.spacing_x = 3.0;
  apply_open_options(info, {});
  EXPECT_EQ(info.void_values, std::vector<double>{-1.0});
  EXPECT_EQ(info.georeference.spacing_x, 3.0);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kUnknown);
}

TEST(ApplyOpenOptions, KeepsTheOriginOfLinearUnitsInMetres) {
  SourceInfo info = sample_info(SampleType::kInt16);
  info.georeference = {.unit = HorizontalUnit::kMetre,
                       .metres_per_unit = 1000.0,
                       .has_origin = true,
                       .origin_x = 2.0,
                       .origin_y = 3.0,
                       .system = {}};
  OpenOptions options;
  options.spacing = 30.0;
  apply_open_options(info, options);
  EXPECT_TRUE(info.georeference.has_origin);
  EXPECT_EQ(info.georeference.origin_x, 2000.0);
  EXPECT_EQ(info.georeference.origin_y, 3000.0);
  EXPECT_EQ(info.georeference.metres_per_unit, 1.0);
  EXPECT_EQ(info.georeference.spacing_y, 30.0);
}

TEST(ApplyOpenOptions, DropsTheOriginOfDegreesAndSaysSo) {
  SourceInfo info = sample_info(SampleType::kInt16);
  info.georeference.unit = HorizontalUnit::kDegree;
  info.georeference.has_origin = true;
  OpenOptions options;
  options.spacing = 90.0;
  apply_open_options(info, options);
  EXPECT_FALSE(info.georeference.has_origin);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(info.warnings.size(), 1U);
}

TEST(ApplyOpenOptions, RefusesValuesWithoutMeaning) {
  const auto refused = [](auto set) {
    SourceInfo info = sample_info(SampleType::kUint8);
    OpenOptions options;
    set(options);
    return test::error_of([&] { apply_open_options(info, options); }).code() == ErrorCode::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](OpenOptions& o) { o.spacing = 0.0; }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.spacing = -1.0; }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.spacing = std::nan(""); }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.z_scale = 0.0; }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.z_scale = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.z_offset = std::nan(""); }));
  EXPECT_TRUE(refused([](OpenOptions& o) { o.void_values = {-9999.0}; }));
}

}  // namespace
}  // namespace isohf
