#include "isohf/fill/geoid_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <GeographicLib/Geoid.hpp>
#include <cmath>
#include <filesystem>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/rasters/small_geoid.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::MemorySource;
using testing::HasSubstr;

double waves(double longitude, double latitude) {
  constexpr double kDegree = M_PI / 180.0;
  return -8.0 + 20.0 * std::cos(latitude * kDegree) * std::cos(2.0 * longitude * kDegree) + 0.1 * latitude;
}

template <typename T>
std::unique_ptr<MemorySource<T>> globe(SampleType type) {
  auto source = std::make_unique<MemorySource<T>>(
      type, 72, 37, [](std::int64_t c, std::int64_t r) { return static_cast<double>(100 + 3 * c + 5 * r); });
  source->mutable_info().georeference =
      test::place_at(Registration::kPoint, HorizontalUnit::kDegree, -180.0, 90.0, 5.0);
  return source;
}

std::string refusal_of(const std::function<void()>& work) {
  return test::error_of(work).what();
}

TEST(GeoidRequest, ReadsFileAndWay) {
  EXPECT_EQ(GeoidRequest::parse("a/egm96-5.pgm").path, "a/egm96-5.pgm");
  EXPECT_EQ(GeoidRequest::parse("a.pgm").shift, GeoidShift::kToEllipsoidal);
  EXPECT_EQ(GeoidRequest::parse("a.pgm:to-orthometric").shift, GeoidShift::kToOrthometric);
  EXPECT_EQ(GeoidRequest::parse("c:a.pgm:to-ellipsoidal").path, "c:a.pgm");
  EXPECT_THAT(refusal_of([] { (void)GeoidRequest::parse("a.tif"); }), HasSubstr("must be a geoid's FILE.pgm"));
  EXPECT_THAT(refusal_of([] { (void)GeoidRequest::parse("a.pgm:up"); }), HasSubstr("must be a geoid's FILE.pgm"));
}

TEST(GeoidSource, MovesEverySampleByTheGeoidsHeightThere) {
  const test::TemporaryFolder folder;
  test::write_geoid(folder / "egm96-test.pgm", 360, 181, waves);
  const GeographicLib::Geoid geoid("egm96-test", std::filesystem::path(folder / "egm96-test.pgm").parent_path());
  for (const GeoidShift shift : {GeoidShift::kToEllipsoidal, GeoidShift::kToOrthometric}) {
    auto inner = globe<std::int16_t>(SampleType::kInt16);
    inner->at(7, 3) = -32768;
    inner->mutable_info().void_values = {-32768.0};
    inner->mutable_info().z_scale = 0.5;
    inner->mutable_info().z_offset = 10.0;
    GeoidSource source(std::move(inner), {folder / "egm96-test.pgm", shift});
    EXPECT_EQ(source.info().sample_type, SampleType::kFloat32);
    EXPECT_EQ(source.info().z_scale, 1.0);
    EXPECT_EQ(source.info().georeference.system.vertical_datum,
              shift == GeoidShift::kToEllipsoidal ? "the ellipsoid, by egm96-test" : "EGM96 height");
    // Windows of any size, in any order, give the same samples.
    std::vector<float> whole(72 * 37);
    source.read_window({0, 0, 72, 37}, std::as_writable_bytes(std::span(whole)));
    std::vector<float> part(20 * 4);
    source.read_window({50, 30, 20, 4}, std::as_writable_bytes(std::span(part)));
    for (std::size_t r = 0; r < 37; ++r) {
      for (std::size_t c = 0; c < 72; ++c) {
        const double longitude = -180.0 + 5.0 * static_cast<double>(c);
        const double latitude = 90.0 - 5.0 * static_cast<double>(r);
        if (c == 7 && r == 3) {
          EXPECT_TRUE(std::isnan(whole[r * 72 + c]));
          continue;
        }
        const double height = 10.0 + 0.5 * (100.0 + 3.0 * static_cast<double>(c) + 5.0 * static_cast<double>(r));
        const double sign = shift == GeoidShift::kToEllipsoidal ? 1.0 : -1.0;
        EXPECT_FLOAT_EQ(whole[r * 72 + c], static_cast<float>(height + sign * geoid(latitude, longitude)));
        // The geoid itself, between whose posts a cubic is fitted, is the waves to its steps.
        EXPECT_NEAR(whole[r * 72 + c], height + sign * waves(longitude, latitude), 0.01);
        if (c < 50 || c >= 70 || r < 30 || r >= 34) continue;
        EXPECT_EQ(part[(r - 30) * 20 + c - 50], whole[r * 72 + c]);
      }
    }
  }
}

