#include "formats/adapters/cropped_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "formats/mosaic/mosaic_pieces.h"
#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

/// A raster that is never read, to be placed.
SourceInfo placed(Registration registration, double x, double y, double spacing, std::int64_t side, bool degrees) {
  SourceInfo info;
  info.path = "a.tif";
  info.width = info.height = side;
  info.georeference = place_at(registration, degrees ? HorizontalUnit::kDegree : HorizontalUnit::kMetre, x, y, spacing);
  return info;
}

std::string window_in(const std::string& box, const SourceInfo& info) {
  try {
    const Window window = samples_in(bounding_box_from_string(box), info);
    return std::to_string(window.column) + "," + std::to_string(window.row) + " " + std::to_string(window.columns) +
           "x" + std::to_string(window.rows);
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(CroppedSource, TakesPostsOnTheEdgeAndAreasWhoseMiddlesAreInside) {
  const SourceInfo posts = placed(Registration::kPoint, 100.0, 200.0, 10.0, 11, false);
  EXPECT_EQ(window_in("110,130,140,180", posts), "1,2 4x6");
  EXPECT_EQ(window_in("110.01,130.01,139.99,179.99", posts), "2,3 2x4");
  // Pixel corners at 100, 110, ...: neighbouring boxes share no pixel.
  const SourceInfo areas = placed(Registration::kArea, 105.0, 195.0, 10.0, 10, false);
  EXPECT_EQ(window_in("100,150,150,200", areas), "0,0 5x5");
  EXPECT_EQ(window_in("150,150,200,200", areas), "5,0 5x5");
  EXPECT_EQ(window_in("114.9,100,136,200", areas), "1,0 3x10");
}

TEST(CroppedSource, LongitudesAreComparedModuloATurn) {
  const SourceInfo pacific = placed(Registration::kPoint, 178.0, 10.0, 0.5, 9, true);  // 178 E to 178 W
  EXPECT_EQ(window_in("179,7,-179,9", pacific), "2,2 5x5");
  EXPECT_EQ(window_in("-180,7,-179,9", pacific), "4,2 3x5");
  EXPECT_EQ(window_in("180,7,181,9", pacific), "4,2 3x5");
}

TEST(CroppedSource, ABoxAcrossTheSeamOfAGlobeIsJoined) {
  for (const bool posts : {false, true}) {
    // 10 degrees apart, from 0 on; posts have 360 again.
    const RasterSpec spec = [&] {
      RasterSpec made;
      made.width = posts ? 37 : 36;
      made.height = 18;
      made.sample_type = SampleType::kInt16;
      made.georeference = place_at(posts ? Registration::kPoint : Registration::kArea, HorizontalUnit::kDegree,
                                   posts ? 0.0 : 5.0, 85.0, 10.0);
      return made;
    }();
    std::vector<std::byte> samples(static_cast<std::size_t>(spec.width * spec.height) * 2);
    const auto value = [](std::int64_t column, std::int64_t row) {
      return static_cast<std::int16_t>(row * 100 + column % 36);
    };
    for (std::int64_t i = 0; i < spec.width * spec.height; ++i) {
      const std::int16_t z = value(i % spec.width, i / spec.width);
      std::memcpy(samples.data() + 2 * i, &z, 2);
    }
    const TemporaryFolder folder;
    write_raster(folder / "globe.tif", spec, samples);
    const auto joined = [&](const std::string& box) {
      return crop(open_raster(folder / "globe.tif", {}), bounding_box_from_string(box));
    };
    const auto source = joined("-60,-30,60,40");
    const SourceInfo& info = source->info();
    EXPECT_TRUE(info.warnings.empty());
    EXPECT_EQ(info.width, posts ? 13 : 12);
    EXPECT_EQ(info.georeference.origin_x, posts ? 300.0 : 305.0);
    for (const Window window : {Window{0, 0, info.width, info.height}, {4, 2, 5, 3}, {0, 1, 2, 2}, {8, 0, 3, 4}}) {
      std::vector<std::int16_t> found(static_cast<std::size_t>(window.columns * window.rows));
      source->read_window(window, std::as_writable_bytes(std::span(found)));
      for (std::int64_t i = 0; i < window.columns * window.rows; ++i) {
        const std::int64_t column = window.column + i % window.columns + 30;
        const std::int64_t row =
            window.row + i / window.columns + std::llround((85.0 - info.georeference.origin_y) / 10.0);
        EXPECT_EQ(found[static_cast<std::size_t>(i)], value(column, row)) << posts << " " << i;
      }
    }
    EXPECT_EQ(joined("-180,-90,180,90")->info().width, 36);
    EXPECT_EQ(joined("170,-90,-170,90")->info().width, posts ? 3 : 2);
    EXPECT_EQ(joined("0,-90,360,90")->info().width, spec.width);
  }
  const SourceInfo gap = placed(Registration::kPoint, 10.0, 80.0, 1.0, 341, true);  // 10 to 350 East
  EXPECT_THAT(window_in("-30,40,30,60", gap), HasSubstr("lies at both of its ends, columns 320 to 340 and 0 to 20"));
}

TEST(CroppedSource, BoxesOutsideOrWrongAreRefused) {
  const SourceInfo posts = placed(Registration::kPoint, 100.0, 200.0, 10.0, 11, false);
  EXPECT_THAT(window_in("300,130,340,180", posts), HasSubstr("a.tif: fewer than 2x2 samples lie in `bbox`"));
  EXPECT_THAT(window_in("300,130,340,180", posts), HasSubstr("its own ground is 100,100,200,200"));
  EXPECT_THAT(window_in("140,130,110,180", posts), HasSubstr("must be less than East"));
  for (const char* text : {"", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1,4,3,2", "1,2,1,4", "1,2,nan,4", "1 2 3 4"}) {
    EXPECT_THAT(window_in(text, posts), HasSubstr("must be WEST,SOUTH,EAST,NORTH")) << text;
  }
  SourceInfo unplaced = posts;
  unplaced.georeference.has_origin = false;
  EXPECT_THAT(window_in("110,130,140,180", unplaced), HasSubstr("does not say where it lies"));
}

TEST(CroppedSource, HasTheSamplesOfItsPartOfFileAndMosaic) {
  const TemporaryFolder folder;
  const CutRaster raster = noise_raster(placed_spec(80, 70, SampleType::kInt16, Registration::kArea));
  raster.cut(folder / "whole.tif", {0, 0, 80, 70});
  const std::vector<std::string> pieces = write_pieces(raster, folder / "", ragged_cut(80, 70, 7, 12));
  const Window part{13, 21, 40, 33};
  const double x = 500000.0 + 13 * 30.0;
  const double y = 5200015.0 - 21 * 30.0;
  const BoundingBox box{x, y - 33 * 30.0, x + 40 * 30.0, y};
  for (const bool joined : {false, true}) {
    std::unique_ptr<HeightSource> source = open_raster(folder / "whole.tif", {});
    if (joined)
      source =
          std::make_unique<MosaicSource>("mosaic", plan_mosaic(pieces, {}, box), OpenOptions{}, OverlapRule::kLast);
    const std::unique_ptr<HeightSource> cropped = crop(std::move(source), box);
    ASSERT_EQ(cropped->info().width, 40);
    ASSERT_EQ(cropped->info().height, 33);
    EXPECT_EQ(cropped->info().warnings, std::vector<Warning>());
    EXPECT_DOUBLE_EQ(cropped->info().georeference.origin_x, x + 15.0);
    EXPECT_DOUBLE_EQ(cropped->info().georeference.origin_y, y - 15.0);
    EXPECT_TRUE(read_whole(*cropped) == raster.part(part));
    for (std::int64_t row = 0; row < 33; row += 5) {
      const std::int64_t rows = std::min<std::int64_t>(5, 33 - row);
      ASSERT_TRUE(read_window(*cropped, {0, row, 40, rows}) == raster.part({13, 21 + row, 40, rows}));
    }
  }
  const BoundingBox beyond{x, y - 33 * 30.0, x + 4000 * 30.0, y};
  const auto cut = crop(open_raster(folder / "whole.tif", {}), beyond);
  EXPECT_EQ(cut->info().width, 67);
  EXPECT_THAT(cut->info().warnings, ::testing::ElementsAre(HasSubstr("67 x 33 samples")));
}

TEST(CroppedSource, HolesElsewhereDoNotMatter) {
  const TemporaryFolder folder;
  const CutRaster raster = noise_raster(placed_spec(60, 20, SampleType::kUint16, Registration::kArea));
  const auto pieces = write_pieces(raster, folder / "", {{0, 0, 20, 20}, {40, 0, 20, 20}});
  const double x = 500000.0;
  const double y = 5200015.0;
  const MosaicPlan west = plan_mosaic(pieces, {}, BoundingBox{x, y - 600.0, x + 600.0, y});
  EXPECT_EQ(west.samples_missing, 0);
  EXPECT_EQ(west.info.sample_type, SampleType::kUint16) << "no void is needed";
  const MosaicPlan middle = plan_mosaic(pieces, {}, BoundingBox{x, y - 600.0, x + 900.0, y});
  EXPECT_EQ(middle.samples_missing, 10 * 20);
}

}  // namespace
}  // namespace isohf::test
