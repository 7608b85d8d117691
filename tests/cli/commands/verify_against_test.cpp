/// `verify --against INPUT` reads INPUT as convert was told to read it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/geotiff/tiff_bytes.h"
#include "support/altered_archive.h"
#include "support/rasters/degree_grid.h"
#include "support/rasters/small_geoid.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;
using Words = std::vector<std::string>;

constexpr int kColumns = 60;
constexpr int kRows = 45;

double height(double x, double y) {
  return std::round(500.0 + 200.0 * std::sin(0.2 * x) * std::cos(0.17 * y));
}

std::string samples(int bytes) {
  std::string out;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const auto value = static_cast<unsigned>(height(c, r)) / (bytes == 1 ? 4 : 1);
      for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 255U);
    }
  }
  return out;
}

/// 0 in a disc, 255 elsewhere.
bool is_transparent(int column, int row) {
  return std::hypot(column - 20, row - 20) < 8.0;
}

class VerifyAgainst : public testing::Test {
 protected:
  VerifyAgainst() {
    // Every integer of its type is an elevation, so that transparent samples widen it.
    TiffBytes mask;
    std::string opaque;
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kColumns; ++c) opaque += is_transparent(c, r) ? '\0' : '\xff';
    }
    mask.image(kColumns, kRows, 8, 1, kRows).longs(254, {4}).shorts(262, {4}).block(opaque);
    TiffBytes masked;
    masked.image(kColumns, kRows, 16, 1, kRows).block(samples(2)).next(mask);
    write_file(folder / "mask.tif", masked.build());
    std::string pairs;
    const std::string grays = samples(1);
    for (std::size_t i = 0; i < grays.size(); ++i) (pairs += grays[i]) += opaque[i];
    TiffBytes alpha;
    alpha.image(kColumns, kRows, 8, 1, kRows).shorts(258, {8, 8}).shorts(277, {2}).shorts(338, {2});
    write_file(folder / "alpha.tif", alpha.shorts(339, {1, 1}).block(pairs).build());
    write_file(folder / "plain.bin", samples(2));
    write_degrees(folder / "land", kColumns, kRows, 5.0, 44.0, 0.01, [](double x, double y) {
      return std::hypot(x - 5.3, y - 44.2) < 0.05 ? -9999.0 : height(90 * x, 90 * y);
    });
    write_degrees(folder / "globe", 72, 36, -180.0, -90.0, 5.0,
                  [](double x, double y) { return height(x / 9, y / 9); });
    write_geoid(folder / "small.pgm", 72, 37, [](double x, double) { return 40.0 + std::sin(x); });
    std::filesystem::create_directories(folder / "tiles/east");
    write_degrees(folder / "tiles/west", 40, kRows, 5.0, 44.0, 0.01,
                  [](double x, double y) { return height(90 * x, 90 * y); });
    write_degrees(folder / "tiles/east/east", 40, kRows, 5.3, 44.0, 0.01,
                  [](double x, double y) { return height(90 * x, 90 * y) + 50; });
  }

  RunResult convert(const std::string& input, const Words& options) const {
    return run_isohf(
        with_more({"convert", folder / input, "-o", folder / "a.isohf", "--overwrite", "--quiet"}, options));
  }
  RunResult verify(const std::string& input, const Words& options = {}) const {
    return run_isohf(with_more({"verify", folder / "a.isohf", "--against", folder / input}, options));
  }

  TemporaryFolder folder;
};

