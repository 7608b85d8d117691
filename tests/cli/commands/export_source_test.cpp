/// isohf export without options, which gives the source's samples, and convert --lossless, as a user runs them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/write/raster_sink.h"
#include "support/rasters/plain_tiff.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kCoast = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
const std::string kPeaks = ISOHF_SOURCE_DIR "/testdata/peaks_256x256_uint16.png";
const std::string kRidges = ISOHF_SOURCE_DIR "/testdata/ridges_161x161_float.exr";
const std::string kVoids = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";

/// Stripes of 0 and 255, which a spline overshoots.
void write_stripes(const std::string& path, SampleType type = SampleType::kUint8) {
  RasterSpec spec;
  spec.width = 64;
  spec.height = 64;
  spec.sample_type = type;
  const std::size_t bytes = size_bytes(type);
  std::vector<std::byte> rows(bytes * 64 * 64);
  for (std::size_t i = 0; i < rows.size(); i += bytes)
    rows[i] = std::byte{i / bytes % 64 / 8 % 2 == 0 ? std::uint8_t{0} : std::uint8_t{255}};
  write_raster(path, spec, rows);
}

class ExportAsSource : public testing::Test {
 protected:
  void convert(const std::string& input, const std::vector<std::string>& more = {}) const {
    const RunResult result = run_isohf(with_more({"convert", input, folder / "a.isohf", "--overwrite", "-q"}, more));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    ASSERT_EQ(result.out + result.err, "");
  }

  [[nodiscard]] RunResult run(const std::string& output, const std::vector<std::string>& more = {},
                              const RunOptions& options = {}) const {
    return run_isohf(with_more({"export", folder / "a.isohf", folder / output}, more), options);
  }

  [[nodiscard]] Raster exported(const std::string& output, std::vector<std::string> more = {}) const {
    more.emplace_back("--overwrite");
    more.emplace_back("-q");
    const RunResult result = run(output, more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out + result.err, "");
    return read_raster(folder / output);
  }

  /// One line on standard error that holds `part`, nothing on standard output, nothing written.
  void expect_refused(const RunResult& result, int exit_code, const std::string& part) const {
    EXPECT_EQ(result.exit_code, exit_code);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, testing::StartsWith("isohf export: "));
    EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const std::string& name : folder.names()) EXPECT_FALSE(name.ends_with(".part")) << name;
  }

  TemporaryFolder folder;
};

TEST_F(ExportAsSource, MoreThreadsThanCoresAreNoWordOnStandardError) {
  convert(kCoast);
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"export", folder / "a.isohf", folder / "back.tif"},
                                             {"verify", folder / "a.isohf", "--against", kCoast},
                                             {"shade", folder / "a.isohf", "-o", folder / "back.png"},
                                             {"convert", kCoast, folder / "b.isohf"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"-j", "300"});
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 0) << command.front();
    EXPECT_EQ(result.err, "") << command.front();
  }
}

/// Restoring by splines undoes more of the resampling than the triangles do.
TEST_F(ExportAsSource, HexIsNearerToTheSourceThanTheTriangles) {
  convert(kRidges, {"--filter", "bspline3", "--type", "f32", "--fit"});
  const Raster source = read_raster(kRidges);
  const auto rms = [&](const Raster& back) {
    double sum = 0.0;
    for (std::size_t i = 0; i < back.elevations.size(); ++i) {
      const double error = static_cast<double>(back.elevations[i]) - static_cast<double>(source.elevations[i]);
      sum += error * error;
    }
    return std::sqrt(sum / static_cast<double>(back.elevations.size()));
  };
  const double hex = rms(exported("hex.exr", {"--method", "hex"}));
  const double triangles = rms(exported("seen.exr", {"--method", "barycentric"}));
  EXPECT_LT(hex, 0.5 * triangles);
}

