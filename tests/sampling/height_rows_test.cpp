#include "isohf/sampling/source/height_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "isohf/error.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/trigonometric_field.h"

namespace isohf {
namespace {

/// Noise with voids.
test::MemorySource<float> noise(std::int64_t width, std::int64_t height, double void_share) {
  std::mt19937_64 random(17);
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  return {SampleType::kFloat32, width, height, [&](auto, auto) {
            const double height_m = 1000.0 * uniform();
            return uniform() < void_share ? std::nan("") : height_m;
          }};
}

/// Blocks of a 310 x 130 raster, as formats have them.
struct Blocks {
  std::int64_t width;
  std::int64_t height;
};

TEST(HeightRows, WindowsHoldTheBitsOfTheWholeHoweverTheyAreKept) {
  for (const double void_share : {0.0, 0.02, 0.5, 0.9}) {
    for (const auto& [filter, acquisition] :
         {std::pair{Filter::kBilinear, "point"}, std::pair{Filter::kBspline3, "point"},
          std::pair{Filter::kBspline3, "box"}, std::pair{Filter::kLimitedCubic, "gaussian:0.5"}}) {
      auto source = noise(310, 130, void_share);
      std::vector<float> whole = source.samples();
      const Prefilter prefilter = Prefilter::make(filter, acquisition_from_string(acquisition));
      prefilter.filter({whole.data(), 310, 130});
      for (const Blocks& blocks : {Blocks{310, 1}, Blocks{310, 7}, Blocks{32, 16}}) {
        source.mutable_info().block_width = blocks.width;
        source.mutable_info().block_height = blocks.height;
        for (const std::uint64_t most_bytes :
             {0U, 20000U, 1000000U}) {  // none: all that is not in use goes to the file
          CellStore store = most_bytes > 500000U ? CellStore::of_rows(source.info(), 5000)
                                                 : CellStore::of_windows(source.info(), most_bytes, testing::TempDir());
          if (store.most_bytes < UINT64_MAX) store.cell_columns = std::min<std::int64_t>(store.cell_columns, 48);
          if (store.step.columns < 310) store.step.columns = store.cell_columns;
          HeightRows rows(source, 0.0, false, store);
          for (const Window& window : {Window{0, 0, 310, 41}, Window{18, 38, 133, 23}, Window{150, 60, 4, 70},
                                       Window{150, 60, 160, 70}, Window{0, 0, 20, 130}}) {
            Band band;
            (void)rows.read(window, prefilter, band);
            const SourceBand view = band.view();
            for (std::int64_t r = 0; r < window.rows; ++r) {
              const float* const expected = whole.data() + (window.row + r) * 310 + window.column;
              const auto bytes = static_cast<std::size_t>(window.columns) * sizeof(float);
              ASSERT_EQ(std::memcmp(view.heights.row(r), expected, bytes), 0)
                  << to_string(filter) << " voids " << void_share << " row " << r << " column " << window.column;
              for (std::int64_t c = 0; c < window.columns; ++c) {
                const bool is_void =
                    view.voids.data() != nullptr ? view.voids(c, r) != 0 : std::isnan(view.heights(c, r));
                ASSERT_EQ(is_void, std::isnan(source.at(window.column + c, window.row + r))) << c << " " << r;
              }
            }
          }
        }
      }
    }
  }
}

TEST(HeightRows, AWindowAcrossTheSeamOfAGlobeHoldsTheBitsOfTheWhole) {
  auto source = noise(120, 50, 0.05);
  const Prefilter prefilter = Prefilter::make(Filter::kBspline3, {});
  std::vector<float> whole = source.samples();
  prefilter.filter_rows({whole.data(), 120, 50}, true);
  std::vector<float> expected(whole.size());
  prefilter.filter_columns({whole.data(), 120, 50}, 0, {expected.data(), 120, 50});
  HeightRows rows(source, 0.0, true, CellStore::of_rows(source.info(), 5000));
  for (const Window& window : {Window{0, 5, 10, 20}, Window{50, 0, 20, 50}, Window{100, 30, 20, 20}}) {
    Band band;
    ASSERT_TRUE(rows.read(window, prefilter, band));
    for (std::int64_t r = 0; r < window.rows; ++r) {
      ASSERT_EQ(std::memcmp(band.view().heights.row(r), expected.data() + (window.row + r) * 120 + window.column,
                            static_cast<std::size_t>(window.columns) * sizeof(float)),
                0)
          << r;
    }
  }
}

/// Counts how often each sample is read, and knows of a gap.
class Counted final : public HeightSource {
 public:
  Counted(std::int64_t block_width, std::int64_t block_height) {
    info_.width = 3000;
    info_.height = 200;
    info_.sample_type = SampleType::kUint16;
    info_.block_width = block_width;
    info_.block_height = block_height;
    info_.void_values = {0.0};
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] static std::uint16_t sample(std::int64_t column, std::int64_t row) {
    return static_cast<std::uint16_t>(1 + (column * 31 + row * 1009) % 60000);
  }
  [[nodiscard]] bool is_gap(const Window& window) const override { return window.column >= gap; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    std::byte* out = samples.data();
    for (std::int64_t r = window.row; r < window.row + window.rows; ++r) {
      for (std::int64_t c = window.column; c < window.column + window.columns; ++c, out += 2) {
        const std::uint16_t value = c < gap ? sample(c, r) : std::uint16_t{0};
        std::memcpy(out, &value, 2);
        ++reads[{c, r}];
      }
    }
  }

