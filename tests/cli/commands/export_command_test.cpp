/// isohf export, as a user runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "isohf/raster.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kVoids = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";
const std::string kCoast = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";

/// The numbers as stored, whatever the file beside them says that they mean.
Raster read_codes(const std::string& path) {
  Raster raster = read_raster(path);
  raster.info.z_scale = 1.0;
  raster.info.z_offset = 0.0;
  heights_from_samples(raster.info, 0.0, raster.raw, raster.elevations);
  return raster;
}

class ExportCommand : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(run_isohf({"convert", kCoast, folder_ / "coast.isohf", "-q"}).exit_code, 0); }

  [[nodiscard]] json exported(std::vector<std::string> arguments, const std::string& archive = "coast.isohf") const {
    arguments.insert(arguments.begin(), {"export", folder_ / archive});
    arguments.emplace_back("--json");
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(result.err.empty() || result.err.find("nodata samples are written as") != std::string::npos)
        << result.err;
    return result.exit_code == 0 ? json::parse(result.out) : json();
  }

  [[nodiscard]] std::string refused(std::vector<std::string> arguments, int exit_code = 2) const {
    arguments.insert(arguments.begin(), {"export", folder_ / "coast.isohf"});
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.out;
    const std::string error =
        result.err.substr(result.err.starts_with("isohf export: warning") ? result.err.find('\n') + 1 : 0);
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << result.err;
    return error;
  }

  TemporaryFolder folder_;
};

/// Tiles store the vertices on their edges, also those whose neighbours are not there.
TEST_F(ExportCommand, AnExtractHasElevationsOnAllOfItsEdges) {
  ASSERT_EQ(run_isohf({"convert", kCoast, folder_ / "posts.isohf", "--registration", "point", "-q"}).exit_code, 0);
  ASSERT_EQ(
      run_isohf({"extract", folder_ / "posts.isohf", "-o", folder_ / "part.isohf", "--tiles", "0:2,0:1"}).exit_code, 0);
  const json info = json::parse(run_isohf({"info", folder_ / "part.isohf", "--json"}).out).at("metadata");
  const double east = 2.0 * info.at("extent").at("x").get<double>();
  const double south = info.at("extent").at("z").get<double>();
  for (const std::string method : {"hex", "barycentric", "average"}) {
    const json said =
        exported({folder_ / "part.tif", "--size", "129x65", "--method", method, "--overwrite"}, "part.isohf");
    EXPECT_NEAR(said.at("first_sample").at("x").get<double>() + 128.0 * said.at("spacing").at("x").get<double>(), east,
                1e-6);
    EXPECT_EQ(said.at("voids"), 0) << method;
  }
  const auto sampled = [&](const std::string& archive) {
    return run_isohf({"sample", folder_ / archive, "--at", std::to_string(east) + ",100", "--at",
                      "100," + std::to_string(south), "--at", std::to_string(east) + "," + std::to_string(south)})
        .out;
  };
  const std::string found = sampled("part.isohf");
  EXPECT_EQ(found.find("void"), std::string::npos) << found;
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 3);
}

/// What filters leave of level ground is not spread over all numbers.
TEST_F(ExportCommand, LevelGroundIsOneNumber) {
  {
    std::ofstream grid(folder_ / "level.asc");
    grid << "ncols 60\nnrows 50\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
    for (int i = 0; i < 3000; ++i) grid << (i % 60 == 59 ? "100.1\n" : "100.1 ");
  }
  ASSERT_EQ(run_isohf({"convert", folder_ / "level.asc", folder_ / "level.isohf", "-q"}).exit_code, 0);
  for (const std::string name : {"level.png", "level.r16"}) {
    const json said = exported({folder_ / name}, "level.isohf");
    EXPECT_EQ(said.at("z_scale"), 1.0);
    const Raster codes = read_codes(folder_ / name);
    EXPECT_EQ(*std::max_element(codes.elevations.begin(), codes.elevations.end()),
              *std::min_element(codes.elevations.begin(), codes.elevations.end()));
    EXPECT_NEAR(said.at("z_offset").get<double>() + codes.elevations.front(), 100.1, 1e-4);
  }
}