TEST_F(ExportAsSource, BarycentricGivesWhatSamplePrints) {
  convert(kRidges);
  const Raster back = exported("seen.exr", {"--method", "barycentric", "--size", "23x19"});
  const json said = json::parse(run("seen2.exr", {"--method", "barycentric", "--size", "23x19", "--json"}).out);
  std::string places;
  for (int r = 0; r < 19; ++r) {
    for (int c = 0; c < 23; ++c) {
      places +=
          std::to_string(said.at("first_sample").at("x").get<double>() + c * said.at("spacing").at("x").get<double>()) +
          " " +
          std::to_string(said.at("first_sample").at("z").get<double>() + r * said.at("spacing").at("z").get<double>()) +
          "\n";
    }
  }
  RunOptions input;
  input.input = places;
  std::istringstream lines(run_isohf({"sample", folder / "a.isohf"}, input).out);
  std::size_t i = 0;
  for (std::string line; std::getline(lines, line); ++i) {
    // Places were printed with six decimals, on slopes of up to some hundred.
    EXPECT_NEAR(std::stod(line), static_cast<double>(back.elevations.at(i)), 0.01) << line;
  }
  EXPECT_EQ(i, back.elevations.size());
}

TEST_F(ExportAsSource, SizeAndSpacingCoverTheSourcesGround) {
  convert(kVoids);
  const Georeference source = read_raster(kVoids).info.georeference;
  const double first = source.registration == Registration::kArea ? 0.5 : 0.0;
  const double west = source.origin_x - first * source.spacing_x;
  const double north = source.origin_y + first * source.spacing_y;
  const Raster half = exported("half.tif", {"--size", "100x75"});
  const Georeference& place = half.info.georeference;
  EXPECT_EQ(half.info.width, 100);
  EXPECT_EQ(half.info.height, 75);
  // Coordinates up to 1e7 with 15 digits.
  EXPECT_NEAR(place.origin_x - first * place.spacing_x, west, 1e-6);
  EXPECT_NEAR(place.origin_y + first * place.spacing_y, north, 1e-6);
  const double span = source.spacing_x * (first > 0.0 ? 200.0 : 199.0);
  EXPECT_NEAR(place.spacing_x * (first > 0.0 ? 100.0 : 99.0), span, 1e-6);
  EXPECT_GT(std::count_if(half.elevations.begin(), half.elevations.end(), [](float h) { return std::isnan(h); }), 0);

  const json said = json::parse(run("spaced.tif", {"--spacing", "50", "--json"}).out);
  const Raster spaced = read_raster(folder / "spaced.tif");
  EXPECT_EQ(said.at("spacing").at("x"), 50.0);
  EXPECT_EQ(spaced.info.width, said.at("width"));
}

TEST_F(ExportAsSource, LikeTakesTheOtherRastersGrid) {
  convert(kVoids);
  const Raster plain = exported("plain.tif");
  const Raster same = exported("same.tif", {"--like", kVoids});
  EXPECT_EQ(read_file(folder / "plain.tif"), read_file(folder / "same.tif"));
  // A coarse raster over the same ground, by its georeference.
  const Raster half = exported("half.tif", {"--size", "100x75"});
  const Raster like_half = exported("like.tif", {"--like", folder / "half.tif"});
  EXPECT_EQ(like_half.info.width, 100);
  EXPECT_NEAR(like_half.info.georeference.origin_x, half.info.georeference.origin_x, 1e-6);
  for (std::size_t i = 0; i < half.elevations.size(); ++i) {
    ASSERT_EQ(std::isnan(half.elevations[i]), std::isnan(like_half.elevations[i])) << i;
    if (std::isnan(half.elevations[i])) continue;
    EXPECT_NEAR(half.elevations[i], like_half.elevations[i], 1.0F) << i;  // rounding ties
  }
  // A larger raster from the same corner on: the same samples, and nothing where the archive has no tile.
  const Raster larger = exported("larger.tif", {"--like", kCoast});
  EXPECT_EQ(larger.info.width, 512);
  for (std::int64_t r = 0; r < 384; ++r) {
    for (std::int64_t c = 0; c < 512; ++c) {
      const float found = larger.at(c, r);
      if (c < 200 && r < 150) {
        ASSERT_TRUE(found == plain.at(c, r) || (std::isnan(found) && std::isnan(plain.at(c, r)))) << c << ", " << r;
      } else if (c > 300 || r > 250) {
        ASSERT_TRUE(std::isnan(found)) << c << ", " << r;
      }
    }
  }
}

