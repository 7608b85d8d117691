/// Folders of a web map's tiles: which rows they are, and that they join. PMTiles are tests/cli/gdal/tiles.py.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "formats/mosaic/mosaic_pieces.h"
#include "formats/webtiles/tile_scheme.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/in_folder.h"
#include "support/rasters/raster.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

class TileFolder : public InFolder {
 protected:
  /// A level tile of 8 x 8 pixels.
  std::string write_tile(const std::string& name, const std::vector<int>& pixel) const {
    const auto channels = static_cast<int>(pixel.size());
    RasterSpec spec = raster_spec(8, 8, SampleType::kUint8, channels);
    spec.overwrite = true;
    std::vector<std::byte> samples;
    for (int i = 0; i < 64 * channels; ++i)
      samples.push_back(static_cast<std::byte>(pixel[static_cast<std::size_t>(i % channels)]));
    const std::string path = folder / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    write_raster(path, spec, samples);
    return path;
  }
  [[nodiscard]] std::unique_ptr<MosaicSource> open_tiles(const std::vector<std::string>& paths) const {
    OpenOptions options;
    options.encoding = "terrarium";
    return open_mosaic(paths, OverlapRule::kLast, options);
  }
};

TEST_F(TileFolder, CountsRowsAsItsFilesState) {
  const std::string xml = R"(<TileMap version="1.0.0"><SRS>{}</SRS><Origin x="-20037508.34" y="{}"/>)"
                          R"(<TileSets profile="{}"></TileSets></TileMap>)";
  const auto tms = [&](const char* system, const char* y, const char* profile) {
    return fmt::format(fmt::runtime(xml), system, y, profile);
  };
  struct Case {
    std::vector<std::pair<std::string, std::string>> files;
    TileScheme scheme;
  };
  for (const Case& one : {
           Case{{}, TileScheme::kFromNorth},
           Case{{{"tilemapresource.xml", tms("EPSG:3857", "-20037508.34", "mercator")}}, TileScheme::kFromSouth},
           Case{{{"tilemapresource.xml", tms("EPSG:900913", "-20037508.34", "")}}, TileScheme::kFromSouth},
           Case{{{"tilemapresource.xml", tms("EPSG:3857", "20037508.34", "global-mercator")}}, TileScheme::kFromNorth},
           Case{{{"tilemapresource.xml", tms("EPSG:4326", "-90", "geodetic")}}, TileScheme::kOtherMap},
           Case{{{"metadata.json", R"({"scheme": "tms"})"}}, TileScheme::kFromSouth},
           Case{{{"metadata.json", R"({"name": "x"})"}, {"tiles.json", R"({"scheme": "tms"})"}},
                TileScheme::kFromSouth},
           Case{{{"tiles.json", R"({"scheme": "xyz"})"}}, TileScheme::kFromNorth},
           Case{{{"metadata.json", "no JSON"}}, TileScheme::kFromNorth},
       }) {
    const TemporaryFolder own;
    for (const auto& [name, text] : one.files) write_file(own / name, text);
    EXPECT_EQ(tile_scheme_of(own.path()), one.scheme) << (one.files.empty() ? "" : one.files[0].second);
  }
  write_file(folder / "tilemapresource.xml", tms("EPSG:3857", "-20037508.34", "mercator"));
  write_file(folder / "tiles.json", R"({"scheme": "xyz"})");
  const Error error = error_of([&] { (void)tile_scheme_of(folder.path()); });
  EXPECT_THAT(error.what(), HasSubstr("tilemapresource.xml and " + (folder / "tiles.json") + " contradict each other"));
}

TEST_F(TileFolder, TilesFromTheSouthLieWhereTheyBelong) {
  const std::vector<std::string> paths = {write_tile("9/266/331.png", {128, 100, 0}),
                                          write_tile("9/266/330.png", {128, 50, 0})};
  const auto first_of = [&](double north, double height) {
    const auto mosaic = open_tiles(paths);
    const SourceInfo& info = mosaic->info();
    EXPECT_EQ(info.width, 8);
    EXPECT_EQ(info.height, 16);
    EXPECT_EQ(info.georeference.system.epsg, 3857);
    EXPECT_NEAR(info.georeference.origin_y + info.georeference.spacing_y / 2.0, north, 0.001);
    EXPECT_EQ(values_of(*mosaic)[0] * info.z_scale + info.z_offset, height);
  };
  first_of(-5792092.2556, 50.0);
  write_file(folder / "metadata.json", R"({"scheme": "tms"})");
  first_of(5948635.2893, 100.0);
}

TEST_F(TileFolder, ATileThatWasStoredAsGreyIsOneOfThem) {
  const auto mosaic = open_tiles({write_tile("9/266/180.png", {128, 100, 0}), write_tile("9/266/181.png", {128})});
  const std::vector<double> found = values_of(*mosaic);
  const SourceInfo& info = mosaic->info();
  EXPECT_EQ(found.front() * info.z_scale + info.z_offset, 100.0);
  EXPECT_EQ(found.back() * info.z_scale + info.z_offset, 128.5);
}

}  // namespace
}  // namespace isohf::test
