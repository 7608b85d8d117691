#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/registry.h"
#include "isohf/archive.h"
#include "isohf/raster.h"
#include "support/gdal_answers.h"
#include "support/rasters/place_at.h"
#include "support/rasters/plain_tiff.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr std::int64_t kWidth = 200;
constexpr std::int64_t kHeight = 120;
constexpr std::int64_t kWall = 100;  ///< column of a wall 20 high, on level land
constexpr std::int16_t kVoid = -32768;

/// One channel of a picture.
struct Channel {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Georeference place;
  std::vector<std::byte> bytes;
  [[nodiscard]] int at(std::int64_t column, std::int64_t row) const {
    return static_cast<int>(bytes[static_cast<std::size_t>(row * width + column)]);
  }
};

Channel read_channel(const std::string& path, const std::string& channel) {
  OpenOptions options;
  options.channel = channel;
  const auto source = open_raster(path, options);
  return {source->info().width, source->info().height, source->info().georeference, read_whole(*source)};
}

class ShadeCommand : public testing::Test {
 protected:
  ShadeCommand() {
    write_int16_tiff(folder / "wall.tif", kWidth, kHeight, [](std::int64_t c, std::int64_t r) {
      if (c < 20 && r < 20) return kVoid;
      return static_cast<std::int16_t>(c == kWall ? 120 : 100);
    });
  }

  /// Converts wall.tif and draws it, one pixel for a sample; returns the picture's name.
  std::string draw(const std::vector<std::string>& more, const std::vector<std::string>& converting = {},
                   const std::string& picture = "a.tif") {
    const RunResult converted =
        run_isohf(with_more({"convert", folder / "wall.tif", folder / "a.isohf", "--shape", "36x35", "--levels", "1",
                             "--nodata", "-32768", "--overwrite", "-q"},
                            converting));
    EXPECT_EQ(converted.exit_code, 0) << converted.err;
    const RunResult shaded =
        run_isohf(with_more({"shade", folder / "a.isohf", "-o", folder / picture, "--overwrite", "-q"}, more));
    EXPECT_EQ(shaded.exit_code, 0) << shaded.err;
    EXPECT_EQ(shaded.out + shaded.err, "");
    return folder / picture;
  }

  TemporaryFolder folder;
};

// A wall of 20 under a sun of atan(1/2) darkens 40 samples.
TEST_F(ShadeCommand, AWallCastsItsShadowAwayFromTheSun) {
  for (const bool west : {true, false}) {
    const Channel green =
        read_channel(draw({"--sun", west ? "270,26.565" : "90,26.565", "--size", "200x120", "--palette", "gray"}), "1");
    const int lit = green.at(west ? 80 : 120, 60);
    const int dark = green.at(west ? 120 : 80, 60);
    EXPECT_LT(dark * 3, lit * 2);
    const std::int64_t step = west ? 1 : -1;
    for (std::int64_t distance = 3; distance < 37; ++distance) {
      EXPECT_EQ(green.at(kWall + step * distance, 60), dark) << distance;
      EXPECT_EQ(green.at(kWall - step * distance, 60), lit) << distance;
    }
    for (std::int64_t distance = 44; distance < 60; ++distance) {
      EXPECT_EQ(green.at(kWall + step * distance, 60), lit) << distance;
    }
  }
}

TEST_F(ShadeCommand, ExaggerationLengthensShadows) {
  const Channel green = read_channel(draw({"--sun", "270,26.565", "--exaggeration", "1.5", "--size", "200x120"}), "1");
  EXPECT_EQ(green.at(kWall + 50, 60), green.at(kWall + 20, 60));
  EXPECT_GT(green.at(kWall + 70, 60), green.at(kWall + 20, 60));
}

