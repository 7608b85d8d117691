/// Inputs on maps of their own through the program: what their lengths are worth, and truer maps for them.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/projection.h"
#include "isohf/raster.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

constexpr double kDegree = M_PI / 180.0;
/// A square of 12.8 km on the map around 6.5 East, 44.5 North.
constexpr std::int64_t kSize = 128;
constexpr double kSpacing = 100.0;
constexpr double kLatitude = 44.5;

/// 10 % upwards to the North, on the ground.
double slope(GeoPoint place) {
  return 500.0 + 0.1 * (place.latitude - kLatitude) * degree_lengths({}, kLatitude).along_meridian;
}

RunOptions with_input(const std::string& text) {
  RunOptions options;
  options.input = text;
  return options;
}

class MapCommand : public testing::Test {
 protected:
  MapCommand() {
    write(folder / "web.tif", 3857);
    write(folder / "utm.tif", 32632);
  }

  /// Of the slope, around 6.5 East, 44.5 North, whatever the map.
  static void write(const std::string& path, int epsg, double metres_per_unit = 1.0,
                    GeoPoint around = {6.5, kLatitude}) {
    const auto map = Crs::parse("EPSG:" + std::to_string(epsg));
    const MapPoint middle = map->map_from_geo(around);
    RasterSpec spec;
    spec.width = spec.height = kSize;
    Georeference place;
    place.registration = Registration::kArea;
    place.unit = HorizontalUnit::kMetre;
    place.metres_per_unit = metres_per_unit;
    place.spacing_x = place.spacing_y = kSpacing;
    place.has_origin = true;
    place.origin_x = std::floor(middle.easting - 0.5 * kSpacing * static_cast<double>(kSize));
    place.origin_y = std::floor(middle.northing + 0.5 * kSpacing * static_cast<double>(kSize));
    place.system.epsg = epsg;
    spec.georeference = place;
    std::vector<float> samples;
    for (std::int64_t row = 0; row < kSize; ++row) {
      for (std::int64_t column = 0; column < kSize; ++column) {
        samples.push_back(
            static_cast<float>(slope(map->geo_from_map({place.origin_x + kSpacing * static_cast<double>(column),
                                                        place.origin_y - kSpacing * static_cast<double>(row)}))));
      }
    }
    const auto sink = create_raster(path, spec);
    sink->write_rows(std::as_bytes(std::span(samples)));
    sink->finish();
  }

  RunResult convert(const std::string& input, const std::string& output, const std::vector<std::string>& more = {}) {
    return run_isohf(with_more({"convert", folder / input, folder / output, "--overwrite", "--type", "f32"}, more));
  }
  json info(const std::string& name) { return json::parse(run_isohf({"info", folder / name, "--json"}).out); }

  /// Of the surface in its middle, upwards for a unit of length.
  double steepness(const std::string& archive) {
    const json metadata = info(archive).at("metadata");
    const json valid = metadata.at("valid");
    const auto middle = [&](const char* low, const char* high) {
      return std::to_string(0.5 * (valid.at(low).get<double>() + valid.at(high).get<double>()));
    };
    const json sample = json::parse(
        run_isohf({"sample", folder / archive, "--at", middle("x0", "x1") + "," + middle("z0", "z1"), "--json"}).out);
    const auto normal = sample.at("normal").get<std::vector<double>>();
    return std::hypot(normal[0], normal[2]) / normal[1];
  }

  TemporaryFolder folder;
};

TEST_F(MapCommand, WebMercatorIsWarnedOfWithTheFigureAndTheRemedy) {
  for (const RunResult& result : {run_isohf({"plan", folder / "web.tif"}), convert("web.tif", "web.isohf")}) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("map          lengths on the input's map are 1.40"));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr("web.tif: lengths on its map are 1.40"));
    EXPECT_THAT(result.err, HasSubstr("--to-crs auto lays the surface on a truer map"));
  }
  EXPECT_THAT(run_isohf({"info", folder / "web.isohf"}).out,
              HasSubstr("map scale    lengths on the input's map are 1.40"));
}