TEST(GeoidSource, WideSamplesStayWide) {
  const test::TemporaryFolder folder;
  test::write_geoid(folder / "a.pgm", 36, 19, [](double, double) { return 12.5; });
  GeoidSource source(globe<std::int32_t>(SampleType::kInt32), {folder / "a.pgm", GeoidShift::kToEllipsoidal});
  EXPECT_EQ(source.info().sample_type, SampleType::kFloat64);
  double sample = 0.0;
  source.read_window({2, 1, 1, 1}, std::as_writable_bytes(std::span(&sample, 1)));
  EXPECT_NEAR(sample, 111.0 + 12.5, 0.002);
}

TEST(GeoidSource, FeetAreFeet) {
  const test::TemporaryFolder folder;
  test::write_geoid(folder / "a.pgm", 36, 19, [](double, double) { return 12.5; });
  auto inner = globe<float>(SampleType::kFloat32);
  inner->mutable_info().metres_per_vertical_unit = 0.3048;
  GeoidSource source(std::move(inner), {folder / "a.pgm", GeoidShift::kToOrthometric});
  float sample = 0.0F;
  source.read_window({0, 0, 1, 1}, std::as_writable_bytes(std::span(&sample, 1)));
  EXPECT_NEAR(sample, 100.0 - 12.5 / 0.3048, 0.006);
}

TEST(GeoidSource, WarnsWhereHeightsAreWhatItMakes) {
  const test::TemporaryFolder folder;
  test::write_geoid(folder / "egm96-test.pgm", 360, 181, waves);
  const auto warnings = [&](const char* datum, std::optional<int> code, const char* way) {
    auto source = globe<float>(SampleType::kFloat32);
    source->mutable_info().georeference.system.vertical_datum = datum;
    source->mutable_info().georeference.system.vertical_epsg = code;
    const GeoidSource moved(std::move(source), GeoidRequest::parse(folder / "egm96-test.pgm" + std::string(way)));
    std::string all;
    for (const Warning& warning : moved.info().warnings) all += warning;
    return all;
  };
  EXPECT_THAT(warnings("EGM96 height", 5773, ":to-orthometric"), HasSubstr("above EGM96 height already"));
  EXPECT_THAT(warnings("", 5703, ":to-orthometric"), HasSubstr("above EPSG:5703 already"));
  EXPECT_THAT(warnings("the ellipsoid, by egm96", {}, ""), HasSubstr("once more, to ellipsoidal heights"));
  EXPECT_EQ(warnings("EGM96 height", 5773, ""), "");
  EXPECT_EQ(warnings("the ellipsoid, by egm96", {}, ":to-orthometric"), "");
  EXPECT_EQ(warnings("", {}, "") + warnings("", {}, ":to-orthometric"), "");
}

TEST(GeoidSource, WhatItCannotUseIsRefusedInOneLine) {
  const test::TemporaryFolder folder;
  const auto open = [&](const std::string& name, const std::function<void(SourceInfo&)>& change = {}) {
    auto inner = globe<float>(SampleType::kFloat32);
    if (change) change(inner->mutable_info());
    const GeoidSource source(std::move(inner), {folder / name, GeoidShift::kToEllipsoidal});
  };
  EXPECT_THAT(refusal_of([&] { open("none.pgm"); }), HasSubstr("none.pgm: no such file"));
  std::ofstream(folder / "text.pgm") << "elevations\n";
  EXPECT_THAT(refusal_of([&] { open("text.pgm"); }), HasSubstr("text.pgm: is no geoid of GeographicLib's"));
  test::write_geoid(folder / "a.pgm", 36, 19, [](double, double) { return 12.5; });
  const auto size = std::filesystem::file_size(folder / "a.pgm");
  for (std::uintmax_t length = 0; length < size; length += 97) {
    test::write_geoid(folder / "cut.pgm", 36, 19, [](double, double) { return 12.5; });
    std::filesystem::resize_file(folder / "cut.pgm", length);
    EXPECT_THAT(refusal_of([&] { open("cut.pgm"); }), HasSubstr("cut.pgm: is no geoid")) << length;
  }
  EXPECT_THAT(refusal_of([&] { open("a.pgm", [](SourceInfo& i) { i.georeference.unit = HorizontalUnit::kMetre; }); }),
              HasSubstr("`geoid` needs an input in degrees"));
  EXPECT_THAT(refusal_of([&] { open("a.pgm", [](SourceInfo& i) { i.georeference.system.body = "Mars"; }); }),
              HasSubstr("holds for the Earth, the input shows Mars"));
}

}  // namespace
}  // namespace isohf