TEST_F(ShadeCommand, HillshadesAreThoseOfGdalOfTheElevationsInTheMiddleOfPixels) {
  if (!has_gdal()) GTEST_SKIP() << "gdaldem is not installed (Debian: gdal-bin)";
  const std::string input = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  ASSERT_EQ(run_isohf({"convert", input, folder / "r.isohf", "-q"}).exit_code, 0);
  using Words = std::vector<std::string>;
  for (const auto& [light, gdal_light] : std::vector<std::pair<Words, Words>>{
           {{}, {}}, {{"--sun", "200,30"}, {"-az", "200", "-alt", "30"}}, {{"--exaggeration", "0.5"}, {"-z", "0.5"}}}) {
    for (const std::string size : {"512x384", "300x100"}) {
      SCOPED_TRACE(fmt::format("{} {}", size, fmt::join(light, " ")));
      const auto run = [&](const std::vector<std::string>& arguments) {
        const RunResult made = run_isohf(arguments);
        EXPECT_EQ(made.exit_code, 0) << made.err;
      };
      run(with_more(
          {"shade", folder / "r.isohf", folder / "h.tif", "--overwrite", "-q", "--size", size, "--kind", "hillshade"},
          light));
      run({"export", folder / "r.isohf", folder / "e.tif", "--overwrite", "-q", "--like", folder / "h.tif", "--method",
           "barycentric", "--type", "f32"});
      std::vector<std::string> gdal = {"gdaldem",        "hillshade", folder / "e.tif",
                                       folder / "g.tif", "-q",        "-compute_edges"};
      gdal.insert(gdal.end(), gdal_light.begin(), gdal_light.end());
      ASSERT_EQ(run_gdal(gdal).exit_code, 0);
      const Channel a = read_channel(folder / "g.tif", "");
      const Channel b = read_channel(folder / "h.tif", "");
      ASSERT_EQ(a.bytes.size(), b.bytes.size());
      int others = 0;
      for (std::size_t i = 0; i < a.bytes.size(); ++i) {
        if (std::abs(static_cast<int>(a.bytes[i]) - static_cast<int>(b.bytes[i])) > 1) ++others;
      }
      EXPECT_LE(others, 4) << "corners alone, where gdaldem continues one axis";
    }
  }
}

