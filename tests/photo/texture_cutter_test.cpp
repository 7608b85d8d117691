#include "isohf/photo/texture_cutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "isohf/photo/srgb.h"
#include "support/rasters/memory_photo.h"

namespace isohf {
namespace {

using test::MemoryPhoto;
using test::noise;

const TileGrid kGrid = TileGrid::make(TileShape::make(12, 11, 3), 3, 2, 100.0, 80.0);

double light_of(int value) {
  return linear_from_srgb()[static_cast<std::size_t>(value)];
}

TEST(Srgb, EncodesEveryValueBackAndTurnsHalfWay) {
  for (int value = 0; value < 256; ++value) {
    const float light = linear_from_srgb()[static_cast<std::size_t>(value)];
    EXPECT_EQ(srgb_from_linear(light), value);
    if (value == 255) break;
    // IEC 61966-2-1 at the half value, and a little to either side.
    const double half = (value + 0.5) / 255.0;
    const double at = half <= 0.04045 ? half / 12.92 : std::pow((half + 0.055) / 1.055, 2.4);
    EXPECT_EQ(srgb_from_linear(static_cast<float>(at * (1.0 - 1e-5))), value);
    EXPECT_EQ(srgb_from_linear(static_cast<float>(at * (1.0 + 1e-5))), value + 1);
  }
  EXPECT_EQ(srgb_from_linear(-1.0F), 0);
  EXPECT_EQ(srgb_from_linear(2.0F), 255);
  EXPECT_EQ(srgb_from_linear(NAN), 0);
}

TEST(TextureCutter, GivesPixelsBackWhereTexelsLieOnThem) {
  constexpr int kSize = 64;
  // 63 pixels a tile, the first in the corner of the world.
  const MemoryPhoto pixels(3 * 63 + 1, 2 * 63 + 1, 3, noise);
  MemoryPhoto photo(3 * 63 + 1, 2 * 63 + 1, 3, noise);
  const TextureCutter cutter(kGrid, {0.0, 0.0, 100.0 / 63, 80.0 / 63}, {kSize, 4});
  EXPECT_NEAR(cutter.pixels_per_texel_x(), 1.0, 1e-12);
  for (std::int64_t flat = 0; flat < kGrid.tile_count(); ++flat) {
    const TileIndex tile = kGrid.tile_at(flat);
    const std::vector<Picture> levels = cutter.cut(photo, tile);
    ASSERT_EQ(levels.size(), 4U);
    for (int row = 0; row < kSize; ++row) {
      for (int column = 0; column < kSize; ++column) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(levels[0].pixel(column, row)[c], pixels.at(tile.column * 63 + column, tile.row * 63 + row, c));
        }
      }
    }
  }
}

TEST(TextureCutter, KeepsOneColour) {
  MemoryPhoto photo(77, 131, 4, [](auto, auto, int c) { return c == 3 ? 255 : 90 + 80 * c; });
  for (const int size : {64, 256}) {
    const TextureCutter cutter(kGrid, {20.0, -30.0, 1.37, 0.61}, {size, 4});
    for (const Picture& level : cutter.cut(photo, {1, 1})) {
      for (std::size_t i = 0; i < level.samples.size(); ++i) {
        ASSERT_EQ(level.samples[i], i % 4 == 3 ? 255 : 90 + 80 * static_cast<int>(i % 4));
      }
    }
  }
}

