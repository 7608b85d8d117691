#include "isohf/light/shadow_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/convert.h"
#include "isohf/lattice/shadow_path.h"
#include "isohf/shade.h"
#include "isohf/surface.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

/// Of Eq. 16, with k twice as much: so deep in the shadow nothing is seen of the sun.
constexpr double kDepthOfOne = 500.0;
constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

/// A height for every place of the lattice, the same for all tiles that share it.
float height_at(LatticeVertex vertex) {
  const auto mixed = static_cast<std::uint64_t>(vertex.x * 7919 + vertex.z * 104729 + 17) * 0x9E3779B97F4A7C15U;
  return static_cast<float>(mixed >> 40U) / static_cast<float>(1U << 24U) * 30.0F;
}

/// What is hidden of the sun on all tiles, passed over from the sun's side.
std::vector<TileRowValues> hidden_of(const TileGrid& grid, ShadowSweep& sweep,
                                     const std::vector<TileRowValues>& heights) {
  std::vector<TileRowValues> all;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) all.emplace_back(grid, std::nullopt);
  ShadowSweep::State light;
  for (std::int64_t k = 0; k < grid.tile_rows(); ++k) {
    const auto row = static_cast<std::size_t>(sweep.from_south() ? grid.tile_rows() - 1 - k : k);
    light = sweep.pass(static_cast<std::int64_t>(row), light, heights[row], &all[row]);
  }
  return all;
}
std::vector<TileRowValues> hidden_of(const TileGrid& grid, ShadowSweep& sweep) {
  std::vector<TileRowValues> all;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    TileRowValues& heights = all.emplace_back(grid, std::nullopt);
    for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
      std::vector<float> tile;
      for (int r = 0; r < grid.shape().rows(); ++r) {
        for (int c = 0; c < grid.shape().columns(); ++c) {
          tile.push_back(height_at(grid.lattice_vertex({column, row}, {c, r})));
        }
      }
      heights.write_tile(column, tile);
    }
  }
  return hidden_of(grid, sweep, all);
}

// Along each of the lattice's axes S is the greatest height of a vertex on the way, less what the shadow falls up to
// there, to float's rounding.
TEST(ShadowSweep, IsExactAtTheVerticesOnTheSixAzimuthsOfTheLattice) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 1), 3, 4, 160.0, 150.0);
  const std::int64_t width = half_steps_across(grid.shape()) * grid.tile_columns();
  const std::int64_t height = grid.shape().cell_rows() * grid.tile_rows();
  const WorldBounds ground{0.0, 0.0, grid.world_width(), grid.world_height()};
  const double diagonal = std::atan2(grid.sigma_x(), grid.sigma_z()) * 180.0 / std::numbers::pi;
  struct Way {
    double azimuth;
    int x;  ///< towards the sun, half steps
    int z;
  };
  const Way ways[] = {{270.0, -2, 0},           {90.0, 2, 0},
                      {diagonal, 1, -1},        {360.0 - diagonal, -1, -1},
                      {180.0 - diagonal, 1, 1}, {180.0 + diagonal, -1, 1}};
  for (const Way& way : ways) {
    for (const double fall : {0.05, 0.3, 1.0}) {
      ShadowSweep sweep(grid, ground, {way.azimuth, fall, fall, fall, 2.0 * kDepthOfOne});
      const std::vector<TileRowValues> depths = hidden_of(grid, sweep);
      const double step = fall * std::hypot(way.x * grid.sigma_x(), way.z * grid.sigma_z());
      int compared = 0;
      for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
        const TileIndex index = grid.tile_at(tile);
        const std::vector<float> found_here = depths[static_cast<std::size_t>(index.row)].tile(index.column);
        for (int r = 1; r <= grid.shape().rows() - 2; ++r) {
          for (int c = 1; c <= last_visible_column(grid.shape(), r); ++c) {
            // Slid vertices lie between the lattice's lines, and on its rows half a step from their neighbours.
            if (is_slid(grid.shape(), {c, r}) || (way.z == 0 && r % 2 == 0)) continue;
            const LatticeVertex at = grid.lattice_vertex(index, {c, r});
            double dark = -std::numeric_limits<double>::infinity();
            LatticeVertex on{at.x + way.x, at.z + way.z};
            for (int n = 1; on.x >= 0 && on.x <= width && on.z >= 0 && on.z <= height; ++n) {
              dark = std::max(dark, static_cast<double>(height_at(on)) - n * step);
              on = {on.x + way.x, on.z + way.z};
            }
            // In the sun a depth says how near the light's line passes, also between vertices.
            const double depth = std::max(dark - static_cast<double>(height_at(at)), 0.0);
            const auto found =
                kDepthOfOne * static_cast<double>(found_here[static_cast<std::size_t>(r * grid.shape().columns() + c)]);
            ASSERT_NEAR(std::max(found, 0.0), depth, 1e-4) << way.azimuth << " at " << at.x << ' ' << at.z;
            ++compared;
          }
        }
      }
      EXPECT_GT(compared, 300);
    }
  }
}