TEST_F(ExportAsSource, ExactSamplesGoIntoEveryFormatThatHoldsThem) {
  convert(kVoids, {"--lossless"});
  const Raster source = read_raster(kVoids);
  for (const char* name : {"back.tif", "back.exr"}) {
    const Raster back = exported(name);
    ASSERT_EQ(back.elevations.size(), source.elevations.size());
    for (std::size_t i = 0; i < back.elevations.size(); ++i) {
      // OpenEXR has no void value: there voids are NaN.
      ASSERT_TRUE(back.elevations[i] == source.elevations[i] ||
                  (std::isnan(back.elevations[i]) && std::isnan(source.elevations[i])))
          << i;
    }
  }
  expect_refused(run("back.png"), 2,
                 "is -32768 (nodata), which uint16 does not hold; use another format or --type, or --surface");
  convert(kRidges, {"--lossless"});
  expect_refused(run("back.png"), 2, "which uint16 does not hold; use another format");
}

TEST_F(ExportAsSource, WhatOvershootsTheSourcesOwnTypeIsMovedToItsEndsWithAWord) {
  write_stripes(folder / "stripes.png");
  convert(folder / "stripes.png", {"--filter", "bspline3", "--z-scale", "0.5", "--z-offset", "-100"});
  const RunResult clamped = run("back.png");
  EXPECT_EQ(clamped.exit_code, 0) << clamped.err;
  EXPECT_THAT(clamped.err, HasSubstr(" samples of the surface overshoot the uint8 of its source and were clamped"));
  EXPECT_EQ(run("back.png", {"--overwrite", "--clamp-range"}).err, "") << "it was asked for";
  convert(folder / "stripes.png", {"--filter", "bspline3"});
  EXPECT_THAT(clamped.out, HasSubstr("clamped      "));
  EXPECT_EQ(run("back.png", {"--overwrite"}).exit_code, 0);
  const Raster back = read_raster(folder / "back.png");
  // No void value takes a number away from a raster without voids.
  EXPECT_EQ(*std::max_element(back.elevations.begin(), back.elevations.end()), 255.0F);
  EXPECT_EQ(std::count_if(back.elevations.begin(), back.elevations.end(), [](float h) { return std::isnan(h); }), 0);
  const Raster wide = exported("back.exr");
  EXPECT_GT(*std::max_element(wide.elevations.begin(), wide.elevations.end()), 255.0F);
}

TEST_F(ExportAsSource, SamplesThatAnotherTypeDoesNotHoldAreRefusedWithARemedy) {
  write_stripes(folder / "stripes.tif", SampleType::kInt16);
  convert(folder / "stripes.tif");
  expect_refused(run("back.png"), 2, "which uint16 does not hold; use --raw-scale");
  EXPECT_EQ(run("back.png", {"--clamp-range"}).exit_code, 0);
  expect_refused(run("b.tif", {"--type", "u8", "--raw-scale", "0.5"}), 2, " (elevations are ");
}

TEST_F(ExportAsSource, TypeIsThatOfTheSamples) {
  write_stripes(folder / "stripes.tif", SampleType::kInt16);
  for (const std::vector<std::string>& kept : {std::vector<std::string>{"--lossless"}, {}}) {
    convert(folder / "stripes.tif", kept);
    const Raster as_source = exported("back.tif");
    EXPECT_EQ(as_source.info.sample_type, SampleType::kInt16);
    const Raster floats = exported("back.tif", {"--type", "f32"});
    EXPECT_EQ(floats.info.sample_type, SampleType::kFloat32);
    for (std::size_t i = 0; i < as_source.elevations.size(); ++i) {
      ASSERT_NEAR(floats.elevations[i], as_source.elevations[i], kept.empty() ? 0.5 : 0.0);
    }
  }
  convert(folder / "stripes.tif", {"--lossless"});
  EXPECT_EQ(exported("back.tif", {"--type", "u8"}).info.sample_type, SampleType::kUint8);
  write_raster(
      folder / "low.tif",
      [] {
        RasterSpec spec;
        spec.width = spec.height = 8;
        spec.sample_type = SampleType::kInt16;
        return spec;
      }(),
      std::vector<std::byte>(128, std::byte{0xFF}));
  convert(folder / "low.tif", {"--lossless"});
  expect_refused(run("none.tif", {"--type", "u8"}), 2,
                 "is -1, which uint8 does not hold; use another format or --type");
}