TEST(TextureCutter, NeighboursAgreeOnTheirEdgesBitForBit) {
  struct Case {
    int channels;
    int size;
    int levels;
    PhotoFrame frame;
  };
  // Texels much finer, a little finer, and much coarser than pixels; the photo's border inside a tile.
  const Case cases[] = {{1, 64, 5, {3.0, 5.0, 7.1, 6.3}},
                        {3, 128, 5, {0.31, 0.2, 0.6, 0.57}},
                        {4, 64, 4, {10.0, -9.0, 0.21, 0.2}},
                        {3, 64, 1, {1.0, 1.0, 1.0, 1.0}}};
  for (const Case& at : cases) {
    MemoryPhoto photo(430, 390, at.channels, noise);
    const TextureCutter cutter(kGrid, at.frame, {at.size, at.levels});
    std::vector<std::vector<Picture>> tiles;
    for (std::int64_t flat = 0; flat < kGrid.tile_count(); ++flat)
      tiles.push_back(cutter.cut(photo, kGrid.tile_at(flat)));
    const auto levels_of = [&](std::int64_t column, std::int64_t row) -> std::vector<Picture>& {
      return tiles[static_cast<std::size_t>(kGrid.flat_index({column, row}))];
    };
    for (std::int64_t flat = 0; flat < kGrid.tile_count(); ++flat) {
      const TileIndex tile = kGrid.tile_at(flat);
      for (std::size_t l = 0; l < static_cast<std::size_t>(at.levels); ++l) {
        const Picture& here = levels_of(tile.column, tile.row)[l];
        const int last = here.width - 1;
        ASSERT_EQ(here.width, at.size >> l);
        for (int i = 0; i <= last; ++i) {
          for (int c = 0; c < at.channels; ++c) {
            if (tile.column + 1 < kGrid.tile_columns()) {
              ASSERT_EQ(here.pixel(last, i)[c], levels_of(tile.column + 1, tile.row)[l].pixel(0, i)[c]);
            }
            if (tile.row + 1 < kGrid.tile_rows()) {
              ASSERT_EQ(here.pixel(i, last)[c], levels_of(tile.column, tile.row + 1)[l].pixel(i, 0)[c]);
            }
          }
        }
      }
    }
  }
}

/// Integral of the photo's light, interpolated linearly along one axis, over [from, to], by many thin slices.
template <typename Light>
double mean_light(const Light& light, double from, double to) {
  constexpr int kSlices = 400;
  double sum = 0.0;
  for (int i = 0; i < kSlices; ++i) {
    const double at = from + (to - from) * (i + 0.5) / kSlices;
    const double k = std::floor(at);
    sum += light(static_cast<std::int64_t>(k)) * (k + 1.0 - at) + light(static_cast<std::int64_t>(k) + 1) * (at - k);
  }
  return sum / kSlices;
}

TEST(TextureCutter, AveragesThePhotoOverATexelLessOnePixel) {
  // Rows of one colour, so that one axis is enough; then columns.
  for (const bool along_z : {false, true}) {
    MemoryPhoto photo(300, 300, 1, [&](auto column, auto row, int) { return noise(along_z ? row : column, 0, 0); });
    for (const double spacing : {0.27, 0.9, 2.3}) {
      const PhotoFrame frame{4.0, 7.0, spacing, spacing};
      const TextureCutter cutter(kGrid, frame, {64, 4});
      const Picture level = cutter.cut(photo, {1, 0}).front();
      const double extent = along_z ? kGrid.extent_z() : kGrid.extent_x();
      const double first = along_z ? frame.first_pixel_z : frame.first_pixel_x;
      const double corner = along_z ? 0.0 : extent;
      const double step = extent / 63 / spacing;
      const double half = std::max(step - 1.0, 0.0) / 2.0;
      for (int i = 0; i < 64; ++i) {
        const double place = (corner + extent * i / 63 - first) / spacing;
        const double expected =
            mean_light([&](std::int64_t k) { return light_of(along_z ? photo.at(0, k, 0) : photo.at(k, 0, 0)); },
                       place - half, place + half + 1e-9);
        // Half a value for rounding, a little for the slices.
        const double found = light_of(along_z ? *level.pixel(5, i) : *level.pixel(i, 5));
        const int value = along_z ? *level.pixel(5, i) : *level.pixel(i, 5);
        const double tolerance = light_of(std::min(value + 1, 255)) - light_of(std::max(value - 1, 0));
        EXPECT_NEAR(found, expected, tolerance) << i << " spacing " << spacing;
      }
    }
  }
}

TEST(TextureCutter, CoarserLevelsAreMeansOfLight) {
  MemoryPhoto photo(500, 400, 3, noise);
  const TextureCutter cutter(kGrid, {-5.0, -5.0, 0.7, 0.7}, {128, 5});
  const std::vector<Picture> levels = cutter.cut(photo, {1, 0});
  for (std::size_t l = 1; l < levels.size(); ++l) {
    const int block = 1 << l;
    for (int row = 1; row + 1 < levels[l].height; ++row) {
      for (int column = 1; column + 1 < levels[l].width; ++column) {
        for (int c = 0; c < 3; ++c) {
          double sum = 0.0;
          for (int y = 0; y < block; ++y) {
            for (int x = 0; x < block; ++x) sum += light_of(levels[0].pixel(column * block + x, row * block + y)[c]);
          }
          // Level 0 was rounded, independently for every texel.
          ASSERT_NEAR(levels[l].pixel(column, row)[c], srgb_from_linear(static_cast<float>(sum / (block * block))), 1);
        }
      }
    }
  }
}

