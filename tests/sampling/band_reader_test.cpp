#include "isohf/sampling/source/band_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "support/rasters/trigonometric_field.h"

namespace isohf {
namespace {

/// Floats in memory that count how often each row is read.
class MemorySource : public HeightSource {
 public:
  MemorySource(std::int64_t width, std::int64_t height, double void_share) : reads(static_cast<std::size_t>(height)) {
    info_.width = width;
    info_.height = height;
    info_.block_width = width;
    std::mt19937_64 random(17);
    const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
    for (std::int64_t i = 0; i < width * height; ++i) {
      const auto height_m = static_cast<float>(1000.0 * uniform());
      heights.push_back(uniform() < void_share ? std::numeric_limits<float>::quiet_NaN() : height_m);
    }
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    for (std::int64_t r = 0; r < window.rows; ++r) {
      const auto row = static_cast<std::size_t>(window.row + r);
      ++reads[row];
      std::memcpy(samples.data() + static_cast<std::size_t>(r * window.columns) * sizeof(float),
                  heights.data() + row * static_cast<std::size_t>(info_.width) + window.column,
                  static_cast<std::size_t>(window.columns) * sizeof(float));
    }
  }

  std::vector<float> heights;
  std::vector<int> reads;

 private:
  SourceInfo info_;
};

TEST(BandReader, BandsHoldTheBitsOfTheWholeAndReadEachRowOnce) {
  for (const double void_share : {0.0, 0.02, 0.7}) {
    for (const auto& [filter, acquisition] :
         {std::pair{Filter::kBilinear, "point"}, std::pair{Filter::kBspline3, "point"},
          std::pair{Filter::kBspline3, "box"}}) {
      MemorySource source(75, 130, void_share);
      std::vector<float> whole = source.heights;
      const Prefilter prefilter = Prefilter::make(filter, acquisition_from_string(acquisition));
      prefilter.filter({whole.data(), 75, 130});
      BandReader reader(source, 0.0, prefilter);
      for (const RowRange& rows : {RowRange{0, 40}, RowRange{38, 61}, RowRange{60, 100}, RowRange{101, 129}}) {
        const auto band = reader.read(rows);
        const SourceBand view = band->view();
        ASSERT_EQ(view.first_row, rows.first);
        const auto samples = static_cast<std::size_t>((rows.last - rows.first + 1) * 75);
        ASSERT_EQ(band->heights.size(), samples);
        EXPECT_EQ(std::memcmp(band->heights.data(), whole.data() + rows.first * 75, samples * sizeof(float)), 0);
        for (std::int64_t r = rows.first; r <= rows.last; ++r) {
          for (std::int64_t c = 0; c < 75; ++c) {
            const bool is_void = view.voids.data() != nullptr ? view.voids(c, r - rows.first) != 0
                                                              : std::isnan(view.heights(c, r - rows.first));
            ASSERT_EQ(is_void, std::isnan(source.heights[static_cast<std::size_t>(r * 75 + c)])) << c << " " << r;
          }
        }
      }
      for (const int count : source.reads) EXPECT_EQ(count, 1);
    }
  }
}

TEST(BandReader, PartsOfTheColumnsHoldTheBitsOfTheWhole) {
  for (const double void_share : {0.0, 0.02, 0.5, 0.9}) {
    for (const auto& [filter, acquisition] :
         {std::pair{Filter::kBilinear, "point"}, std::pair{Filter::kBspline3, "point"},
          std::pair{Filter::kBspline3, "box"}}) {
      MemorySource source(310, 130, void_share);
      const Prefilter prefilter = Prefilter::make(filter, acquisition_from_string(acquisition));
      BandReader whole(source, 0.0, prefilter);
      SourceRows rows(source, ReadStep::make(source.info(), 5000), testing::TempDir(), 130);
      BandReader in_parts(rows, 0.0, prefilter);
      for (const RowRange& range : {RowRange{0, 40}, RowRange{38, 61}, RowRange{60, 129}}) {
        const auto expected = whole.read(range);
        for (const RowRange& columns : {RowRange{0, 20}, RowRange{18, 150}, RowRange{149, 152}, RowRange{150, 309}}) {
          const auto part = in_parts.read(range, columns);
          const SourceBand view = part->view();
          ASSERT_EQ(view.first_column, columns.first);
          for (std::int64_t r = 0; r <= range.last - range.first; ++r) {
            ASSERT_EQ(std::memcmp(view.heights.row(r), expected->view().heights.row(r) + columns.first,
                                  static_cast<std::size_t>(columns.last - columns.first + 1) * sizeof(float)),
                      0)
                << to_string(filter) << " voids " << void_share << " row " << r << " columns " << columns.first;
            for (std::int64_t c = columns.first; c <= columns.last && !prefilter.is_identity(); ++c) {
              const bool is_void = view.voids.data() != nullptr && view.voids(c - columns.first, r) != 0;
              const float height = source.heights[static_cast<std::size_t>((range.first + r) * 310 + c)];
              ASSERT_EQ(is_void, std::isnan(height)) << c << " " << r;
            }
          }
        }
      }
    }
  }
}

TEST(BandReader, TilesCutFromItsBandsFollowTheRuleForVoids) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 4, 4, 150.0, 150.0);
  for (const char* name : {"bilinear", "limited-cubic", "bspline3"}) {
    const Kernel kernel = Kernel::make(filter_from_string(name));
    for (const double void_share : {0.02, 0.3, 0.8}) {
      MemorySource source(61, 61, void_share);
      std::vector<float> coefficients = source.heights;
      const Prefilter prefilter = Prefilter::make(kernel.filter(), Acquisition{});
      prefilter.filter({coefficients.data(), 61, 61});
      BandReader reader(source, 0.0, prefilter);
      const SourceAxis axis(61, 0.0, 10.0, Registration::kPoint, Outside::kClamp, 0.0);
      const auto cutter = make_grid_resampler(grid, {axis, axis}, kernel, {-1e9, 1e9});
      std::vector<float> heights(12 * 11);
      for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
        const TileIndex index = grid.tile_at(tile);
        const auto band = reader.read(cutter->rows_needed(index.row));
        cutter->cut(index, band->view(), heights);
        for (int r = 0; r < 11; ++r) {
          for (int c = 0; c < 12; ++c) {
            const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex(index, {c, r}));
            const double expected = evaluate(kernel, {coefficients.data(), 61, 61}, {source.heights.data(), 61, 61},
                                             axis.place(world.x).position, axis.place(world.z).position);
            const auto height = static_cast<double>(heights[static_cast<std::size_t>(r * 12 + c)]);
            ASSERT_EQ(std::isnan(height), std::isnan(expected)) << name << " " << c << " " << r;
            // Roundings of coefficients up to 56 times the range of 1000, and as many weights.
            if (!std::isnan(height)) {
              ASSERT_NEAR(height, expected, 0.02) << name << " " << c << " " << r;
            }
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
