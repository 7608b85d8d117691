#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/registry.h"
#include "isohf/archive.h"
#include "isohf/raster.h"
#include "support/place_at.h"
#include "support/plain_tiff.h"
#include "support/raster.h"
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
    std::vector<std::string> convert = {
        "convert", folder / "wall.tif", folder / "a.isohf", "--shape",     "36x35", "--levels",
        "1",       "--nodata",          "-32768",           "--overwrite", "-q"};
    convert.insert(convert.end(), converting.begin(), converting.end());
    const RunResult converted = run_isohf(convert);
    EXPECT_EQ(converted.exit_code, 0) << converted.err;
    std::vector<std::string> shade = {"shade", folder / "a.isohf", "-o", folder / picture, "--overwrite", "-q"};
    shade.insert(shade.end(), more.begin(), more.end());
    const RunResult shaded = run_isohf(shade);
    EXPECT_EQ(shaded.exit_code, 0) << shaded.err;
    EXPECT_EQ(shaded.out + shaded.err, "");
    return folder / picture;
  }

  TemporaryFolder folder;
};

// A wall of 20 under a sun of atan(1/2) darkens 40 samples.
TEST_F(ShadeCommand, AWallCastsItsShadowAwayFromTheSun) {
  for (const bool west : {true, false}) {
    const Channel green = read_channel(
        draw({"--sun-elevation", "26.565", "--azimuth", west ? "W" : "E", "--size", "200x120", "--palette", "gray"}),
        "1");
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
  const Channel green =
      read_channel(draw({"--sun-elevation", "26.565", "--exaggeration", "1.5", "--size", "200x120"}), "1");
  EXPECT_EQ(green.at(kWall + 50, 60), green.at(kWall + 20, 60));
  EXPECT_GT(green.at(kWall + 70, 60), green.at(kWall + 20, 60));
}

TEST_F(ShadeCommand, NoShadowLeavesLevelLandAlike) {
  const Channel green = read_channel(draw({"--sun-elevation", "10", "--no-shadow", "--size", "200x120"}), "1");
  EXPECT_EQ(green.at(kWall + 20, 60), green.at(kWall - 20, 60));
}

TEST_F(ShadeCommand, SeedsGiveTheSamePicture) {
  for (const char* azimuth : {"E", "W"}) {
    const std::vector<std::string> options = {"--sun-elevation", "7",       "--azimuth",      azimuth, "--hillshade",
                                              "--size",          "400x240", "--exaggeration", "1.7"};
    const Channel without = read_channel(draw(options, {}, "1.tif"), "1");
    const Channel with = read_channel(draw(options, {"--shadow-seeds"}, "2.tif"), "1");
    int differing = 0;
    for (std::size_t i = 0; i < without.bytes.size(); ++i) {
      const int off = std::abs(static_cast<int>(without.bytes[i]) - static_cast<int>(with.bytes[i]));
      ASSERT_LE(off, 1);  // the last bit of a shadow's height
      differing += off;
    }
    EXPECT_LT(differing, 100);
  }
  const auto used = [&](const char* sun) {
    return json::parse(run_isohf({"shade", folder / "a.isohf", "-o", folder / "3.tif", "--overwrite", "--json",
                                  "--sun-elevation", sun})
                           .out)
        .at("used_shadow_seeds")
        .get<bool>();
  };
  EXPECT_TRUE(used("7"));
  EXPECT_FALSE(used("1"));  // lower than --sun-min
}

TEST_F(ShadeCommand, BytesDoNotDependOnThreads) {
  const std::vector<std::string> options = {"--hillshade", "--size", "77x33", "-j"};
  std::string first;
  for (const char* threads : {"1", "2", "5"}) {
    std::vector<std::string> all = options;
    all.emplace_back(threads);
    const std::string bytes = read_file(draw(all, {}, "a.png"));
    if (first.empty()) first = bytes;
    EXPECT_TRUE(bytes == first) << threads;
  }
}

TEST_F(ShadeCommand, VoidsAreTransparent) {
  const Channel alpha = read_channel(draw({"--size", "200x120"}), "3");
  EXPECT_EQ(alpha.at(5, 5), 0);
  EXPECT_EQ(alpha.at(60, 60), 255);
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
    const RunResult shaded = run_isohf({"shade", folder / "a.isohf", folder / "a.tif", "--overwrite", "-q", "--palette",
                                        "gray", "--azimuth", rises_east ? "W" : "E", "--size", "12x12"});
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

TEST_F(ShadeCommand, RefusesWrongUsage) {
  (void)draw({});
  const auto code = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"shade", folder / "a.isohf", folder / "b.png"});
    return run_isohf(more).exit_code;
  };
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--sun-elevation", "0"},
                                             {"--sun-elevation", "90"},
                                             {"--sun-elevation", "x"},
                                             {"--azimuth", "N"},
                                             {"--size", "0x5"},
                                             {"--size", "0"},
                                             {"--size", "5.5"},
                                             {"--exaggeration", "0"},
                                             {"--palette", "blue"},
                                             {"--shadow-softness", "-1"},
                                             {"--no-shadow", "--shadow-softness", "1"}}) {
    EXPECT_EQ(code(wrong), 2) << wrong[0];
  }
  EXPECT_EQ(run_isohf({"shade", folder / "a.isohf", folder / "a.tif"}).exit_code, 2);  // exists
  EXPECT_EQ(run_isohf({"shade", folder / "a.isohf", folder / "b.jpg"}).exit_code, 2);
  EXPECT_EQ(run_isohf({"shade", folder / "missing.isohf", folder / "b.png"}).exit_code, 1);
  for (const std::string& name : folder.names()) EXPECT_THAT(name, testing::Not(HasSubstr("b.")));
}

}  // namespace
}  // namespace isohf::test