TEST_F(VerifyAgainst, TakesTheOptionsOfTheInputFromTheArchive) {
  const std::vector<std::pair<std::string, std::vector<Words>>> cases = {
      {"mask.tif",
       {{},
        {"--channel", "0"},
        {"--nodata", "500"},
        {"--nodata", "0,65535"},
        {"--valid-range", "400:600"},
        {"--fill"},
        {"--fill=3"},
        {"--fill", "--valid-range", "400:600"},
        {"--registration", "point"},
        {"--registration", "area"},
        {"--z-scale", "0.5", "--z-offset", "-20"},
        {"--sample-spacing", "12"},
        {"--lossless"},
        {"--fit"},
        {"--type", "u8"},
        {"--type", "f32"},
        {"--filter", "bspline3", "--acquisition", "box"},
        {"--shadow-seeds"}}},
      {"alpha.tif", {{}, {"--channel", "0"}, {"--channel", "1"}, {"--nodata", "7"}, {"--fill"}, {"--lossless"}}},
      {"plain.bin",
       {{"--raw", "60x45:u16le"},
        {"--raw", "120x45:u8", "--z-scale", "2", "--registration", "area", "--sample-spacing", "3", "--nodata", "9"},
        {"--raw", "60x45:u16le", "--valid-range", "450:600", "--fill=9"}}},
      {"land.flt",
       {{},
        {"--bbox", "5.1,44.1,5.4,44.3"},
        {"--bbox", "5.1,44.1,5.4,44.3", "--fill", "--to-crs", "utm"},
        {"--geoid", folder / "small.pgm"},
        {"--geoid", folder / "small.pgm:to-orthometric", "--bbox", "5.1,44.1,5.4,44.3"},
        {"--to-crs", "none"},
        {"--to-crs", "local", "--lossless"},
        {"--nodata", "-9999,510"}}},
      {"globe.flt",
       {{}, {"--no-wrap"}, {"--wrap-x", "--lossless"}, {"--geoid", folder / "small.pgm"}, {"--bbox=170,-20,-170,20"}}},
      {"tiles",
       {{"--recursive"},
        {"--recursive", "--on-top", "first"},
        {"--recursive", "--bbox", "5.2,44.1,5.5,44.3", "--fill"}}},
  };
  for (const auto& [input, options] : cases) {
    for (const Words& with : options) {
      std::string line = input;
      for (const std::string& word : with) line += " " + word;
      SCOPED_TRACE(line);
      const RunResult converted = convert(input, with);
      ASSERT_EQ(converted.exit_code, 0) << converted.err;
      const RunResult verified =
          input == "tiles" ? verify("tiles/east", {"--against", folder / "tiles"}) : verify(input);
      EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    }
  }
}

TEST_F(VerifyAgainst, SaysWhichGeoidIsMissing) {
  ASSERT_EQ(convert("land.flt", {"--geoid", folder / "small.pgm:to-orthometric"}).exit_code, 0);
  EXPECT_THAT(read_file(folder / "a.isohf"), testing::Not(HasSubstr(folder.path())));  // no folders of the maker's
  std::filesystem::create_directory(folder / "elsewhere");
  std::filesystem::rename(folder / "small.pgm", folder / "elsewhere/small.pgm");
  const RunResult missing = verify("land.flt");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("a.isohf: " + (folder / "small.pgm")));
  EXPECT_EQ(verify("land.flt", {"--geoid", folder / "elsewhere/small.pgm:to-orthometric"}).exit_code, 0);
}

TEST_F(VerifyAgainst, RefusesARasterThatIsNotTheArchivesSource) {
  ASSERT_EQ(convert("land.flt", {}).exit_code, 0);
  const auto ground = [](double x, double y) { return height(90 * x, 90 * y); };
  const auto refused = [&](const std::string& input, const std::string& what) {
    const RunResult result = verify(input);
    EXPECT_EQ(result.exit_code, 2) << what << result.out;
    EXPECT_THAT(result.err, HasSubstr("is not what " + folder.path() + "/a.isohf was made from: "));
    EXPECT_THAT(result.err, HasSubstr(what));
  };
  write_degrees(folder / "moved", kColumns, kRows, 5.01, 44.0, 0.01, ground);
  refused("moved.flt", "begins at (5.015, 44.445), not at (5.005, 44.445)");
  write_degrees(folder / "wide", kColumns, kRows, 5.0, 44.0, 0.02, ground);
  refused("wide.flt", "has samples 0.02 by 0.02 apart, not 0.01 by 0.01; begins at");
  write_degrees(folder / "small", kColumns, kRows - 1, 5.0, 44.01, 0.01, ground);
  refused("small.flt", "has 60x44 samples, not 60x45");
  write_degrees(folder / "other", kColumns, kRows, 5.0, 44.0, 0.01, ground);
  write_file(folder / "other.prj",
             "GEOGCS[\"NAD27\",DATUM[\"D_North_American_1927\",SPHEROID[\"Clarke_1866\",6378206.4,294.9786982]],"
             "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]");
  refused("other.flt", "is in EPSG:4267, not EPSG:4326");
  write_file(folder / "other.prj", "EPSG:32631");
  refused("other.flt", "is in metres, not degrees");
  // Of a thousandth of a sample nobody asks, nor from where longitudes are counted.
  write_degrees(folder / "near", kColumns, kRows, 5.000005, 44.0, 0.01, ground);
  EXPECT_THAT(verify("near.flt").err, testing::Not(HasSubstr("is not what")));
  write_degrees(folder / "round", kColumns, kRows, 365.0, 44.0, 0.01, ground);
  EXPECT_THAT(verify("round.flt").err, testing::Not(HasSubstr("is not what")));
}