// Tiles that share a vertex find the same depth there, whichever way the light comes.
TEST(ShadowSweep, AgreesWhereTilesMeet) {
  const TileGrid grid = TileGrid::make(TileShape::make(10, 13, 1), 3, 3, 100.0, 130.0);
  const WorldBounds ground{0.0, 0.0, grid.world_width(), grid.world_height()};
  const int last = grid.shape().rows() - 2;
  for (int azimuth = 0; azimuth < 360; azimuth += 7) {
    SweptSun sun{static_cast<double>(azimuth), 0.2, 0.205, 0.195};
    if (azimuth % 2 == 0) sun.softness = 5.0;
    ShadowSweep sweep(grid, ground, sun);
    const std::vector<TileRowValues> depths = hidden_of(grid, sweep);
    for (std::size_t row = 0; row + 1 < depths.size(); ++row) {
      for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
        const std::vector<float> north = depths[row].tile(column);
        const std::vector<float> south = depths[row + 1].tile(column);
        for (int c = 1; c <= last_visible_column(grid.shape(), last); ++c) {
          const auto at = [&](int r) { return static_cast<std::size_t>(r * grid.shape().columns() + c); };
          ASSERT_NEAR(north[at(last)], south[at(1)], 1e-3) << azimuth;
        }
      }
    }
  }
}

class ShadowsOfAnySun : public testing::Test {
 protected:
  /// Which pixels of a converted raster, one a sample, see the sun: by a ray from each, and by the picture.
  struct Compared {
    int wrong = 0;  ///< further than a cell from the border of a shadow
    int pixels = 0;
    int dark = 0;  ///< by rays
    int lit_though_dark = 0;
    int dark_though_lit = 0;

    void add(bool is_dark, bool is_found_dark) {
      ++pixels;
      dark += is_dark ? 1 : 0;
      lit_though_dark += is_dark && !is_found_dark ? 1 : 0;
      dark_though_lit += !is_dark && is_found_dark ? 1 : 0;
    }
    void add(const Compared& other) {
      wrong += other.wrong;
      pixels += other.pixels;
      dark += other.dark;
      lit_though_dark += other.lit_though_dark;
      dark_though_lit += other.dark_though_lit;
    }
    /// At most 2 % of the dark ones are lit, as many lit ones dark, and the difference is at most 1 %.
    void expect_unbiased(const std::string& what) const {
      EXPECT_LE(50 * lit_though_dark, dark) << what << ": " << dark << " dark";
      EXPECT_LE(50 * dark_though_lit, dark) << what << ": " << dark << " dark";
      EXPECT_LE(100 * std::abs(lit_though_dark - dark_though_lit), dark)
          << what << ": " << dark << " dark, " << lit_though_dark << " of them lit, " << dark_though_lit
          << " others dark";
    }
  };

  static constexpr int kColumns = 72;
  static constexpr int kRows = 60;

