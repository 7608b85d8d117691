/// Many inputs that form one surface: what they give is what the whole gives.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/mosaic/mosaic_pieces.h"
#include "support/altered_archive.h"
#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using Words = std::vector<std::string>;

/// Hills with a lake of voids, in int16.
CutRaster hills(const RasterSpec& like) {
  RasterSpec spec = like;
  spec.void_value = -9999.0;
  return raster_of<std::int16_t>(spec, [](std::int64_t column, std::int64_t row) {
    const auto c = static_cast<double>(column);
    const auto r = static_cast<double>(row);
    if (std::hypot(c - 120.0, r - 60.0) < 13.0) return -9999.0;
    return std::round(900.0 + 300.0 * std::sin(0.07 * c) * std::cos(0.05 * r) + 40.0 * std::sin(0.9 * c + 1.3 * r));
  });
}

class MosaicCommand : public ::testing::Test {
 protected:
  /// Converts and returns the archive's bytes.
  std::string convert(const Words& inputs, const Words& options) {
    Words command = {"convert", "-o", folder / "out.isohf", "--overwrite", "--quiet"};
    command.insert(command.end(), options.begin(), options.end());
    command.insert(command.end(), inputs.begin(), inputs.end());
    const RunResult result = run_isohf(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return read_file(folder / "out.isohf");
  }

  /// Converts, and returns all members that hold elevations: what the archive calls its source is left out.
  std::string members(const Words& inputs, const Words& options) {
    (void)convert(inputs, options);
    const AlteredArchive archive(folder / "out.isohf");
    std::string all;
    for (const std::string& name : archive.names()) {
      if (name.find('/') == std::string::npos) continue;
      const std::vector<std::byte> bytes = archive.bytes(name);
      all += name + "\n";
      all.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }
    EXPECT_GT(all.size(), 1000U);
    return all;
  }

  json metadata() const { return json::parse(run_isohf({"info", folder / "out.isohf", "--json"}).out).at("metadata"); }

  /// A folder inside the folder, with "/" behind it.
  std::string subfolder(const std::string& name) const {
    std::filesystem::create_directories(folder / name);
    return folder / (name + "/");
  }

  void expect_error(const Words& command, int exit_code, const std::string& text) const {
    const RunResult result = run_isohf(command);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr(text));
    EXPECT_THAT(result.err, StartsWith("isohf convert: "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }

  TemporaryFolder folder;
};

TEST_F(MosaicCommand, PiecesGiveTheWholesMembersByteForByteWithEveryFilter) {
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    SCOPED_TRACE(to_string(registration));
    const CutRaster raster = hills(placed_spec(190, 140, SampleType::kInt16, registration));
    const std::string whole = folder / (to_string(registration) + ".tif");
    raster.cut(whole, {0, 0, 190, 140});
    const std::string pieces = subfolder(to_string(registration));
    write_pieces(raster, pieces, ragged_cut(190, 140, 21, 17));
    for (const char* filter : {"nearest", "bilinear", "limited-cubic", "bspline3"}) {
      const Words options = {"--shape", "52x67", "--filter", filter};
      EXPECT_TRUE(members({whole}, options) == members({pieces}, options)) << filter;
    }
  }
}

TEST_F(MosaicCommand, SeedsResidualsAndFloatsOfPiecesAreThoseOfTheWholeInAnyOrder) {
  const CutRaster raster = hills(placed_spec(190, 140, SampleType::kInt16, Registration::kPoint));
  raster.cut(folder / "whole.tif", {0, 0, 190, 140});
  const std::string one = subfolder("ragged");
  Words pieces = write_pieces(raster, one, ragged_cut(190, 140, 3, 9));
  Words reversed(pieces.rbegin(), pieces.rend());
  const std::string two = subfolder("posts");
  write_pieces(raster, two, regular_cut(190, 140, 60, 1));  // neighbours share a row and a column of posts
  for (const Words& more : {Words{"--shadow-seeds"}, Words{"--lossless", "--filter", "bspline3"},
                            Words{"--type", "f32", "--acquisition", "box", "--filter", "bspline3"},
                            Words{"--density", "0.7", "--fit", "-j", "1"}}) {
    SCOPED_TRACE(more.front());
    Words options = {"--shape", "52x67"};
    options.insert(options.end(), more.begin(), more.end());
    const std::string whole = members({folder / "whole.tif"}, options);
    EXPECT_TRUE(whole == members(pieces, options));
    EXPECT_TRUE(whole == members(reversed, options));
    EXPECT_TRUE(whole == members({two + "*.tif"}, options));
  }
}

TEST_F(MosaicCommand, TheArchiveSaysWhatItWasJoinedFrom) {
  const CutRaster raster = hills(placed_spec(190, 140, SampleType::kInt16, Registration::kArea));
  raster.cut(folder / "whole.tif", {0, 0, 190, 140});
  convert({folder / "whole.tif"}, {});
  const json whole = metadata();
  EXPECT_FALSE(whole.at("source").contains("mosaic"));
  const Words pieces = write_pieces(raster, subfolder("tiles"), regular_cut(190, 140, 50));
  const std::string bytes = convert(pieces, {});
  EXPECT_TRUE(bytes == convert(Words(pieces.rbegin(), pieces.rend()), {}))
      << "the order tells nothing without overlaps";
  const json joined = metadata();
  EXPECT_EQ(joined.at("content_sha256"), whole.at("content_sha256"));
  const json& record = joined.at("source").at("mosaic");
  EXPECT_EQ(record.at("files"), 12);
  EXPECT_EQ(record.at("names").size(), 8U);
  EXPECT_EQ(record.at("names")[0], "piece0.tif");
  EXPECT_EQ(record.at("overlap"), "last");
  EXPECT_EQ(joined.at("source").at("name"), "mosaic of 12 files");
  EXPECT_THAT(run_isohf({"info", folder / "out.isohf", "-v"}).out,
              HasSubstr("joined from  12 files, the last on top: piece0.tif, piece1.tif,"));
  const RunResult verified = run_isohf({"verify", folder / "out.isohf", "--against", folder / "tiles"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_EQ(verified.err, "");
}

TEST_F(MosaicCommand, DegreeTilesWithSharedPostsGiveTheSurfaceOfTheWhole) {
  CutRaster raster = hills(placed_spec(241, 121, SampleType::kInt16, Registration::kPoint, true));
  raster.spec.georeference->spacing_x = raster.spec.georeference->spacing_y = 1.0 / 60.0;
  raster.spec.georeference->origin_x = 178.0;
  raster.spec.void_value = -32768.0;
  for (std::size_t i = 0; i < raster.samples.size(); i += 2) {
    std::int16_t value = 0;
    std::memcpy(&value, raster.samples.data() + i, 2);
    if (value == -9999) value = -32768;
    std::memcpy(raster.samples.data() + i, &value, 2);
  }
  raster.cut(folder / "whole.tif", {0, 0, 241, 121});
  const std::string tiles = subfolder("tiles");
  const char* const columns[] = {"E178", "E179", "W180", "W179"};
  for (int i = 0; i < 8; ++i) {
    std::vector<std::byte> posts = raster.part({i % 4 * 60, i / 4 * 60, 61, 61});
    for (std::size_t at = 0; at < posts.size(); at += 2) std::swap(posts[at], posts[at + 1]);
    write_file(tiles + "N4" + (i < 4 ? "5" : "4") + columns[i % 4] + ".hgt",
               {reinterpret_cast<const char*>(posts.data()), posts.size()});
  }
  convert({folder / "whole.tif"}, {"--shape", "52x67"});
  const json whole = metadata();
  convert({tiles}, {"--shape", "52x67"});
  EXPECT_EQ(metadata().at("content_sha256"), whole.at("content_sha256"));
}

TEST_F(MosaicCommand, MissingTilesAreReportedAndCanBeAnError) {
  const CutRaster raster = hills(placed_spec(200, 150, SampleType::kInt16, Registration::kArea));
  const std::string tiles = subfolder("tiles");
  write_pieces(raster, tiles, regular_cut(200, 150, 50));
  std::filesystem::remove(tiles + "piece5.tif");
  std::filesystem::remove(tiles + "piece6.tif");
  const RunResult result = run_isohf({"convert", tiles, folder / "a.isohf"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("5000 samples lie in no file, the first at x 501500...504500, y "));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  expect_error({"convert", tiles, folder / "b.isohf", "--strict"}, 1,
               "5000 samples lie in no file, the first at x 501500...504500, y 5197015...5198515");
  EXPECT_FALSE(std::filesystem::exists(folder / "b.isohf"));
}

TEST_F(MosaicCommand, InputsAreFilesFoldersPatternsAndLists) {
  const CutRaster raster = hills(placed_spec(100, 100, SampleType::kInt16, Registration::kArea));
  const std::string tiles = subfolder("tiles");
  const std::string deep = subfolder("tiles/deep");
  write_pieces(raster, tiles, {{0, 0, 50, 50}, {50, 0, 50, 50}, {0, 50, 50, 50}});
  raster.cut(deep + "last.tif", {50, 50, 50, 50});
  write_file(tiles + "notes.txt", "not a raster");
  write_file(tiles + "piece0.tif.aux.xml", "<PAMDataset/>");
  write_file(folder / "list.txt",
             "\xEF\xBB\xBF# tiles\r\n\r\n  tiles/piece0.tif\r\ntiles/piece[12].tif \r\n" + deep + "\n");
  const std::string all = members({tiles, "--recursive"}, {});
  EXPECT_EQ(metadata().at("source").at("width"), 100);
  EXPECT_TRUE(all == members({tiles + "*.tif", deep + "last.tif"}, {}));
  EXPECT_TRUE(all == members({"@" + (folder / "list.txt")}, {}));
  const RunResult plan = run_isohf({"plan", tiles, deep});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("mosaic of 4 files: GeoTIFF, 100 x 100 int16"));
  // One file, by whatever name, is no mosaic.
  EXPECT_TRUE(convert({deep}, {}) == convert({deep + "last.tif"}, {}));
  EXPECT_EQ(metadata().at("source").at("name"), "last.tif");
}

TEST_F(MosaicCommand, WhatIsNotThereOrTwiceThereIsNamed) {
  const CutRaster raster = hills(placed_spec(100, 50, SampleType::kInt16, Registration::kArea));
  write_pieces(raster, folder / "", {{0, 0, 50, 50}, {50, 0, 50, 50}});
  const std::string empty = subfolder("empty");
  const std::string a = folder / "piece0.tif";
  const std::string b = folder / "piece1.tif";
  const std::string out = folder / "out.isohf";
  write_file(folder / "blank.txt", "# nothing\n\n");
  write_file(folder / "list.txt", "piece0.tif\n\nnone.tif\n");
  expect_error({"convert", a, folder / "none.tif", out}, 1, "none.tif: no such file");
  expect_error({"convert", folder / "x*.tif", out}, 1, "x*.tif: no file matches");
  expect_error({"convert", empty, out}, 1, "contains no raster that isohf reads; --recursive");
  expect_error({"convert", "@" + (folder / "none.txt"), out}, 1, "none.txt: no such list of inputs");
  expect_error({"convert", "@" + (folder / "blank.txt"), out}, 1, "blank.txt: names no input");
  expect_error({"convert", "@" + (folder / "list.txt"), out}, 1, "list.txt: line 3: ");
  expect_error({"convert", a, b, a, out}, 2, "piece0.tif: is named twice among the inputs");
  expect_error({"convert", a, folder.path() + "/piece?.tif", "-o", b, "--overwrite"}, 2,
               "piece1.tif: exists and is a raster (TIFF)");
  expect_error({"convert", a, b, "--overwrite", "-o", b}, 2, "piece1.tif: the output is one of the inputs");
  // A forgotten output.
  raster.cut(folder / "piece2.tif", {0, 0, 50, 50});
  expect_error({"convert", a, b, folder / "piece2.tif", "--overwrite"}, 2,
               "piece2.tif is an input; name an archive NAME.isohf last, or give -o");
  EXPECT_EQ(folder.names(), (Words{"blank.txt", "empty", "list.txt", "piece0.tif", "piece1.tif", "piece2.tif"}));
}

TEST_F(MosaicCommand, FourHundredFilesGoThroughFewHandles) {
  const CutRaster raster = hills(placed_spec(200, 200, SampleType::kInt16, Registration::kPoint));
  raster.cut(folder / "whole.tif", {0, 0, 200, 200});
  const std::string tiles = subfolder("tiles");
  int number = 0;
  for (const Window& window : regular_cut(200, 200, 10)) {
    // Written by hand: hundreds of files that each reach the disk take long.
    const std::string path = tiles + "t" + std::to_string(1000 + number++);
    const RasterSpec spec = raster.spec_of(window);
    write_int16_tiff(path + ".tif", 10, 10, [&](std::int64_t c, std::int64_t r) {
      std::int16_t value = 0;
      std::memcpy(&value, raster.part({window.column + c, window.row + r, 1, 1}).data(), 2);
      return value;
    });
    write_file(path + ".tfw", "30\n0\n0\n-30\n" + std::to_string(spec.georeference->origin_x) + "\n" +
                                  std::to_string(spec.georeference->origin_y) + "\n");
  }
  ASSERT_EQ(number, 400);
  RunOptions few;
  few.open_files = 40;
  const Words command = {"--nodata", "-9999", "--registration", "point", "--json", "--quiet"};
  const auto run = [&](const std::string& input, const RunOptions& limits) {
    const RunResult result =
        run_isohf(with_more({"convert", input, folder / "out.isohf", "--overwrite"}, command), limits);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? json::parse(result.out) : json();
  };
  const json whole = run(folder / "whole.tif", {});
  const json joined = run(tiles, few);
  EXPECT_EQ(joined.at("files"), 400);
  EXPECT_EQ(joined.at("metadata").at("content_sha256"), whole.at("metadata").at("content_sha256"));
}

TEST_F(MosaicCommand, ResumeRefusesOtherMembers) {
  for (int i = 0; i < 2; ++i) {
    const std::string name = std::string(i == 0 ? "a" : "b");
    write_sparse_tiff(folder / (name + ".tif"), 5000, kSanitized ? 4000 : 16000);
    write_file(folder / (name + ".tfw"), "1\n0\n0\n-1\n" + std::to_string(i * 5000) + "\n0\n");
  }
  const Words command = {
      isohf_path(), "convert", folder / "a.tif", folder / "b.tif", folder / "out.isohf", "--z-range", "0:100",
      "--progress", "json"};
  RunningProgram program(command);
  ASSERT_TRUE(program.wait_for_error_text("\"progress\":\"tiles\""));
  program.send(SIGINT);
  ASSERT_EQ(program.wait().exit_code, 130);
  const auto before = std::filesystem::last_write_time(folder / "b.tif");
  Words resume = command;
  resume.emplace_back("--resume");
  Words other = resume;
  other.insert(other.end(), {"--on-top", "first"});
  std::filesystem::last_write_time(folder / "b.tif", before + std::chrono::seconds(1));
  const RunResult changed = run_program(resume);
  EXPECT_NE(changed.exit_code, 0);
  EXPECT_THAT(changed.err, HasSubstr("out.isohf.part"));
  std::filesystem::last_write_time(folder / "b.tif", before);
  EXPECT_NE(run_program(other).exit_code, 0);
  const RunResult same = run_program(resume);
  EXPECT_EQ(same.exit_code, 0) << same.err;
}

}  // namespace
}  // namespace isohf::test