TEST_F(ExportCommand, IsReadByGdalWithTheSameElevationsAndVoids) {
  if (run_program({"/bin/sh", "-c", "command -v gdal_translate gdalinfo"}).exit_code != 0)
    GTEST_SKIP() << "gdal-bin is not installed";
  ASSERT_EQ(run_isohf({"convert", kVoids, folder_ / "voids.isohf", "-q"}).exit_code, 0);
  for (const std::string name : {"g.tif", "g.flt", "g.asc", "g.png"}) {
    SCOPED_TRACE(name);
    (void)exported({folder_ / name, "--method", "hex"}, "voids.isohf");
    const std::string raw = folder_ / (name + ".img");
    const RunResult translated = run_program({"/usr/bin/env", "GDAL_PAM_ENABLED=NO", "gdal_translate", "-q", "-of",
                                              "ENVI", "-ot", "Float64", folder_ / name, raw});
    ASSERT_EQ(translated.exit_code, 0) << translated.err;
    const auto told =
        json::parse(run_program({"/usr/bin/env", "GDAL_PAM_ENABLED=NO", "gdalinfo", "-json", folder_ / name}).out);
    const Raster ours = name == "g.png" ? read_codes(folder_ / name) : read_raster(folder_ / name);
    ASSERT_EQ(told.at("size"), json({ours.info.width, ours.info.height}));
    std::vector<double> theirs(ours.elevations.size());
    std::ifstream in(raw, std::ios::binary);
    in.read(reinterpret_cast<char*>(theirs.data()), static_cast<std::streamsize>(theirs.size() * sizeof(double)));
    ASSERT_EQ(in.gcount(), static_cast<std::streamsize>(theirs.size() * sizeof(double)));
    const json& band = told.at("bands").at(0);
    for (std::size_t i = 0; i < theirs.size(); ++i) {
      if (std::isnan(ours.elevations[i])) {
        const bool is_void = std::isnan(theirs[i]) || theirs[i] < -1e38 ||
                             (band.contains("noDataValue") && band.at("noDataValue").get<double>() == theirs[i]);
        ASSERT_TRUE(is_void) << i << " " << theirs[i];
      } else {
        ASSERT_EQ(static_cast<float>(theirs[i]), ours.elevations[i]) << i;
      }
    }
  }
}

TEST_F(ExportCommand, CutsTilesThatShareTheirEdges) {
  const json summary = exported({folder_ / "t.r16", "--tile-size", "129", "--overlap", "1"});
  const json& tiles = summary.at("tiles");
  EXPECT_EQ(tiles.at("across"), 4);  // 512 samples are nearest to 513
  EXPECT_EQ(tiles.at("down"), 3);
  EXPECT_EQ(summary.at("width"), 513);
  EXPECT_EQ(summary.at("height"), 385);
  EXPECT_EQ(summary.at("files"), 12);
  (void)exported({folder_ / "whole.r16", "--size", "513x385"});
  const Raster whole = read_raster(folder_ / "whole.r16");
  for (std::int64_t ty = 0; ty < 3; ++ty) {
    for (std::int64_t tx = 0; tx < 4; ++tx) {
      const Raster tile = read_raster(folder_ / ("t_x" + std::to_string(tx) + "_y" + std::to_string(ty) + ".r16"));
      ASSERT_EQ(tile.info.width, 129);
      ASSERT_EQ(tile.info.height, 129);
      EXPECT_EQ(tile.info.z_scale, whole.info.z_scale);
      EXPECT_DOUBLE_EQ(
          tile.info.georeference.origin_x,
          whole.info.georeference.origin_x + static_cast<double>(128 * tx) * whole.info.georeference.spacing_x);
      EXPECT_DOUBLE_EQ(
          tile.info.georeference.origin_y,
          whole.info.georeference.origin_y - static_cast<double>(128 * ty) * whole.info.georeference.spacing_y);
      for (std::int64_t row = 0; row < 129; ++row) {
        for (std::int64_t column = 0; column < 129; ++column) {
          ASSERT_EQ(tile.at(column, row), whole.at(128 * tx + column, 128 * ty + row));
        }
      }
    }
  }
}

TEST_F(ExportCommand, CutsMoreTilesThanItHasOpenAtATime) {
  (void)exported({folder_ / "t.npy", "--size", "452x78", "--tile-size", "5x40", "--overlap", "2"});
  (void)exported({folder_ / "whole.npy", "--size", "452x78"});
  const Raster whole = read_raster(folder_ / "whole.npy");
  for (std::int64_t ty = 0; ty < 2; ++ty) {
    for (std::int64_t tx = 0; tx < 150; ++tx) {
      const Raster tile = read_raster(folder_ / ("t_x" + std::to_string(tx) + "_y" + std::to_string(ty) + ".npy"));
      for (std::int64_t row = 0; row < 40; ++row) {
        for (std::int64_t column = 0; column < 5; ++column) {
          ASSERT_EQ(tile.at(column, row), whole.at(3 * tx + column, 38 * ty + row)) << tx << " " << ty;
        }
      }
    }
  }
}