  static Compared compare(const ArchiveReader& archive, double azimuth, double elevation) {
    ShadeOptions options;
    options.kind = ShadeKind::kShadowMask;
    options.size = GridSize{kColumns, kRows};
    options.sun_azimuth_deg = azimuth;
    options.sun_elevation_deg = elevation;
    const Picture found = shade(archive, options);
    const std::vector<int> lit = rays(archive, azimuth, elevation, kColumns, kRows);
    Compared result;
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kColumns; ++c) {
        const auto at = [&](int column, int row) { return lit[static_cast<std::size_t>(row * kColumns + column)]; };
        const int value = found.pixel(c, r)[0];
        EXPECT_EQ(value == 0, at(c, r) < 0);
        if (at(c, r) < 0) continue;
        bool on_border = false;
        for (int dr = -1; dr <= 1; ++dr) {
          for (int dc = -1; dc <= 1; ++dc) {
            const int column = std::clamp(c + dc, 0, kColumns - 1);
            const int row = std::clamp(r + dr, 0, kRows - 1);
            on_border = on_border || at(column, row) != at(c, r);
          }
        }
        result.add(at(c, r) == 0, value < 128);
        if (!on_border && (value >= 128) != (at(c, r) == 1)) ++result.wrong;
      }
    }
    return result;
  }

  /// Of each pixel of so large a picture: 1 lit, 0 dark, -1 void.
  static std::vector<int> rays(const ArchiveReader& archive, double azimuth, double elevation, int columns, int rows) {
    const WorldBounds& ground = archive.metadata().valid;
    std::vector<WorldPoint> points;
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        points.push_back({ground.x0 + (c + 0.5) * (ground.x1 - ground.x0) / columns,
                          ground.z0 + (r + 0.5) * (ground.z1 - ground.z0) / rows});
      }
    }
    std::vector<SunSample> light(points.size());
    std::vector<double> heights(points.size());
    Surface surface(archive);
    surface.sample(points, {azimuth, elevation, {}}, 0.0, std::span(light));
    surface.sample(points, std::span(heights));
    std::vector<int> lit;
    for (std::size_t i = 0; i < light.size(); ++i) {
      lit.push_back(std::isnan(heights[i]) ? -1 : light[i].shadow_height <= heights[i] + 1e-9 ? 1 : 0);
    }
    return lit;
  }

  /// Of all pixels at many azimuths, for each of three elevations.
  void expect_shadows_of_rays(const std::function<double(std::int64_t, std::int64_t)>& height) {
    test::MemorySource<float> source(SampleType::kFloat32, kColumns, kRows, height);
    ConvertOptions convert_options;
    convert_options.plan.shape = {20, 19};
    convert_options.plan.levels = 1;
    (void)convert(source, folder / "a.isohf", convert_options);
    const ArchiveReader archive(folder / "a.isohf");
    for (const double elevation : {4.0, 12.0, 30.0}) {
      Compared sum;
      for (int azimuth = 5; azimuth < 360; azimuth += 31) {
        const Compared one = compare(archive, azimuth, elevation);
        sum.add(one);
        EXPECT_LE(one.wrong, one.pixels / 100) << azimuth << " degrees, " << elevation << " high";
      }
      EXPECT_LE(sum.wrong * 200, sum.pixels) << elevation << " degrees high, " << sum.dark << " dark";
      EXPECT_GT(sum.dark, elevation < 20.0 ? sum.pixels / 50 : 0);
    }
  }

  test::TemporaryFolder folder;
};

/// Mountains with detail down to single samples: octaves of waves whose ways and phases are drawn at random.
double mountains(std::int64_t column, std::int64_t row) {
  static const std::vector<std::array<double, 4>> waves = [] {
    std::mt19937 random(11);
    const auto drawn = [&] { return static_cast<double>(random() % 100000) / 100000.0; };
    std::vector<std::array<double, 4>> all;
    for (double length = 64.0; length > 3.0; length /= 1.4) {
      for (int i = 0; i < 4; ++i) {
        const double way = 2.0 * std::numbers::pi * drawn();
        all.push_back({std::cos(way) * 6.28 / length, std::sin(way) * 6.28 / length, 6.28 * drawn(), 0.035 * length});
      }
    }
    return all;
  }();
  double height = 0.0;
  for (const auto& [x, z, phase, size] : waves) {
    height += size * std::sin(x * static_cast<double>(column) + z * static_cast<double>(row) + phase);
  }
  return height;
}