  std::int64_t gap = 3000;  ///< the first column of the gap
  std::map<std::pair<std::int64_t, std::int64_t>, int> reads;

 private:
  SourceInfo info_;
};

TEST(HeightRows, EachSampleIsReadOnceThoughWindowsGoUpAndDown) {
  const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
  for (const Blocks& blocks : {Blocks{3000, 1}, Blocks{3000, 8}, Blocks{128, 64}}) {
    Counted source(blocks.width, blocks.height);
    HeightRows rows(source, 0.0, false, CellStore::of_windows(source.info(), 60000, testing::TempDir()));
    const HeightRows::Held held = rows.hold({0, 0, 50, 20});
    for (const std::int64_t down : {0, 40}) {
      for (std::int64_t column = 0; column < 2900; column += 100) {  // along an arc
        const auto row = down + static_cast<std::int64_t>(120.0 * std::sin(static_cast<double>(column) / 950.0));
        Band band;
        ASSERT_TRUE(rows.read({column, row, 110, 30}, as_they_are, band));
        for (std::int64_t r = 0; r < 30; ++r) {
          for (std::int64_t c = 0; c < 110; ++c)
            ASSERT_EQ(band.view().heights(c, r), Counted::sample(column + c, row + r)) << column + c << " " << row + r;
        }
      }
    }
    for (const auto& [place, count] : source.reads) ASSERT_EQ(count, 1) << place.first << " " << place.second;
    Band band;  // what is held stays
    ASSERT_TRUE(rows.read({5, 7, 45, 13}, as_they_are, band, &held));
    EXPECT_EQ(band.view().heights(3, 2), Counted::sample(8, 9));
  }
}

TEST(HeightRows, NothingIsReadOfAGapNorOfRowsBefore) {
  const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
  Counted source(128, 64);
  source.gap = 1024;
  CellStore store = CellStore::of_windows(source.info(), 1000000, testing::TempDir());
  store.cell_columns = store.step.columns = 256;
  HeightRows rows(source, 0.0, false, store);
  rows.drop_before(100);
  Band band;
  EXPECT_FALSE(rows.read({1100, 70, 900, 20}, as_they_are, band));
  EXPECT_TRUE(std::isnan(band.view().heights(10, 10)));
  EXPECT_TRUE(source.reads.empty());
  EXPECT_TRUE(rows.read({1000, 150, 100, 20}, as_they_are, band));
  EXPECT_EQ(band.view().heights(23, 10), Counted::sample(1023, 160));
  EXPECT_TRUE(std::isnan(band.view().heights(24, 10)));
  EXPECT_EQ(source.reads.begin()->first.first, 768);
  EXPECT_EQ(std::prev(source.reads.end())->first.first, 1023);
  for (const auto& [place, count] : source.reads) ASSERT_GE(place.second, 128);
}

TEST(HeightRows, AFolderThatIsNotThereIsNamed) {
  Counted source(3000, 1);
  const std::string folder = testing::TempDir() + "/isohf-no-such-folder";
  HeightRows rows(source, 0.0, false, CellStore::of_windows(source.info(), 1000, folder));
  const Error error = test::error_of([&] {
    for (const std::int64_t row : {0, 100}) (void)rows.hold({0, row, 3000, 50});
  });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(error.what()).find(folder + ": cannot make a scratch file"), std::string::npos) << error.what();
}

TEST(HeightRows, TilesCutFromItsWindowsFollowTheRuleForVoids) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 4, 4, 150.0, 150.0);
  for (const char* name : {"bilinear", "limited-cubic", "bspline3"}) {
    const Kernel kernel = Kernel::make(filter_from_string(name));
    for (const double void_share : {0.02, 0.3, 0.8}) {
      auto source = noise(61, 61, void_share);
      std::vector<float> coefficients = source.samples();
      const Prefilter prefilter = Prefilter::make(kernel.filter(), Acquisition{});
      prefilter.filter({coefficients.data(), 61, 61});
      HeightRows rows(source, 0.0, false, CellStore::of_rows(source.info(), 2000));
      const SourceAxis axis(61, 0.0, 10.0, Registration::kPoint, 0.0);
      const auto cutter = make_grid_resampler(grid, {axis, axis}, kernel, {-1e9, 1e9});
      std::vector<float> heights(12 * 11);
      for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
        const TileIndex index = grid.tile_at(tile);
        Band band;
        const auto read = [&](const Window& window) -> std::optional<SourceBand> {
          EXPECT_TRUE(rows.read(window, prefilter, band));
          return band.view();
        };
        ASSERT_TRUE(cutter->cut(index, read, heights));
        for (int r = 0; r < 11; ++r) {
          for (int c = 0; c < 12; ++c) {
            const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex(index, {c, r}));
            const double expected = evaluate(kernel, {coefficients.data(), 61, 61}, {source.samples().data(), 61, 61},
                                             axis.place(world.x).position, axis.place(world.z).position);
            const auto height = static_cast<double>(heights[static_cast<std::size_t>(r * 12 + c)]);
            if (std::isnan(expected)) continue;  // what lies beside samples has a height all the same
            // Roundings of coefficients up to 56 times the range of 1000, and as many weights.
            ASSERT_NEAR(height, expected, 0.02) << name << " " << c << " " << r;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