TEST_F(ExportCommand, TakesAPartOfTheSourcesGrid) {
  (void)exported({folder_ / "whole.tif"});
  const Raster whole = read_raster(folder_ / "whole.tif");
  const Georeference& place = whole.info.georeference;
  ASSERT_TRUE(place.has_origin);
  // From a little West of column 100 to a little East of column 149, rows 30 to 59.
  const double west = place.origin_x + 99.7 * place.spacing_x;
  const double east = place.origin_x + 149.2 * place.spacing_x;
  const double north = place.origin_y - 29.6 * place.spacing_y;
  const double south = place.origin_y - 59.3 * place.spacing_y;
  const std::string box =
      std::to_string(west) + "," + std::to_string(south) + "," + std::to_string(east) + "," + std::to_string(north);
  const json summary = exported({folder_ / "part.tif", "--bbox", box});
  EXPECT_EQ(summary.at("width"), 50);
  EXPECT_EQ(summary.at("height"), 30);
  const Raster part = read_raster(folder_ / "part.tif");
  EXPECT_NEAR(part.info.georeference.origin_x, place.origin_x + 100 * place.spacing_x, 1e-9 * std::abs(place.origin_x));
  for (std::int64_t row = 0; row < 30; ++row) {
    for (std::int64_t column = 0; column < 50; ++column) {
      // The place of a sample is computed from another first one: the last bits may differ.
      ASSERT_NEAR(part.at(column, row), whole.at(100 + column, 30 + row), 1e-3);
    }
  }
}

TEST_F(ExportCommand, SpreadsElevationsOverTheRangeAskedFor) {
  const json measured = exported({folder_ / "a.png", "--method", "hex"});
  const Raster codes = read_codes(folder_ / "a.png");
  const auto [low, high] = std::minmax_element(codes.elevations.begin(), codes.elevations.end());
  EXPECT_EQ(*low, 0.0);
  EXPECT_EQ(*high, 65535.0);
  const json unreal =
      exported({folder_ / "c.r16", "--raw-scale", "0.0078125", "--raw-offset", "-256", "--clamp-range"});
  EXPECT_EQ(unreal.at("z_scale"), 0.0078125);
  EXPECT_GT(unreal.at("clamped"), 0);
  // Of a scale that is too small: the number that would be stored, and what a scale must hold.
  const std::string too_small = refused({folder_ / "d.r16", "--raw-scale", "0.0078125", "--raw-offset", "-256"});
  EXPECT_THAT(too_small, HasSubstr(" (elevation 265."));
  EXPECT_THAT(too_small,
              HasSubstr("), which uint16 does not hold; use --raw-scale 0.0262 --raw-offset -858.5216, --clamp-range, "
                        "--method barycentric or another --type (elevations are -1 to 855)"));
  // That holds all, with the sea where it was.
  EXPECT_EQ(exported({folder_ / "d.r16", "--raw-scale", "0.0262", "--raw-offset", "-858.5216"}).at("clamped"), 0);
  std::filesystem::remove(folder_ / "d.r16");
  EXPECT_THAT(refused({folder_ / "d.raw", "--type", "f32"}),
              HasSubstr(".r16 and .raw store one channel of uint16, not 1 of float32; .r32 does"));
  EXPECT_EQ(exported({folder_ / "u.exr", "--type", "u32", "--clamp-range"}).at("sample_type"), "uint32");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "d.r16"));
}

TEST_F(ExportCommand, RefusesTilesThatDoNotComeOutWhole) {
  const std::string out = folder_ / "t.tif";
  EXPECT_THAT(refused({out, "--size", "1000x1000", "--tile-size", "129", "--overlap", "1"}),
              HasSubstr("1000 columns do not make 8 whole tiles of 129 that share 1; 1025 do"));
  EXPECT_THAT(refused({out, "--tile-size", "4", "--overlap", "3"}), HasSubstr("at least twice the overlap"));
  EXPECT_THAT(refused({out, "--overlap", "1"}), HasSubstr("--overlap requires --tile-size"));
  EXPECT_THAT(refused({out, "--bbox", "1,2,1,3"}), HasSubstr("must be WEST,SOUTH,EAST,NORTH"));
}