// Pictures and vertices are as often lit though dark as dark though lit, and seldom either (decision 79). Lit is a
// share of 1/2 or more; pixels are those of the default size, one a vertex.
TEST_F(ShadowsOfAnySun, AreNeitherTooLightNorTooDark) {
  test::MemorySource<float> source(SampleType::kFloat32, 200, 170, mountains);
  ConvertOptions convert_options;
  convert_options.plan.shape = {60, 59};
  convert_options.plan.levels = 1;
  (void)convert(source, folder / "mountains.isohf", convert_options);
  const ArchiveReader archive(folder / "mountains.isohf");
  const TileGrid& grid = archive.grid();
  const TileShape& shape = grid.shape();
  std::vector<TileRowValues> heights;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    heights.emplace_back(grid, std::nullopt);
    for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
      const TileCodes codes = archive.read_tile({column, row});
      std::vector<float> tile;
      for (std::size_t i = 0; i < static_cast<std::size_t>(shape.stored_vertex_count()); ++i) {
        tile.push_back(static_cast<float>(elevation_from_code(archive.metadata().quantisation, codes.codes[i])));
      }
      heights.back().write_tile(column, tile);
    }
  }
  Surface surface(archive);
  for (const double elevation : {5.0, 12.0, 25.0}) {
    Compared pixels;
    Compared vertices;
    for (int azimuth = 7; azimuth < 360; azimuth += 30) {
      ShadeOptions options;
      options.kind = ShadeKind::kShadowMask;
      options.sun_azimuth_deg = azimuth;
      options.sun_elevation_deg = elevation;
      const Picture found = shade(archive, options);
      const WorldBounds& ground = archive.metadata().valid;
      std::vector<WorldPoint> points;
      std::vector<bool> are_dark;
      // Every fifth, as rays take their time.
      for (int r = 0; r < found.height; ++r) {
        for (int c = r % 5; c < found.width; c += 5) {
          points.push_back({ground.x0 + (c + 0.5) * (ground.x1 - ground.x0) / found.width,
                            ground.z0 + (r + 0.5) * (ground.z1 - ground.z0) / found.height});
          are_dark.push_back(found.pixel(c, r)[0] < 128);
        }
      }
      const std::size_t pixel_count = points.size();
      ShadowSweep sweep(grid, ground, swept_sun(azimuth, elevation, sun_radius_deg("Earth"), 1.0, 1.0));
      const std::vector<TileRowValues> hidden = hidden_of(grid, sweep, heights);
      for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
        const TileIndex index = grid.tile_at(tile);
        const std::vector<float> parts = hidden[static_cast<std::size_t>(index.row)].tile(index.column);
        for (int r = 1; r <= shape.rows() - 2; ++r) {
          for (int c = 1 + r % 5; c <= last_visible_column(shape, r); c += 5) {
            points.push_back(grid.world_from_object(
                index, {static_cast<double>(object_x(shape.columns(), c, r)), static_cast<double>(r - 1)}));
            are_dark.push_back(parts[static_cast<std::size_t>(r * shape.columns() + c)] > 0.5F);
          }
        }
      }
      std::vector<SunSample> light(points.size());
      surface.sample(points, {static_cast<double>(azimuth), elevation, {}}, 0.0, std::span(light));
      for (std::size_t i = 0; i < light.size(); ++i) {
        if (!std::isnan(light[i].share)) (i < pixel_count ? pixels : vertices).add(light[i].share < 0.5, are_dark[i]);
      }
    }
    pixels.expect_unbiased(std::to_string(elevation) + " degrees, pixels");
    vertices.expect_unbiased(std::to_string(elevation) + " degrees, vertices");
    EXPECT_GT(pixels.dark, pixels.pixels / 50);
  }
}

// Triangles that face away from the sun are dark up to their sides.
TEST_F(ShadowsOfAnySun, CoverTrianglesThatFaceAway) {
  test::MemorySource<float> source(SampleType::kFloat32, 70, 60, mountains);
  (void)convert(source, folder / "mountains.isohf");
  const ArchiveReader archive(folder / "mountains.isohf");
  const WorldBounds& ground = archive.metadata().valid;
  Surface surface(archive);
  int facing_away = 0;
  for (int azimuth = 3; azimuth < 360; azimuth += 25) {
    ShadeOptions options;
    options.kind = ShadeKind::kShadowMask;
    options.size = GridSize{210, 180};
    options.sun_azimuth_deg = azimuth;
    options.sun_elevation_deg = 14.0;
    const Picture found = shade(archive, options);
    const double towards[2] = {std::sin(azimuth * std::numbers::pi / 180.0),
                               -std::cos(azimuth * std::numbers::pi / 180.0)};
    constexpr double kNear = 1e-3;
    std::vector<WorldPoint> points;
    for (int r = 1; r < 179; ++r) {
      for (int c = 1; c < 209; ++c) {
        const double x = ground.x0 + (c + 0.5) * (ground.x1 - ground.x0) / 210.0;
        const double z = ground.z0 + (r + 0.5) * (ground.z1 - ground.z0) / 180.0;
        for (const double way : {0.0, kNear, 2.0 * kNear}) {
          points.push_back({x + way * towards[0], z + way * towards[1]});
        }
      }
    }
    std::vector<double> heights(points.size());
    surface.sample(points, std::span(heights));
    for (std::size_t i = 0; i < points.size(); i += 3) {
      const double rise = (heights[i + 1] - heights[i]) / kNear;
      // On one triangle, and so steep that nothing is seen of the disc: its upper edge is 0.27 degrees higher.
      if (std::abs(heights[i + 2] - heights[i + 1] - rise * kNear) > 1e-6 * kNear) continue;
      if (rise < std::tan(14.4 * std::numbers::pi / 180.0)) continue;
      ++facing_away;
      const auto pixel = static_cast<int>(i / 3);
      ASSERT_EQ(found.pixel(1 + pixel % 208, 1 + pixel / 208)[0], 1) << azimuth << ", pixel " << pixel;
    }
  }
  EXPECT_GT(facing_away, 10000);
}