TEST_F(MapCommand, JsonAndMetadataHoldTheScaleOfTheEllipsoid) {
  convert("web.tif", "web.isohf");
  const json plan = json::parse(run_isohf({"plan", folder / "web.tif", "--json"}).out).at("ground");
  const json archive = info("web.isohf");
  EXPECT_EQ(plan, archive.at("metadata").at("source").at("ground"));
  EXPECT_EQ(plan.at("map_scale"), archive.at("map_scale"));
  EXPECT_EQ(archive.at("map_scale"), info("web.tif").at("map_scale"));
  const double sine = std::sin(kLatitude * kDegree);
  constexpr double kE2 = 0.00669437999014;
  const double root = std::sqrt(1.0 - kE2 * sine * sine);
  const double mean = root * root / (std::sqrt(1.0 - kE2) * std::cos(kLatitude * kDegree));
  EXPECT_NEAR(plan.at("map_scale").at("mean").get<double>(), mean, 1e-4);
  EXPECT_GT(plan.at("map_scale").at("worst_error").get<double>(), 0.39);
}

TEST_F(MapCommand, ProjectionAutoGivesTrueLengths) {
  convert("web.tif", "web.isohf");
  EXPECT_NEAR(steepness("web.isohf"), 0.1 / 1.4024, 0.0003);  // too flat
  const RunResult result = convert("web.tif", "true.isohf", {"--to-crs", "auto"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("map          lambert-conformal around longitude 6.4995, "));
  EXPECT_THAT(result.out, HasSubstr("the input's own map errs by 40"));
  EXPECT_NEAR(steepness("true.isohf"), 0.1, 0.0002);
  const json metadata = info("true.isohf").at("metadata");
  EXPECT_LT(metadata.at("projection").at("worst_scale_error").at("error").get<double>(), 1e-4);
  // 12.8 km of the map are 9.13 on the ground.
  const json valid = metadata.at("valid");
  EXPECT_NEAR(valid.at("x1").get<double>() - valid.at("x0").get<double>(), 12800.0 / 1.4, 20.0);
}

TEST_F(MapCommand, EveryKindPassesEveryCheck) {
  for (const std::string kind : {"auto", "local", "transverse-mercator", "utm", "utm:31N", "lambert-conformal:44,45",
                                 "polar-stereographic:45"}) {
    SCOPED_TRACE(kind);
    const RunResult result = convert("web.tif", "a.isohf", {"--to-crs", kind});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "web.tif"});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    EXPECT_EQ(verified.err, "");
  }
}

TEST_F(MapCommand, ProjectedSamplesComeBackBitForBit) {
  ASSERT_EQ(convert("web.tif", "a.isohf", {"--to-crs", "auto", "--lossless"}).exit_code, 0);
  ASSERT_EQ(run_isohf({"export", folder / "a.isohf", folder / "back.tif"}).exit_code, 0);
  const auto back = open_raster(folder / "back.tif", {});
  const auto first = open_raster(folder / "web.tif", {});
  std::vector<std::byte> a(static_cast<std::size_t>(kSize * kSize) * 4);
  std::vector<std::byte> b(a.size());
  first->read_window({0, 0, kSize, kSize}, a);
  back->read_window({0, 0, kSize, kSize}, b);
  EXPECT_EQ(a, b);
  EXPECT_EQ(back->info().georeference.system.epsg, 3857);
  EXPECT_EQ(back->info().georeference.origin_x, first->info().georeference.origin_x);
}

TEST_F(MapCommand, ProjectionNoneKeepsTheMapWithoutAWarning) {
  EXPECT_EQ(convert("web.tif", "a.isohf", {"--to-crs", "none"}).err, "");
  EXPECT_TRUE(info("a.isohf").at("metadata").at("projection").is_null());
}

