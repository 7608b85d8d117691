#include "isohf/sampling/source/band_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

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

TEST(BandReader, BandsHoldTheBitsOfTheWholeAndReadEachRowOnce) {
  std::mt19937_64 random(11);
  for (const double void_share : {0.0, 0.004, 0.02, 0.3, 0.7}) {
    for (const auto& [filter, acquisition] :
         {std::pair{Filter::kBilinear, "point"}, std::pair{Filter::kBspline3, "point"},
          std::pair{Filter::kBspline3, "box"}, std::pair{Filter::kLimitedCubic, "gaussian:0.5"}}) {
      auto source = noise(75, 130, void_share);
      std::vector<float> whole = source.samples();
      const Prefilter prefilter = Prefilter::make(filter, acquisition_from_string(acquisition));
      prefilter.filter({whole.data(), 75, 130});
      BandReader reader(source, 0.0, prefilter);
      for (RowRange rows{0, -1}; rows.last < 129;) {
        rows.first = std::max(rows.first, rows.last + 1 - static_cast<std::int64_t>(random() % 3));
        rows.last = std::min<std::int64_t>(129, rows.last + 1 + static_cast<std::int64_t>(random() % 40));
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
            ASSERT_EQ(is_void, std::isnan(source.at(c, r))) << c << " " << r;
          }
        }
      }
      EXPECT_EQ(source.rows_read, 130);
    }
  }
}

TEST(BandReader, PartsOfTheColumnsHoldTheBitsOfTheWhole) {
  for (const double void_share : {0.0, 0.02, 0.5, 0.9}) {
    for (const auto& [filter, acquisition] :
         {std::pair{Filter::kBilinear, "point"}, std::pair{Filter::kBspline3, "point"},
          std::pair{Filter::kBspline3, "box"}}) {
      auto source = noise(310, 130, void_share);
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
              ASSERT_EQ(is_void, std::isnan(source.at(c, range.first + r))) << c << " " << r;
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
      auto source = noise(61, 61, void_share);
      std::vector<float> coefficients = source.samples();
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