// A plane that rises by 1 in 2 towards the East and falls by 1 in 4 towards the South.
TEST_F(ShadeCommand, HillshadesOfAPlaneAreThoseOfItsNormal) {
  write_int16_tiff(folder / "plane.tif", 40, 30,
                   [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(100 + 2 * c - r); });
  ASSERT_EQ(
      run_isohf({"convert", folder / "plane.tif", folder / "p.isohf", "-q", "--sample-spacing", "4", "--type", "f32"})
          .exit_code,
      0);
  const RunResult made =
      run_isohf({"shade", folder / "p.isohf", folder / "p.tif", "-q", "--size", "40x30", "--kind", "hillshade"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Channel shaded = read_channel(folder / "p.tif", "");
  ASSERT_EQ(shaded.bytes.size(), 40U * 30U) << "one band";
  for (const auto& [column, row] : {std::pair<std::int64_t, std::int64_t>{20, 15}, {0, 0}, {39, 29}}) {
    // Downhill is West and South: n = (-0.5, 1, 0.25), the light comes from the North-West, 45 degrees high.
    const double towards = (0.5 * 0.5 + std::sqrt(0.5) - 0.25 * 0.5) / std::hypot(1.0, std::hypot(0.5, 0.25));
    EXPECT_NEAR(shaded.at(column, row), 1.0 + 254.0 * towards, 1.0);
  }
}

TEST_F(ShadeCommand, PngHasAWorldFileAndExrHasShares) {
  std::vector<float> heights(12 * 10, 50.0F);
  for (const std::size_t row : {0U, 12U, 24U})
    std::fill_n(heights.begin() + static_cast<std::ptrdiff_t>(row), 3, -9999.0F);
  RasterSpec spec;
  spec.width = 12;
  spec.height = 10;
  spec.sample_type = SampleType::kFloat32;
  spec.void_value = -9999.0;
  spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre, 500005.0, 4000195.0, 10.0, 32632);
  write_raster(folder / "level.tif", spec, std::as_bytes(std::span(heights)));
  ASSERT_EQ(run_isohf({"convert", folder / "level.tif", folder / "l.isohf", "-q"}).exit_code, 0);
  const RunResult made =
      run_isohf({"shade", folder / "l.isohf", folder / "l.png", "--kind", "hillshade", "--size", "12x10", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(json::parse(made.out).at("files_written").size(), 3U);
  EXPECT_EQ(read_file(folder / "l.pgw"), "10\n0\n0\n-10\n500005\n4000195\n");
  EXPECT_THAT(read_file(folder / "l.png.aux.xml"), HasSubstr("32632"));
  const Channel grey = read_channel(folder / "l.png", "");
  EXPECT_EQ(grey.at(0, 0), 0);
  EXPECT_EQ(grey.at(6, 5), 181) << "1 + 254 sin 45";
  // Somebody else's file stays.
  write_file(folder / "m.pgw", "notes");
  const RunResult refused = run_isohf({"shade", folder / "l.isohf", folder / "m.png"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("m.pgw"));
  EXPECT_EQ(read_file(folder / "m.pgw"), "notes");
  ASSERT_EQ(
      run_isohf({"shade", folder / "l.isohf", folder / "l.exr", "--kind", "shadow-mask", "--size", "12x10"}).exit_code,
      0);
  const auto shares = open_raster(folder / "l.exr", {});
  std::vector<float> row(12);
  shares->read_window({0, 0, 12, 1}, std::as_writable_bytes(std::span(row)));
  EXPECT_TRUE(std::isnan(row[0]));
  EXPECT_EQ(row[8], 1.0F);
  ASSERT_EQ(run_isohf({"shade", folder / "l.isohf", folder / "c.exr", "--size", "12x10"}).exit_code, 0);
}

TEST_F(ShadeCommand, PalettesSuitTheBody) {
  // A body that is not Earth is grey by itself, and Mars is red.
  const auto hue = [&](int semi_major_m, const std::vector<std::string>& more) {
    std::vector<float> heights(200);
    for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<float>(i);
    RasterSpec spec;
    spec.width = 20;
    spec.height = 10;
    spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre, 0.0, 0.0, 100.0, 0);
    spec.georeference->system = {};
    spec.georeference->system.body = semi_major_m == 3396190 ? "Mars" : "Moon";
    spec.georeference->system.semi_major_axis_m = semi_major_m;
    spec.georeference->system.inverse_flattening = 0.0;
    spec.overwrite = true;
    write_raster(folder / "body.tif", spec, std::as_bytes(std::span(heights)));
    EXPECT_EQ(run_isohf({"convert", folder / "body.tif", folder / "b.isohf", "-q", "--overwrite"}).exit_code, 0);
    EXPECT_EQ(run_isohf(with_more({"shade", folder / "b.isohf", folder / "b.tif", "--overwrite", "-q", "--exaggeration",
                                   "0.001", "--no-shadow", "--sun", "270,60"},
                                  more))
                  .exit_code,
              0);
    return read_channel(folder / "b.tif", "0").at(15, 5) - read_channel(folder / "b.tif", "2").at(15, 5);
  };
  EXPECT_GT(hue(3396190, {}), hue(1737400, {}) + 30) << "red over blue";
  EXPECT_LT(hue(3396190, {"--palette", "gray"}), hue(3396190, {}) - 30);
}

// The picture of a ramp under a western sun is the mirror image of its mirror image under an eastern one: a picture
// that lay half a pixel off would be a pixel off, 5 of 255 grey levels here. --fit: colours are spread over all of the
// tiles.
TEST_F(ShadeCommand, PixelsLieOnTheGroundThatTheyShow) {
  constexpr std::int64_t kSide = 12;
  const auto drawn = [&](bool rises_east) {
    std::vector<float> heights;
    for (std::int64_t i = 0; i < kSide * kSide; ++i) {
      heights.push_back(static_cast<float>(rises_east ? i % kSide : kSide - 1 - i % kSide));
    }
    RasterSpec spec;
    spec.width = spec.height = kSide;
    spec.sample_type = SampleType::kFloat32;
    spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre, 500005.0, 4000195.0, 10.0, 32632);
    spec.overwrite = true;
    write_raster(folder / "ramp.tif", spec, std::as_bytes(std::span(heights)));
    EXPECT_EQ(run_isohf({"convert", folder / "ramp.tif", folder / "a.isohf", "--overwrite", "-q", "--fit"}).exit_code,
              0);
    const RunResult shaded =
        run_isohf({"shade", folder / "a.isohf", folder / "a.tif", "--overwrite", "-q", "--palette", "gray",
                   "--exaggeration", "0.001", "--sun", rises_east ? "270,15" : "90,15", "--size", "12x12"});
    EXPECT_EQ(shaded.exit_code, 0) << shaded.err;
    const Channel green = read_channel(folder / "a.tif", "1");
    EXPECT_NEAR(green.place.origin_x, 500005.0, 1e-6);
    EXPECT_NEAR(green.place.origin_y, 4000195.0, 1e-6);
    EXPECT_NEAR(green.place.spacing_x, 10.0, 1e-9);
    EXPECT_EQ(green.place.registration, Registration::kArea);
    return green;
  };
  const Channel east = drawn(true);
  const Channel west = drawn(false);
  for (std::int64_t c = 1; c < kSide - 1; ++c) {
    EXPECT_NEAR(east.at(c, 6), west.at(kSide - 1 - c, 6), 1) << c;
    EXPECT_GE(east.at(c, 6) - east.at(c - 1, 6), 4) << c;
  }
}

TEST_F(ShadeCommand, AnySizeWorks) {
  for (const char* size : {"1x1", "1x500", "700x2", "3000x50"}) {
    const Channel red = read_channel(draw({"--size", size}), "0");
    EXPECT_EQ(fmt::format("{}x{}", red.width, red.height), size);
  }
  const Channel red = read_channel(draw({}), "0");
  EXPECT_GT(red.width, 150);
  EXPECT_LT(red.width, 250);
}

TEST_F(ShadeCommand, ASingleSizeIsTheLongerSide) {
  const Channel whole = read_channel(draw({}), "1");
  const Channel half = read_channel(draw({"--size", std::to_string(std::max(whole.width, whole.height) / 2)}), "1");
  EXPECT_EQ(std::max(half.width, half.height), std::max(whole.width, whole.height) / 2);
  EXPECT_NEAR(static_cast<double>(half.width) / static_cast<double>(half.height),
              static_cast<double>(whole.width) / static_cast<double>(whole.height), 0.02);
}

TEST_F(ShadeCommand, TheSunOfADayIsThatOfThePlace) {
  std::string grid = "ncols 20\nnrows 20\nxllcorner 7\nyllcorner 46\ncellsize 0.001\n";
  for (int i = 0; i < 400; ++i) grid += std::to_string(i * 7 % 50) + ' ';
  write_file(folder / "alps.asc", grid);
  const RunResult converted =
      run_isohf({"convert", folder / "alps.asc", folder / "alps.isohf", "--crs", "EPSG:4326", "-q"});
  ASSERT_EQ(converted.exit_code, 0) << converted.err;
  const RunResult day = run_isohf(
      {"shade", folder / "alps.isohf", "-o", folder / "day.png", "--date", "2026-12-21", "--size", "20", "--json"});
  ASSERT_EQ(day.exit_code, 0) << day.err;
  EXPECT_NEAR(json::parse(day.out).at("sun").at("elevation_deg").get<double>(), 90.0 - 46.01 - 23.44, 0.02);
  EXPECT_GT(read_file(folder / "day.png").size(), 100U);
  const RunResult night =
      run_isohf({"shade", folder / "alps.isohf", "-o", folder / "night.png", "--date", "2026-12-21", "--time", "3:00"});
  EXPECT_EQ(night.exit_code, 2);
  EXPECT_THAT(night.err, HasSubstr("degrees below the horizon"));
  EXPECT_EQ(std::count(night.err.begin(), night.err.end(), '\n'), 1);
}

TEST_F(ShadeCommand, RefusesWrongUsage) {
  (void)draw({});
  const auto code = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"shade", folder / "a.isohf", folder / "b.png"});
    return run_isohf(more).exit_code;
  };
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--sun", "270,0"},
                                             {"--sun", "270,90"},
                                             {"--sun", "270"},
                                             {"--sun", "up,20"},
                                             {"--sun", "361,20"},
                                             {"--kind", "slope"},
                                             {"--kind", "hillshade", "--texture"},
                                             {"--kind", "hillshade", "--palette", "gray"},
                                             {"--kind", "shadow-mask", "--no-shadow"},
                                             {"--kind", "shadow-mask", "--sun", "270,90"},
                                             {"--date", "2026-02-30"},
                                             {"--date", "21.6.2026"},
                                             {"--date", "2026-06-21", "--sun", "20,20"},
                                             {"--date", "2026-06-21", "--time", "25"},
                                             {"--date", "2026-06-21", "--time", "12:3"},
                                             {"--date", "2026-06-21"},  // the archive has no place
                                             {"--time", "12:30"},
                                             {"--size", "0x5"},
                                             {"--size", "0"},
                                             {"--size", "5.5"},
                                             {"--exaggeration", "0"},
                                             {"--palette", "blue"}}) {
    EXPECT_EQ(code(wrong), 2) << wrong[0];
  }
  EXPECT_EQ(run_isohf({"shade", folder / "a.isohf", folder / "a.tif"}).exit_code, 2);  // exists
  EXPECT_EQ(run_isohf({"shade", folder / "a.isohf", folder / "b.jpg"}).exit_code, 2);
  EXPECT_EQ(run_isohf({"shade", folder / "missing.isohf", folder / "b.png"}).exit_code, 1);
  for (const std::string& name : folder.names()) EXPECT_THAT(name, testing::Not(HasSubstr("b.")));
}