// Behind a wall, higher in the North, on level ground: as much of the sun is seen as of its disc stands above the wall's top.
TEST_F(ShadowsOfAnySun, HavePenumbraeThatGrowWithTheCastersDistance) {
  constexpr int kWide = 900;
  constexpr int kWall = 20;
  test::MemorySource<float> source(SampleType::kFloat32, kWide, 40, [](std::int64_t c, std::int64_t r) {
    return std::abs(c - kWall) > 2 ? 0.0 : r < 20 ? 60.0 : 15.0;
  });
  (void)convert(source, folder / "wall.isohf");
  const ArchiveReader archive(folder / "wall.isohf");
  for (const double elevation : {5.0, 11.0}) {
    ShadeOptions options;
    options.kind = ShadeKind::kShadowMask;
    options.size = GridSize{kWide, 40};
    options.sun_elevation_deg = elevation;  // in the West
    const Picture found = shade(archive, options);
    double widths[2] = {};
    for (const int row : {10, 30}) {
      const auto share_behind = [&](double distance) {
        const double rise = std::atan2(row == 10 ? 60.0 : 15.0, distance) * 180.0 / std::numbers::pi;
        return std::clamp(0.5 + (elevation - rise) / (2.0 * sun_radius_deg("Earth")), 0.0, 1.0);
      };
      for (int c = kWall + 20; c < kWide; ++c) {
        const double share = (found.pixel(c, row)[0] - 1) / 254.0;
        // The wall's top ends within a lattice step of its last sample.
        ASSERT_GE(share, share_behind(c - kWall - 3.2) - 0.02) << elevation << " degrees, row " << row << ", " << c;
        ASSERT_LE(share, share_behind(c - kWall - 0.8) + 0.02) << elevation << " degrees, row " << row << ", " << c;
        widths[row / 20] += share > 0.0 && share < 1.0 ? 1.0 : 0.0;
      }
      EXPECT_GE(widths[row / 20], 3.0);
    }
    EXPECT_NEAR(widths[0] / widths[1], 4.0, 1.0);
  }
}

// Borders on steep ground near what casts the shadow go where rays have them, to a part of a cell: they have no teeth.
TEST_F(ShadowsOfAnySun, HaveBordersWithoutTeethOnSteepGround) {
  constexpr int kFine = 4;  // pixels a sample
  test::MemorySource<float> source(SampleType::kFloat32, 90, 70, [](std::int64_t c, std::int64_t r) {
    const auto x = static_cast<double>(c);
    const auto z = static_cast<double>(r);
    return 5.0 * std::sin(x * 0.2 + std::sin(z * 0.15)) + 3.0 * std::cos(z * 0.22 - x * 0.08);
  });
  (void)convert(source, folder / "hills.isohf");
  const ArchiveReader archive(folder / "hills.isohf");
  int wrong = 0;
  int pixels = 0;
  for (const double azimuth : {20.0, 120.0, 200.0, 315.0}) {
    ShadeOptions options;
    options.kind = ShadeKind::kShadowMask;
    options.size = GridSize{90 * kFine, 70 * kFine};
    options.sun_azimuth_deg = azimuth;
    options.sun_elevation_deg = 14.0;
    const Picture found = shade(archive, options);
    const std::vector<int> lit = rays(archive, azimuth, 14.0, found.width, found.height);
    for (std::size_t i = 0; i < lit.size(); ++i) {
      wrong += (found.samples[i * static_cast<std::size_t>(found.channels)] >= 128) != (lit[i] == 1) ? 1 : 0;
    }
    pixels += static_cast<int>(lit.size());
  }
  // 0.56 %, within a cell of borders; 2.6 % without the sides between steps, and without triangles that face away.
  EXPECT_LE(wrong * 1000, pixels * 7);
}

