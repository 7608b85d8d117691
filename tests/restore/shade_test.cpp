#include "isohf/shade.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/light/light.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Level ground with a wall from North to South at column 60 and a hole North-East of it.
class ShadeTest : public testing::Test {
 protected:
  ShadeTest() {
    test::MemorySource<float> source(SampleType::kFloat32, 120, 90, [](std::int64_t c, std::int64_t r) {
      if (c > 90 && c < 100 && r > 10 && r < 20) return std::nan("");
      return c >= 58 && c < 62 ? 30.0 : 0.0;
    });
    ConvertOptions options;
    options.plan.shape = {20, 19};
    options.plan.levels = 1;
    (void)convert(source, folder / "a.isohf", options);
  }

  static int brightness(const Picture& picture, int column, int row) {
    const std::uint8_t* const pixel = picture.pixel(column, row);
    return pixel[0] + pixel[1] + pixel[2];
  }

  test::TemporaryFolder folder;
};

TEST_F(ShadeTest, CastsTheShadowAwayFromTheSun) {
  const ArchiveReader archive(folder / "a.isohf");
  ShadeOptions options;
  options.size = GridSize{120, 90};
  options.sun_elevation_deg = 45.0;  // the shadow is as long as the wall is high
  const Picture west = shade(archive, options);
  EXPECT_LT(brightness(west, 75, 50), brightness(west, 45, 50)) << "the sun stands in the West";
  EXPECT_EQ(brightness(west, 110, 50), brightness(west, 20, 50)) << "beyond the shadow";
  options.sun_azimuth_deg = 90.0;
  const Picture east = shade(archive, options);
  EXPECT_GT(brightness(east, 75, 50), brightness(east, 45, 50));
  options.shadows = false;
  const Picture none = shade(archive, options);
  EXPECT_EQ(brightness(none, 75, 50), brightness(none, 45, 50));
}

TEST(ShadeColours, ColourTheSeaOfTheEarthAloneAlsoWhereNothingLiesDeeper) {
  Metadata metadata(TileGrid::make(TileShape::make(12, 11, 3), 1, 1, 1.0, 1.0));
  const auto is_blue = [&](double elevation) {
    const std::vector<ColourStop> stops = shade_colours(metadata);
    const auto behind = std::upper_bound(stops.begin(), stops.end(), elevation,
                                         [](double at, const ColourStop& stop) { return at < stop.elevation; });
    const ColourStop& stop = behind == stops.begin() ? *behind : *(behind - 1);
    return stop.blue > stop.green;
  };
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    metadata.quantisation.type = type;
    metadata.quantisation.scale = 0.02;
    metadata.source.body = "Earth";
    metadata.statistics.max = 100.0;
    for (const double low : {-40.0, 0.0}) {
      metadata.statistics.min = low;
      EXPECT_TRUE(is_blue(0.0)) << low;
      EXPECT_FALSE(is_blue(0.02)) << low;
    }
    metadata.statistics.min = 1.0;
    EXPECT_FALSE(is_blue(1.0));
    metadata.statistics.min = -40.0;
    metadata.source.body = "";
    EXPECT_FALSE(is_blue(-40.0));
  }
}

TEST(Illumination, HasNoColourWhereThereIsNoAir) {
  Metadata metadata(TileGrid::make(TileShape::make(12, 11, 3), 1, 1, 1.0, 1.0));
  for (const auto& [body, air] :
       {std::pair{"", true}, {"Earth", true}, {"Mars", true}, {"Moon", false}, {"Ceres", false}}) {
    metadata.source.body = body;
    EXPECT_EQ(has_air(metadata), air) << body;
    const Illumination low(90.0, 5.0, has_air(metadata));
    const Light lit = low.on({0.0F, 1.0F, 0.0F}, 1.0F);
    const Light dark = low.on({0.0F, 1.0F, 0.0F}, 0.0F);
    EXPECT_EQ(lit[0] > lit[2], air) << body;
    EXPECT_EQ(dark[0] < dark[2], air) << body;
  }
}

TEST_F(ShadeTest, LeavesNodataTransparent) {
  const ArchiveReader archive(folder / "a.isohf");
  ShadeOptions options;
  options.size = GridSize{120, 90};
  const Picture picture = shade(archive, options);
  EXPECT_EQ(picture.pixel(95, 15)[3], 0);
  EXPECT_EQ(picture.pixel(20, 15)[3], 255);
}

TEST_F(ShadeTest, PixelsDoNotDependOnThreadsOrOnWhetherRowsAreTaken) {
  const ArchiveReader archive(folder / "a.isohf");
  ShadeOptions options;
  Job job;
  job.threads = 1;
  const Picture one = shade(archive, options, job);
  job.threads = 3;
  std::int64_t tiles = 0;
  job.progress = [&](const Progress& at) { tiles = at.done; };
  std::vector<std::uint8_t> rows;
  const ShadeReport report = shade_rows(
      archive, options,
      [&](std::span<const std::byte> some) {
        for (const std::byte value : some) rows.push_back(static_cast<std::uint8_t>(value));
      },
      job);
  EXPECT_EQ(report.size, shade_size(archive));
  EXPECT_EQ(one.width, report.size.first);
  EXPECT_EQ(one.samples, rows);
  EXPECT_EQ(tiles, archive.grid().tile_count());
}

TEST_F(ShadeTest, RefusesWhatIsOutOfRangeAndStopsWhereCancelled) {
  const ArchiveReader archive(folder / "a.isohf");
  const auto code_of = [&](const ShadeOptions& options, const Job& job = {}) {
    return test::error_of([&] { (void)shade(archive, options, job); }).code();
  };
  const auto with = [](auto change) {
    ShadeOptions options;
    change(options);
    return options;
  };
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.size = GridSize{0, 5}; })), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.sun_elevation_deg = 90.0; })), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.sun_elevation_deg = std::nan(""); })), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.exaggeration = 0.0; })), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.softness = -1.0; })), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(with([](ShadeOptions& o) { o.texture = true; })), ErrorCode::kInvalidArgument) << "has none";
  const std::atomic<bool> cancel = true;
  Job job;
  job.cancel = &cancel;
  EXPECT_EQ(code_of({}, job), ErrorCode::kCancelled);
}

TEST(ShadeCancel, StopsAmongThePixelsOfOneTile) {
  const test::TemporaryFolder folder;
  test::MemorySource<float> source(SampleType::kFloat32, 12, 10,
                                   [](std::int64_t c, std::int64_t r) { return static_cast<double>(c + r); });
  (void)convert(source, folder / "tile.isohf");
  const ArchiveReader archive(folder / "tile.isohf");
  ShadeOptions options;
  options.kind = ShadeKind::kHillshade;
  options.size = GridSize{8192, 6144};  // more than are drawn at once
  std::atomic<bool> cancel = false;
  Job job;
  job.cancel = &cancel;
  int taken = 0;
  const auto take = [&](std::span<const std::byte>) {
    ++taken;
    cancel = true;
  };
  EXPECT_EQ(test::error_of([&] { (void)shade_rows(archive, options, take, job); }).code(), ErrorCode::kCancelled);
  EXPECT_EQ(taken, 1);
}

}  // namespace
}  // namespace isohf