TEST_F(ShadeCommand, TakesDegreesForTheMetresThatTheyAre) {
  // Land that falls a metre in ten towards the East, at 60 degrees North: a degree of longitude is half as long.
  std::string text = "ncols 120\nnrows 120\nxllcorner 8\nyllcorner 59.94\ncellsize 0.001\n";
  for (int i = 0; i < 120 * 120; ++i) text += std::to_string(2000.0 - 5.56 * (i % 120)) + (i % 120 == 119 ? "\n" : " ");
  write_file(folder / "slope.asc", text);
  for (const char* projection : {"none", "auto"}) {
    ASSERT_EQ(run_isohf({"convert", folder / "slope.asc", folder / "s.isohf", "--crs", "EPSG:4326", "--to-crs",
                         projection, "--overwrite", "-q"})
                  .exit_code,
              0);
    ASSERT_EQ(run_isohf({"shade", folder / "s.isohf", "-o", folder / "s.tif", "--kind", "hillshade", "--sun", "90,45",
                         "--overwrite", "-q"})
                  .exit_code,
              0);
    const Channel shaded = read_channel(folder / "s.tif", "");
    const double towards = std::sqrt(0.5) * (1.0 + 0.1) / std::hypot(1.0, 0.1);
    EXPECT_NEAR(shaded.at(shaded.width / 2, shaded.height / 2), 1.0 + 254.0 * towards, 1.0) << projection;
    ASSERT_EQ(
        run_isohf({"shade", folder / "s.isohf", "-o", folder / "m.tif", "--kind", "shadow-mask", "--overwrite", "-q"})
            .exit_code,
        0);
    EXPECT_EQ(read_channel(folder / "m.tif", "").at(30, 30), 255) << projection;
  }
}

}  // namespace
}  // namespace isohf::test