TEST_F(ExportAsSource, SaysThatTheArchiveComesFirst) {
  convert(kPeaks);
  const RunResult swapped = run_isohf({"export", kPeaks, folder / "b.isohf"});
  EXPECT_EQ(swapped.exit_code, 2);
  EXPECT_THAT(swapped.err, HasSubstr("b.isohf: OUTPUT has an archive's name; ARCHIVE comes first, OUTPUT last"));
}

TEST_F(ExportAsSource, VoidsAndSamplesOfTheVoidValueStayApart) {
  write_stripes(folder / "stripes.tif");
  convert(folder / "stripes.tif", {"--nodata", "0"});
  // 255 stands for the voids here, so that no sample may be 255.
  expect_refused(run("back.tif"), 2, "is 255, which uint8 does not hold");
  const Raster back = exported("back.tif", {"--clamp-range"});
  EXPECT_EQ(*std::max_element(back.elevations.begin(), back.elevations.end(),
                              [](float a, float b) { return std::isnan(a) || a < b; }),
            254.0F);
}

TEST_F(ExportAsSource, OfAnExtractGivesItsGround) {
  convert(kCoast, {"--shape", "60x67"});
  const std::string part = folder / "part.isohf";
  ASSERT_EQ(run_isohf({"extract", folder / "a.isohf", "-o", part, "--tiles", "1:3,1:2"}).exit_code, 0);
  EXPECT_THAT(run_isohf({"verify", part}).out, HasSubstr("passed: 2 tiles and "));
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--method", "barycentric"}}) {
    const std::string cut = folder / "cut.tif";
    std::vector<std::string> of_part = {"export", part, cut, "--overwrite", "--json"};
    of_part.insert(of_part.end(), more.begin(), more.end());
    ASSERT_EQ(
        run_isohf(with_more({"export", folder / "a.isohf", folder / "all.tif", "--overwrite", "-q"}, more)).exit_code,
        0);
    const RunResult result = run_isohf(of_part);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(json::parse(result.out).at("voids"), 0);
    const Raster all = read_raster(folder / "all.tif");
    const Raster found = read_raster(cut);
    EXPECT_LT(found.info.width, all.info.width / 2);
    EXPECT_LT(found.info.height, all.info.height / 2);
    const Georeference& place = found.info.georeference;
    const Georeference& whole = all.info.georeference;
    const std::int64_t column = std::llround((place.origin_x - whole.origin_x) / whole.spacing_x);
    const std::int64_t row = std::llround((whole.origin_y - place.origin_y) / whole.spacing_y);
    ASSERT_GT(column, 50);
    ASSERT_GT(row, 50);
    for (std::int64_t r = 0; r < found.info.height; ++r) {
      for (std::int64_t c = 0; c < found.info.width; ++c) {
        EXPECT_EQ(found.elevations[static_cast<std::size_t>(r * found.info.width + c)],
                  all.elevations[static_cast<std::size_t>((row + r) * all.info.width + column + c)])
            << c << ", " << r;
      }
    }
    EXPECT_NEAR(static_cast<double>(column) * whole.spacing_x + whole.origin_x, place.origin_x, 1e-6);
  }
}

TEST_F(ExportAsSource, OfAnExtractTheGroundThatIsElsewhereIsVoid) {
  convert(kCoast, {"--shape", "60x67"});
  const std::string part = folder / "part.isohf";
  ASSERT_EQ(run_isohf({"extract", folder / "a.isohf", "-o", part, "--tiles", "1:2,0:2"}).exit_code, 0);
  for (const char* output : {"a.tif", "a.asc", "a.r16", "a.exr"}) {
    const RunResult result = run_isohf({"export", part, folder / output, "--like", kCoast, "--clamp-range", "--json"});
    ASSERT_EQ(result.exit_code, 0) << output << result.err;
    EXPECT_GT(json::parse(result.out).at("voids").get<std::int64_t>(), 1000) << output;
  }
}

TEST_F(ExportAsSource, SaysWhereScaleAndOffsetAreLost) {
  convert(kPeaks, {"--z-scale", "0.5", "--z-offset", "-100"});
  const RunResult result = run("back.exr");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: "));
  EXPECT_THAT(result.err, HasSubstr("elevation = raw * 0.5 + -100"));
  const RunResult picture = run("back.png");
  EXPECT_EQ(picture.err, "");
  const json beside = json::parse(std::ifstream(folder / "back.png.json"));
  EXPECT_EQ(beside.at("z_scale"), 0.5);
  EXPECT_EQ(beside.at("z_offset"), -100.0);
  const Raster tiff = exported("back.tif");
  EXPECT_EQ(tiff.info.z_scale, 0.5);
  EXPECT_EQ(tiff.info.z_offset, -100.0);
}