TEST_F(VerifyAgainst, WarnsOfARasterWithoutAPlace) {
  ASSERT_EQ(convert("land.flt", {}).exit_code, 0);
  TiffBytes tiff;
  tiff.image(kColumns, kRows, 16, 1, kRows).block(samples(2));
  write_file(folder / "bare.tif", tiff.build());
  const RunResult bare = verify("bare.tif");
  EXPECT_EQ(bare.exit_code, 3) << "it has no lake";
  EXPECT_THAT(bare.err, HasSubstr("bare.tif: does not say where it lies"));
  ASSERT_EQ(convert("plain.bin", {"--raw", "60x45:u16le"}).exit_code, 0);
  EXPECT_EQ(verify("plain.bin").err, "");
}

TEST_F(VerifyAgainst, TakesOptionsOfAnInputAloneFromTheArchive) {
  ASSERT_EQ(convert("land.flt", {"--valid-range", "0:9000"}).exit_code, 0);
  AlteredArchive archive(folder / "a.isohf");
  const auto refused = [&](const std::string& name, const std::string& text, const std::string& why) {
    archive.metadata["source"]["options"] = {{"valid-range", "0:9000"}, {name, text}};
    archive.write(folder / "b.isohf");
    EXPECT_EQ(run_isohf({"verify", folder / "b.isohf", "-q"}).exit_code, 0) << "the archive is whole";
    const RunResult result = run_isohf({"verify", folder / "b.isohf", "--against", folder / "land.flt"});
    EXPECT_EQ(result.exit_code, 1) << result.out;
    EXPECT_THAT(result.err, testing::AllOf(HasSubstr("b.isohf: isohf.json: source.options: " + name), HasSubstr(why)));
    EXPECT_EQ(result.out, "");
  };
  for (const char* const other : {"against", "config", "geoid-file", "help", "json", "memory", "overwrite", "quiet",
                                  "strict", "threads", "verbose", "version", "INPUT", "-q", ""}) {
    refused(other, "true", "is not an option of an input");
  }
  refused("geoid", "../small.pgm", "must be a name without a folder");
  refused("fill", "perhaps", "found 'perhaps', must be");
  refused("registration", "nowhere", "found 'nowhere', must be");
}

TEST_F(VerifyAgainst, OfAnExtractOnlyItsOwnGroundIsCompared) {
  const std::string part = folder / "part.isohf";
  for (const Words& with : std::vector<Words>{{}, {"--to-crs", "utm"}}) {
    ASSERT_EQ(convert("land.flt", with_more({"--shape", "12x19"}, with)).exit_code, 0);
    ASSERT_EQ(run_isohf({"extract", folder / "a.isohf", "-o", part, "--tiles", "1:3,1:2", "--overwrite"}).exit_code, 0);
    const Words against = {"verify", part, "--against", folder / "land.flt", "--json"};
    const RunResult sound = run_isohf(against);
    EXPECT_EQ(sound.exit_code, 0) << sound.out << sound.err;
    const auto compared = nlohmann::json::parse(sound.out)["against"]["samples_compared"].get<std::int64_t>();
    EXPECT_GT(compared, 50);
    EXPECT_LT(compared, kColumns * kRows / 2);
    // Other ground is found all the same.
    write_degrees(folder / "other", kColumns, kRows, 5.0, 44.0, 0.01, [](double, double) { return 400.0; });
    EXPECT_EQ(run_isohf({"verify", part, "--against", folder / "other.flt"}).exit_code, 3);
  }
}

TEST_F(VerifyAgainst, TakesWhatWasCutFromACoarsePlane) {
  for (const Words& with : std::vector<Words>{{}, {"--fit"}, {"--type", "f32"}}) {
    ASSERT_EQ(convert("land.flt", with_more({"--shape", "12x19", "--density", "2"}, with)).exit_code, 0);
    const std::string plane = folder / "plane.isohf";
    ASSERT_EQ(run_isohf({"extract", folder / "a.isohf", "-o", plane, "--overview", "1", "--overwrite"}).exit_code, 0);
    const RunResult sound = run_isohf({"verify", plane, "--against", folder / "land.flt"});
    EXPECT_EQ(sound.exit_code, 0) << sound.out << sound.err;
    write_degrees(folder / "other", kColumns, kRows, 5.0, 44.0, 0.01, [](double, double) { return 400.0; });
    EXPECT_EQ(run_isohf({"verify", plane, "--against", folder / "other.flt"}).exit_code, 3);
  }
}

}  // namespace
}  // namespace isohf::test