// A penumbra of one size has it at all distances.
TEST_F(ShadowsOfAnySun, HaveOneSoftnessWhereItIsAskedFor) {
  test::MemorySource<float> source(SampleType::kFloat32, 300, 40, [](std::int64_t c, std::int64_t r) {
    return std::abs(c - 20) > 2 ? 0.0 : r < 20 ? 40.0 : 10.0;
  });
  (void)convert(source, folder / "wall.isohf");
  ShadeOptions options;
  options.kind = ShadeKind::kShadowMask;
  options.size = GridSize{300, 40};
  options.sun_elevation_deg = 12.0;
  options.softness = 4.0;
  const Picture found = shade(ArchiveReader(folder / "wall.isohf"), options);
  int between[2] = {};
  for (const int row : {10, 30}) {
    for (int c = 40; c < 300; ++c) {
      const int value = found.pixel(c, row)[0];
      between[row / 20] += value > 1 && value < 255 ? 1 : 0;
    }
  }
  // k/2 over the slope of the light.
  EXPECT_NEAR(between[0], 2.0 / std::tan(12.0 * std::numbers::pi / 180.0), 2.0);
  EXPECT_NEAR(between[1], between[0], 2.0);
}

TEST(SweptSun, FallsLessOverTrueHeightsThanOverExaggeratedOnes) {
  const SweptSun sun = swept_sun(123.0, 20.0, 0.25, 3.0, 0.5);
  EXPECT_NEAR(sun.fall, std::tan(20.0 * std::numbers::pi / 180.0) / 6.0, 1e-12);
  EXPECT_NEAR(sun.upper_fall, std::tan(20.25 * std::numbers::pi / 180.0) / 6.0, 1e-12);
  EXPECT_NEAR(sun.lower_fall, std::tan(19.75 * std::numbers::pi / 180.0) / 6.0, 1e-12);
  // Its lower edge stays above the horizon.
  EXPECT_GT(swept_sun(0.0, 0.01, 0.25, 1.0, 1.0).lower_fall, 0.0);
}

TEST_F(ShadowsOfAnySun, AreThoseOfRaysOverHills) {
  expect_shadows_of_rays([](std::int64_t c, std::int64_t r) {
    const auto x = static_cast<double>(c);
    const auto z = static_cast<double>(r);
    return 4.0 * std::sin(x * 0.35) * std::cos(z * 0.28 + 0.1 * x) + 1.2 * std::sin(x * 0.9 - z * 0.7) + 0.02 * x;
  });
}

TEST_F(ShadowsOfAnySun, AreThoseOfRaysOverTowersAndHoles) {
  std::mt19937 random(5);
  std::vector<double> heights(static_cast<std::size_t>(kColumns * kRows), 0.0);
  for (int i = 0; i < 12; ++i) {
    const int column = static_cast<int>(random() % (kColumns - 8));
    const int row = static_cast<int>(random() % (kRows - 8));
    const bool is_hole = i % 4 == 3;
    for (int k = 0; k < 25; ++k) {
      heights[static_cast<std::size_t>((row + k / 5) * kColumns + column + k % 5)] = is_hole ? kVoid : 3.0 + i;
    }
  }
  expect_shadows_of_rays(
      [&](std::int64_t c, std::int64_t r) { return heights[static_cast<std::size_t>(r * kColumns + c)]; });
}

TEST_F(ShadowsOfAnySun, AreThoseOfRaysOverRoughGround) {
  std::mt19937 random(7);
  std::vector<double> heights(static_cast<std::size_t>(kColumns * kRows));
  for (double& height : heights) height = static_cast<double>(random() % 1000) * 0.0004;
  expect_shadows_of_rays([&](std::int64_t c, std::int64_t r) {
    const auto i = static_cast<std::size_t>(r * kColumns + c);
    return heights[i] + 5.0 * std::exp(-std::hypot(static_cast<double>(c) - 40.0, static_cast<double>(r) - 25.0) / 6.0);
  });
}

}  // namespace
}  // namespace isohf