TEST_F(ExportAsSource, VoidsByRangeNeverComeBackAsElevationsWithoutAWord) {
  write_stripes(folder / "stripes.tif");
  convert(folder / "stripes.tif", {"--valid-range", "-10:200", "--lossless"});
  // As kept, bit for bit, told also where little is told; another type has one value for all of them.
  const RunResult kept = run("kept.tif", {"-q"});
  EXPECT_EQ(kept.exit_code, 0);
  EXPECT_EQ(kept.err, "isohf export: warning: " + (folder / "kept.tif") +
                          ": 2048 samples are outside -10 to 200, which meant nodata and is not declared; read it with "
                          "--valid-range, or write one nodata value by --surface\n");
  EXPECT_EQ(run("strict.tif", {"--strict"}).exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder / "strict.tif"));
  const Raster wider = exported("wider.flt");
  for (const float z : wider.elevations) EXPECT_TRUE(std::isnan(z) || z == 0.0F) << z;
  EXPECT_EQ(std::count_if(wider.elevations.begin(), wider.elevations.end(), [](float z) { return std::isnan(z); }),
            2048);
}

TEST_F(ExportAsSource, SaysWhatAFormatHasNoPlaceFor) {
  RasterSpec spec;
  spec.width = spec.height = 161;
  spec.sample_type = SampleType::kInt16;
  spec.vertical_unit = "foot";
  spec.georeference.emplace();
  spec.georeference->unit = HorizontalUnit::kDegree;
  spec.georeference->has_origin = true;
  spec.georeference->spacing_x = spec.georeference->spacing_y = 0.01;
  spec.georeference->system.epsg = 4267;
  write_raster(folder / "nad27.tif", spec, std::vector<std::byte>(std::size_t{2} * 161 * 161));
  convert(folder / "nad27.tif");
  for (const char* output : {"back.asc", "back.flt", "back.npy"}) {
    EXPECT_THAT(run(output, {"-q"}).err, HasSubstr("has no place for the unit of its elevations, foot")) << output;
  }
  const RunResult hgt = run("back.hgt", {"-q", "--size", "1201x1201"});
  EXPECT_THAT(hgt.err, HasSubstr("has no place for the unit of its elevations, foot"));
  EXPECT_THAT(hgt.err, HasSubstr("readers take it for degrees of WGS 84, which its samples do not lie on"));
  for (const char* output : {"back.tif", "back.png", "back.exr"}) EXPECT_EQ(run(output, {"-q"}).err, "") << output;
}

/// Changes one byte in the middle of a member's compressed bytes.
void damage_member(const std::string& path, const std::string& name) {
  std::string bytes = read_file(path);
  const std::size_t local = bytes.find(name) + name.size();
  const std::size_t next = bytes.find("PK\x03\x04", local);
  bytes[local + (next - local) / 2] ^= 0x10;
  write_file(path, bytes);
}

TEST_F(ExportAsSource, DamageToWhatLosslessKeptNamesTheMemberAndWritesNothing) {
  for (const char* member : {"residual/00000000", "tiles/0/1.tile"}) {
    SCOPED_TRACE(member);
    convert(kCoast, {"--lossless"});
    damage_member(folder / "a.isohf", member);
    const bool tile = std::string(member).starts_with("tiles");
    expect_refused(run("back.tif"), 1, tile ? "tile (1,0)" : "member \"residual/00000000\"");
    expect_refused(run("back.exr"), 1, tile ? "tile (1,0)" : "member \"residual/00000000\"");
    EXPECT_EQ(run_isohf({"verify", folder / "a.isohf", "-q"}).exit_code, 3);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.isohf"});
  }
  // Nothing was promised of the surface alone.
  convert(kCoast);
  damage_member(folder / "a.isohf", "tiles/0/1.tile");
  expect_refused(run("back.tif"), 1, "tile (1,0)");
}

}  // namespace
}  // namespace isohf::test