TEST_F(MapCommand, MapsThatAreTrueEnoughStayWhatTheyAre) {
  const RunResult plain = convert("utm.tif", "a.isohf");
  EXPECT_EQ(plain.exit_code, 0);
  EXPECT_EQ(plain.err, "");
  EXPECT_THAT(plain.out, HasSubstr("map          lengths on the input's map are 1.000"));
  EXPECT_EQ(convert("utm.tif", "b.isohf", {"--to-crs", "auto"}).err, "");
  EXPECT_EQ(info("a.isohf").at("metadata"), info("b.isohf").at("metadata"));
}

TEST_F(MapCommand, EquirectangularIsForDegrees) {
  const RunResult result = convert("web.tif", "a.isohf", {"--to-crs", "equirectangular"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("it is for inputs in degrees, this one is on a map; --to-crs"));
}

TEST_F(MapCommand, InfoSaysWhereASourceLiesInItsOwnCoordinatesAndInDegrees) {
  convert("utm.tif", "a.isohf");
  for (const char* name : {"utm.tif", "a.isohf"}) {
    const json said = info(name);
    EXPECT_NEAR(said.at("lonlat").at("centre").at("longitude").get<double>(), 6.5, 0.001);
    EXPECT_NEAR(said.at("lonlat").at("centre").at("latitude").get<double>(), kLatitude, 0.001);
    EXPECT_NEAR(said.at("centre").at("x").get<double>(),
                Crs::parse("EPSG:32632")->map_from_geo({6.5, kLatitude}).easting, kSpacing);
  }
  for (const char* member : {"bounds", "centre", "lonlat", "map_scale"}) {
    EXPECT_EQ(info("utm.tif").at(member), info("a.isohf").at(member)) << member;
  }
  EXPECT_EQ(info("a.isohf").at("lossless"), false);
}

TEST_F(MapCommand, FeetSurvive) {
  write(folder / "feet.tif", 2263, 1200.0 / 3937.0, {-73.9857, 40.7484});
  EXPECT_EQ(info("feet.tif").at("metres_per_unit").get<double>(), 1200.0 / 3937.0);
  ASSERT_EQ(convert("feet.tif", "a.isohf").exit_code, 0);
  ASSERT_EQ(run_isohf({"export", folder / "a.isohf", folder / "back.tif"}).exit_code, 0);
  ASSERT_EQ(run_isohf({"shade", folder / "a.isohf", "-o", folder / "shade.tif"}).exit_code, 0);
  for (const char* name : {"feet.tif", "a.isohf", "back.tif"}) {
    EXPECT_NEAR(info(name).at("lonlat").at("centre").at("latitude").get<double>(), 40.7484, 0.001) << name;
    EXPECT_NEAR(info(name).at("map_scale").at("mean").get<double>(), 1.0, 1e-4) << name;
  }
  EXPECT_EQ(info("back.tif").at("metres_per_unit").get<double>(), 1200.0 / 3937.0);
  const RunResult picture = run_isohf({"info", folder / "shade.tif", "--channel", "R", "--json"});
  EXPECT_EQ(json::parse(picture.out).at("metres_per_unit").get<double>(), 1200.0 / 3937.0);
}

TEST_F(MapCommand, SampleTakesAndGivesTheInputsOwnCoordinatesAndDegrees) {
  convert("utm.tif", "a.isohf");
  ASSERT_EQ(convert("web.tif", "b.isohf", {"--to-crs", "auto"}).exit_code, 0);
  for (const auto& [archive, epsg] :
       {std::pair<std::string, std::string>{"a.isohf", "EPSG:32632"}, {"b.isohf", "EPSG:3857"}}) {
    SCOPED_TRACE(archive);
    const GeoPoint place{6.51, 44.49};
    const MapPoint there = Crs::parse(epsg)->map_from_geo(place);
    const std::string crs = fmt::format("{:.6f} {:.6f}\n", there.easting, there.northing);
    const auto sample = [&](const std::vector<std::string>& more, const std::string& input = "") {
      const RunResult result = run_isohf(with_more({"sample", folder / archive}, more), with_input(input));
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(result.err, "");
      return result.out;
    };
    const json by_crs = json::parse(sample({"--in", "crs", "--json"}, crs));
    EXPECT_NEAR(by_crs.at("elevation").get<double>(), slope(place), 0.5);
    EXPECT_NEAR(by_crs.at("lonlat").at("longitude").get<double>(), place.longitude, 1e-9);
    EXPECT_NEAR(by_crs.at("lonlat").at("latitude").get<double>(), place.latitude, 1e-9);
    EXPECT_NEAR(by_crs.at("crs").at("x").get<double>(), there.easting, 1e-5);
    EXPECT_NEAR(by_crs.at("crs").at("y").get<double>(), there.northing, 1e-5);
    const json by_geo = json::parse(sample({"--in", "lonlat", "--json"}, "6.51,44.49\n"));
    EXPECT_NEAR(by_geo.at("x").get<double>(), by_crs.at("x").get<double>(), 1e-5);
    EXPECT_NEAR(by_geo.at("z").get<double>(), by_crs.at("z").get<double>(), 1e-5);

    std::istringstream line(sample({"--in", "crs", "--with", "crs", "--with", "lonlat"}, crs));
    std::vector<double> columns((std::istream_iterator<double>(line)), {});
    ASSERT_EQ(columns.size(), 10U);
    EXPECT_NEAR(columns[6], there.easting, 1e-4);
    EXPECT_NEAR(columns[7], there.northing, 1e-4);
    EXPECT_NEAR(columns[8], place.longitude, 1e-8);
    EXPECT_NEAR(columns[9], place.latitude, 1e-8);
    EXPECT_THAT(sample({"--in", "lonlat", "--with", "lonlat"}, "0 0\n"), testing::StartsWith("outside "));
  }
}

TEST_F(MapCommand, WithoutProjsDatabaseALineSaysSo) {
  const RunResult result = run_program(
      {"/usr/bin/env", "PROJ_DATA=/nonexistent", isohf_path(), "convert", folder / "web.tif", folder / "a.isohf"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("the reference system EPSG:3857: PROJ finds no proj.db"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
}

TEST_F(MapCommand, ExportCutsABoxOfTheInputsOwnCoordinatesOutOfAnotherMap) {
  ASSERT_EQ(convert("web.tif", "a.isohf", {"--to-crs", "auto"}).exit_code, 0);
  const json bounds = info("web.tif").at("bounds");
  const double west = bounds.at("west").get<double>() + 3200.0;
  const double north = bounds.at("north").get<double>() - 3200.0;
  const auto box = std::to_string(west) + ',' + std::to_string(north - 6400.0) + ',' + std::to_string(west + 6400.0) +
                   ',' + std::to_string(north);
  const RunResult result =
      run_isohf({"export", folder / "a.isohf", folder / "part.tif", "--bbox", box, "--spacing", "100"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const json part = info("part.tif");
  EXPECT_NEAR(part.at("width").get<double>() * 100.0, 6400.0 / 1.4, 100.0);
}

TEST_F(MapCommand, AGlobalMapIsStatedAndKept) {
  const fs::path file = real_data() / "egm84_3857.tif";
  if (!fs::exists(file)) GTEST_SKIP() << kNoRealFiles;
  const RunResult plan = run_isohf({"plan", file});
  EXPECT_EQ(plan.exit_code, 0);
  EXPECT_THAT(plan.err, HasSubstr("lengths on its map are 2.6"));
  EXPECT_THAT(plan.err, HasSubstr("a part of it (--bbox) can be laid on a truer map by --to-crs auto"));
  const RunResult asked = run_isohf({"plan", file, "--to-crs", "auto"});
  EXPECT_EQ(asked.exit_code, 2);
  EXPECT_THAT(asked.err, HasSubstr("give a part of it"));
}

}  // namespace
}  // namespace isohf::test