TEST_F(ExportCommand, LeavesNothingWhereTheDiskIsFullOrAFileIsThere) {
  const std::string out = folder_ / "full";
  std::filesystem::create_directory(out);
  RunOptions full;
  full.file_size_limit_bytes = 20000;
  const RunResult result =
      run_isohf({"export", folder_ / "coast.isohf", out + "/t.r16", "--size", "256x256", "--tile-size", "128"}, full);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("t_x0_y0.r16: cannot write"));
  EXPECT_TRUE(std::filesystem::is_empty(out));
  std::ofstream(out + "/t_x1_y1.r16") << "mine";
  EXPECT_THAT(refused({out + "/t.r16", "--size", "256x256", "--tile-size", "128"}),
              HasSubstr("t_x1_y1.r16: exists; --overwrite replaces it"));
  (void)exported({out + "/t.r16", "--size", "256x256", "--tile-size", "128", "--overwrite"});
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out), {}), 8);
}

TEST_F(ExportCommand, KeepsOldTilesWhereALaterOneFails) {
  const std::vector<std::string> cut = {"--size", "452x78", "--tile-size", "5x40", "--overlap", "2"};
  std::vector<std::string> again = {folder_ / "t.npy", "--overwrite"};
  again.insert(again.end(), cut.begin(), cut.end());
  (void)exported(again);
  std::filesystem::remove(folder_ / "t_x1_y0.npy");
  std::filesystem::create_directory(folder_ / "t_x140_y0.npy.part");  // of the third group of columns
  const std::vector<std::string> names = folder_.names();
  std::map<std::string, std::string> before;
  for (const std::string& name : names) {
    if (name.ends_with(".npy")) before[name] = read_file(folder_ / name);
  }
  again.insert(again.end(), {"--raw-scale", "2"});
  EXPECT_THAT(refused(again, 1), HasSubstr("t_x140_y0.npy"));
  EXPECT_EQ(folder_.names(), names);
  for (const auto& [name, bytes] : before) EXPECT_TRUE(read_file(folder_ / name) == bytes) << name;
}

TEST_F(ExportCommand, RefusesASampleTypeBeforeItWarnsOfAnything) {
  const RunResult result = run_isohf({"export", folder_ / "coast.isohf", folder_ / "t.exr", "--type", "u16"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, testing::StartsWith("isohf export: " + folder_ / "t.exr" + ": "));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(ExportCommand, RefusesWhatNoDiskHasRoomForBeforeAnyWork) {
  // The second would look for the range of elevations first.
  for (const char* name : {"huge.npy", "huge.r16"}) {
    EXPECT_THAT(refused({folder_ / name, "--size", "100000000x100000000"}, 1),
                HasSubstr("PB, which the output takes; ask for fewer samples"));
  }
  EXPECT_THAT(refused({folder_ / "huge.r16", "--size", "600000000x600000000", "--tile-size", "10000"}, 1),
              HasSubstr("which the output takes"));
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"coast.isohf"});
}

TEST(ExportWithoutAPlace, PutsTilesAndGridsBesideEachOther) {
  const TemporaryFolder folder;
  const std::string peaks = ISOHF_SOURCE_DIR "/testdata/peaks_256x256_uint16.png";
  const auto done = [](std::vector<std::string> arguments) {
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, false);
  };
  (void)done({"convert", peaks, folder / "whole.isohf", "--sample-spacing", "2", "--json"});
  for (const std::string ending : {".asc", ".flt", ".r16", ".tif", ".png"}) {
    SCOPED_TRACE(ending);
    (void)done({"export", folder / "whole.isohf", folder / ("whole" + ending), "--json"});
    if (ending == ".asc" || ending == ".flt") continue;  // which always have a place
    EXPECT_FALSE(read_raster(folder / ("whole" + ending)).info.georeference.has_origin);
  }
  (void)done(
      {"export", folder / "whole.isohf", folder / "tile.asc", "--size", "100x100", "--tile-size", "50", "--json"});
  EXPECT_NEAR(read_raster(folder / "tile_x0_y0.asc").info.georeference.origin_x,
              read_raster(folder / "whole.asc").info.georeference.origin_x, 2.0);
}

TEST(ExportVoids, AreToldWhereAFileOfNumbersAloneHoldsThem) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_isohf({"convert", kVoids, folder / "a.isohf", "-q"}).exit_code, 0);
  const RunResult written = run_isohf({"export", folder / "a.isohf", folder / "a.r16", "--method", "hex"});
  EXPECT_EQ(written.exit_code, 0) << written.err;
  EXPECT_NE(written.err.find("nodata samples are written as 65535"), std::string::npos) << written.err;
}

}  // namespace
}  // namespace isohf::test