TEST(TextureCutter, BorderTexelsOfCoarseLevelsLieOnTheEdge) {
  // Light that grows evenly from West to East: a mean around the edge is the edge's own.
  constexpr int kPixels = 256;
  MemoryPhoto photo(3 * kPixels, 2 * kPixels, 1, [](auto column, auto, int) {
    return srgb_from_linear(static_cast<float>(column) / (3 * kPixels));
  });
  const TextureCutter cutter(kGrid, {50.0 / kPixels, 40.0 / kPixels, 100.0 / kPixels, 80.0 / kPixels}, {128, 5});
  const std::vector<Picture> levels = cutter.cut(photo, {1, 1});
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const int last = levels[l].width - 1;
    // 8-bit values of the photo are rounded by up to half a value, of the result once more.
    EXPECT_NEAR(*levels[l].pixel(0, 3), srgb_from_linear(1.0F / 3), 1) << l;
    EXPECT_NEAR(*levels[l].pixel(last, 3), srgb_from_linear(2.0F / 3), 1) << l;
    // Inner texels where a GPU's mip level has them: s = (2^l (i + 1/2) - 1/2) / (S - 1).
    for (int i = 1; i < last; ++i) {
      const double s = (std::ldexp(i + 0.5, static_cast<int>(l)) - 0.5) / 127.0;
      EXPECT_NEAR(*levels[l].pixel(i, 3), srgb_from_linear(static_cast<float>((1.0 + s) / 3)), 1) << l << " " << i;
    }
  }
}

TEST(TextureCutter, WeightsColoursByAlpha) {
  // Transparent pixels are red, opaque ones green: nothing red may show.
  MemoryPhoto photo(400, 400, 4, [](auto column, auto row, int c) {
    const bool opaque = (column / 3 + row / 2) % 2 == 0;
    if (c == 3) return opaque ? 255 : 0;
    return c == (opaque ? 1 : 0) ? 200 : 0;
  });
  const TextureCutter cutter(kGrid, {0.0, 0.0, 0.4, 0.4}, {64, 4});
  for (const Picture& level : cutter.cut(photo, {0, 0})) {
    for (int row = 0; row < level.height; ++row) {
      for (int column = 0; column < level.width; ++column) {
        const std::uint8_t* pixel = level.pixel(column, row);
        EXPECT_EQ(pixel[0], 0);
        if (pixel[3] > 0) {
          EXPECT_EQ(pixel[1], 200);
        }
      }
    }
  }
}

TEST(TextureCutter, ContinuesThePhotosBorderAndSkipsTilesOutsideIt) {
  MemoryPhoto photo(10, 10, 1, [](auto column, auto, int) { return column == 9 ? 77 : 20; });
  // 15 world units wide, from the corner.
  const TextureCutter cutter(kGrid, {0.75, 0.75, 1.5, 1.5}, {64, 4});
  EXPECT_TRUE(cutter.touches(photo.info(), {0, 0}));
  EXPECT_FALSE(cutter.touches(photo.info(), {1, 0}));
  EXPECT_FALSE(cutter.touches(photo.info(), {0, 1}));
  const Picture level = cutter.cut(photo, {0, 0}).front();
  EXPECT_EQ(*level.pixel(63, 63), 77);
  EXPECT_EQ(*level.pixel(12, 0), 77);
  EXPECT_EQ(*level.pixel(0, 63), 20);
  // Even where only the border of a photo lies in a tile far away from its middle.
  const TextureCutter far(kGrid, {-1e9, -1e9, 1e8, 1e8}, {64, 4});
  EXPECT_EQ(*far.cut(photo, {2, 1}).front().pixel(40, 40), 77);
}

TEST(TextureCutter, ReadsOnlyWhatLiesUnderTheTile) {
  MemoryPhoto photo(3000, 2000, 1, noise);
  const TextureCutter cutter(kGrid, {0.05, 0.04, 0.1, 0.08}, {64, 4});
  (void)cutter.cut(photo, {1, 1});
  // A tile is 1000 x 1000 pixels, with 4 texels of 16 pixels around it; rows are read 32 at a time.
  EXPECT_LT(photo.pixels_read, 1150 * 1180);
  const auto [first, last] = cutter.rows_needed(photo.info(), 1);
  EXPECT_NEAR(static_cast<double>(first), 1000 - 4.5 * 1000 / 63, 2.0);
  EXPECT_EQ(last, 1999);
}

}  // namespace
}  // namespace isohf
