#include "isohf/sampling/resample/tile_resampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "isohf/lattice/barycentric.h"
#include "isohf/lattice/planes.h"
#include "isohf/lattice/stitch.h"
#include "isohf/lattice/strip.h"

namespace isohf {
namespace {

/// A source held whole, and the cutter that reads it.
struct Fixture {
  std::int64_t width;
  std::int64_t height;
  Registration registration;
  double spacing;
  std::vector<float> heights;

  Fixture(std::int64_t w, std::int64_t h, Registration reg, const std::function<float(double, double)>& height_at,
          double sample_spacing = 10.0)
      : width(w), height(h), registration(reg), spacing(sample_spacing), heights(static_cast<std::size_t>(w * h)) {
    for (std::int64_t row = 0; row < h; ++row) {
      for (std::int64_t column = 0; column < w; ++column) {
        at(column, row) =
            height_at(first() + static_cast<double>(column) * spacing, first() + static_cast<double>(row) * spacing);
      }
    }
  }

  [[nodiscard]] double first() const { return registration == Registration::kArea ? spacing / 2.0 : 0.0; }
  float& at(std::int64_t column, std::int64_t row) { return heights[static_cast<std::size_t>(row * width + column)]; }
  [[nodiscard]] SourceAxis axis(std::int64_t samples) const { return {samples, first(), spacing, registration, 25.0}; }
  [[nodiscard]] std::unique_ptr<TileResampler> cutter(const TileGrid& grid, Filter filter) const {
    return make_grid_resampler(grid, {axis(width), axis(height)}, Kernel::make(filter), {-1e9, 1e9});
  }
  /// Cuts with a band of just the samples that the cutter asks for.
  [[nodiscard]] std::vector<float> cut(const TileGrid& grid, TileIndex tile, Filter filter = Filter::kBilinear) const {
    const auto cutter_ = cutter(grid, filter);
    const RowRange rows = cutter_->rows_needed(tile.row);
    std::vector<float> band;
    const auto read = [&](const Window& window) -> std::optional<SourceBand> {
      EXPECT_TRUE(window.row == rows.first && window.rows == rows.last - rows.first + 1);
      for (std::int64_t r = window.row; r < window.row + window.rows; ++r) {
        const auto first = heights.begin() + r * width + window.column;
        band.insert(band.end(), first, first + window.columns);
      }
      return SourceBand{{band.data(), window.columns, window.rows}, window.row, {}, window.column};
    };
    std::vector<float> out(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
    EXPECT_TRUE(cutter_->cut(tile, read, out));
    return out;
  }
};

constexpr Filter kFilters[] = {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

float bumps(double x, double z) {
  return static_cast<float>(50.0 * std::sin(x * 0.03) + 30.0 * std::cos(z * 0.05 + x * 0.01));
}

/// Those that reproduce slopes; the B-spline without its prefilter, which changes nothing on a plane.
constexpr Filter kSlopes[] = {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

TEST(GridResampler, ReproducesAPlaneToTheVeryEdgeOfTheSourceAndAsFarAsItGoesOn) {
  const auto plane = [](double x, double z) { return static_cast<float>(3.0 + 0.25 * x - 0.5 * z); };
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    const Fixture source(43, 44, registration, plane);
    const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 4, 4, 110.0, 110.0);
    const double last_x = source.first() + 10.0 * 42.0;
    const double last_z = source.first() + 10.0 * 43.0;
    for (const Filter filter : kSlopes) {
      for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
        const TileIndex index = grid.tile_at(tile);
        const std::vector<float> heights = source.cut(grid, index, filter);
        for (int r = 0; r < 11; ++r) {
          for (int c = 0; c < 12; ++c) {
            const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex(index, {c, r}));
            const double beyond =
                std::max({source.first() - world.x, world.x - last_x, source.first() - world.z, world.z - last_z});
            if (beyond > 25.0) continue;
            // A few float roundings of heights below 500.
            EXPECT_NEAR(heights[static_cast<std::size_t>(r * 12 + c)], plane(world.x, world.z), 2e-4);
          }
        }
      }
    }
  }
}

/// The four samples around a place, those that are no voids.
std::vector<float> samples_around(const Fixture& source, WorldPoint world) {
  std::vector<float> found;
  const double u = (world.x - source.first()) / source.spacing;
  const double v = (world.z - source.first()) / source.spacing;
  for (const double row : {std::floor(v), std::ceil(v)}) {
    for (const double column : {std::floor(u), std::ceil(u)}) {
      const float sample = source.heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(source.width) +
                                          static_cast<std::size_t>(column)];
      if (!std::isnan(sample)) found.push_back(sample);
    }
  }
  return found;
}

/// Calls for every vertex between samples: its height, its place, the samples around it.
template <typename Look>
void for_each_vertex_inside(const Fixture& source, Filter filter, Look look) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 4, 4, 107.0, 103.0);
  for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
    const std::vector<float> heights = source.cut(grid, grid.tile_at(tile), filter);
    for (int r = 0; r < 11; ++r) {
      for (int c = 0; c < 12; ++c) {
        const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex(grid.tile_at(tile), {c, r}));
        if (world.x < source.first() || world.z < source.first()) continue;
        if (world.x > source.first() + static_cast<double>(source.width - 1) * source.spacing) continue;
        if (world.z > source.first() + static_cast<double>(source.height - 1) * source.spacing) continue;
        look(heights[static_cast<std::size_t>(r * 12 + c)], world, samples_around(source, world));
      }
    }
  }
}

TEST(GridResampler, LimitedCubicStaysWithinTheSamplesAroundEachVertex) {
  std::mt19937 random(3);
  for (const double void_share : {0.0, 0.1, 0.4}) {
    Fixture source(42, 41, Registration::kPoint, bumps);
    for (float& height : source.heights) {
      height = static_cast<double>(random()) < void_share * 0x1p32 ? std::numeric_limits<float>::quiet_NaN()
                                                                   : static_cast<float>(random() % 9000);
    }
    std::int64_t vertices = 0;
    for_each_vertex_inside(source, Filter::kLimitedCubic,
                           [&](float height, WorldPoint world, const std::vector<float>& around) {
                             if (std::isnan(height) || around.size() < 4) return;  // rule 7 may hold
                             ++vertices;
                             const auto [least, most] = std::minmax_element(around.begin(), around.end());
                             // Where a coordinate is that of a sample, the next one's count as around as well.
                             const bool between = std::fmod(world.x, 10.0) != 0.0 && std::fmod(world.z, 10.0) != 0.0;
                             if (!between) return;
                             ASSERT_GE(height, *least) << world.x << "," << world.z;
                             ASSERT_LE(height, *most) << world.x << "," << world.z;
                           });
    EXPECT_GT(vertices, 200);
  }
}

TEST(GridResampler, PlanesAreExactNextToVoidsBetweenFourSamples) {
  const auto plane = [](double x, double z) { return static_cast<float>(3.0 + 0.25 * x - 0.5 * z); };
  std::mt19937 random(9);
  for (const int voids : {20, 300}) {
    Fixture source(42, 41, Registration::kPoint, plane);
    for (int i = 0; i < voids; ++i) {
      source.heights[random() % source.heights.size()] = std::numeric_limits<float>::quiet_NaN();
    }
    for_each_vertex_inside(source, Filter::kLimitedCubic,
                           [&](float height, WorldPoint world, const std::vector<float>& around) {
                             if (around.size() < 4) return;
                             // A few float roundings of heights below 500.
                             ASSERT_NEAR(height, plane(world.x, world.z), 2e-4);
                           });
  }
}

TEST(Errata, E06SlidVerticesAreSampledWhereTheyLie) {
  const Fixture source(40, 40, Registration::kPoint, bumps);
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 2, 2, 120.0, 120.0);
  const std::vector<float> heights = source.cut(grid, {1, 0});
  for (int r = 2; r <= 8; r += 2) {
    for (const int c : {1, 10}) {
      const LatticeVertex vertex = grid.lattice_vertex({1, 0}, {c, r});
      EXPECT_EQ(vertex.x % 16, 0) << "on the straight edge";
      const WorldPoint world = grid.world_from_lattice(vertex);
      const double u = world.x / 10.0;
      const double v = world.z / 10.0;
      const auto i = static_cast<std::int64_t>(u);
      const auto j = static_cast<std::int64_t>(v);
      const auto h = [&](std::int64_t a, std::int64_t b) {
        return double{source.heights[static_cast<std::size_t>(b * 40 + a)]};
      };
      const double fu = u - static_cast<double>(i);
      const double fv = v - static_cast<double>(j);
      const double expected = (1 - fv) * ((1 - fu) * h(i, j) + fu * h(std::min<std::int64_t>(i + 1, 39), j)) +
                              fv * ((1 - fu) * h(i, j + 1) + fu * h(std::min<std::int64_t>(i + 1, 39), j + 1));
      EXPECT_NEAR(heights[static_cast<std::size_t>(r * 12 + c)], expected, 1e-4) << c << "," << r;
      // Copying an ordinary neighbour half a step away, as the printed text invites, would be off by far more.
      EXPECT_GT(std::abs(heights[static_cast<std::size_t>(r * 12 + (c == 1 ? 2 : 9))] - expected), 1e-3);
    }
  }
}

TEST(GridResampler, SharedVerticesAndPaddingHaveTheSameBitsInEveryTile) {
  std::mt19937 random(7);
  Fixture source(50, 45, Registration::kArea, bumps);
  // Voids near tile edges must not make a difference either.
  for (int i = 0; i < 60; ++i) {
    source.at(static_cast<std::int64_t>(random() % 50), static_cast<std::int64_t>(random() % 45)) =
        std::numeric_limits<float>::quiet_NaN();
  }
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 5, 5, 101.3, 97.7);
  for (const Filter filter : kFilters) {
    std::map<std::pair<std::int64_t, std::int64_t>, std::uint32_t> seen;
    for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
      const TileIndex index = grid.tile_at(tile);
      const std::vector<float> heights = source.cut(grid, index, filter);
      for (int r = 0; r < 11; ++r) {
        for (int c = 0; c < 12; ++c) {
          const LatticeVertex vertex = grid.lattice_vertex(index, {c, r});
          const float height = heights[static_cast<std::size_t>(r * 12 + c)];
          const std::uint32_t bits = std::isnan(height) ? 0x7FC00000U : std::bit_cast<std::uint32_t>(height);
          const auto [at, is_new] = seen.emplace(std::pair{vertex.x, vertex.z}, bits);
          EXPECT_EQ(at->second, bits) << to_string(filter) << " vertex " << vertex.x << "," << vertex.z;
        }
      }
    }
  }
}

TEST(GridResampler, EveryValidSampleHasASurface) {
  std::mt19937 random(7);
  for (const Filter filter : kFilters) {
    for (const double void_share : {0.03, 0.5, 0.97}) {
      for (const double extent : {60.0, 107.0, 350.0}) {
        Fixture source(42, 41, Registration::kPoint, bumps);
        for (float& height : source.heights) {
          if (static_cast<double>(random()) < void_share * 0x1p32) height = std::numeric_limits<float>::quiet_NaN();
        }
        const auto tiles = static_cast<std::int64_t>(std::ceil(430.0 / extent));
        const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), tiles, tiles, extent, 0.97 * extent);
        std::vector<std::vector<float>> cuts;
        for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
          cuts.push_back(source.cut(grid, grid.tile_at(tile), filter));
        }
        for (std::int64_t row = 0; row < source.height; ++row) {
          for (std::int64_t column = 0; column < source.width; ++column) {
            if (std::isnan(source.at(column, row))) continue;
            const TilePoint at = grid.locate({10.0 * static_cast<double>(column), 10.0 * static_cast<double>(row)});
            const View2D<const float> view(cuts[static_cast<std::size_t>(grid.flat_index(at.tile))].data(), 12, 11);
            ASSERT_FALSE(std::isnan(interpolate(barycentric(grid.shape(), at.point), view)))
                << to_string(filter) << " sample " << column << " " << row << " extent " << extent;
          }
        }
      }
    }
  }
}

TEST(GridResampler, VoidsNeverLeakIntoElevations) {
  Fixture source(40, 40, Registration::kPoint, [](double, double) { return 100.0F; });
  for (std::int64_t row = 10; row < 20; ++row) {
    for (std::int64_t column = 12; column < 25; ++column)
      source.at(column, row) = std::numeric_limits<float>::quiet_NaN();
  }
  const TileGrid grid = TileGrid::make(TileShape::make(68, 83, 4), 1, 1, 390.0, 390.0);
  for (const Filter filter : kFilters) {
    int voids = 0;
    const std::vector<float> heights = source.cut(grid, {0, 0}, filter);
    for (int r = 1; r < 82; ++r) {
      for (int c = 1; c < 66; ++c) {
        const float height = heights[static_cast<std::size_t>(r * 68 + c)];
        const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex({0, 0}, {c, r}));
        const bool deep_inside = world.x > 131.0 && world.x < 229.0 && world.z > 111.0 && world.z < 179.0;
        const bool far_outside = world.x < 100.0 || world.x > 260.0 || world.z < 80.0 || world.z > 210.0;
        if (deep_inside) {
          EXPECT_TRUE(std::isnan(height)) << to_string(filter);
        }
        if (far_outside) {
          EXPECT_FLOAT_EQ(height, 100.0F) << to_string(filter);
        }
        if (!std::isnan(height)) {
          EXPECT_NEAR(height, 100.0F, 1e-3) << to_string(filter);
        }
        voids += std::isnan(height) ? 1 : 0;
      }
    }
    EXPECT_GT(voids, 0);
  }
}

TEST(GridResampler, ReadsOnlyTheRowsThatItAskedFor) {
  const Fixture source(30, 200, Registration::kArea, bumps);
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 3, 25, 82.0, 82.0);
  for (const Filter filter : kFilters) {
    const auto cutter = source.cutter(grid, filter);
    std::int64_t last_first = 0;
    for (std::int64_t row = 0; row < 25; ++row) {
      const RowRange rows = cutter->rows_needed(row);
      EXPECT_GE(rows.first, 0);
      EXPECT_LT(rows.last, 200);
      EXPECT_LE(rows.last - rows.first, 30) << "a band, not the whole";
      if (row < 24) {
        EXPECT_GE(rows.first, last_first);
      }
      last_first = rows.first;
      // A band of NaN around the asked rows changes nothing: with those rows alone, cut() never reads outside (ASan).
      (void)source.cut(grid, {1, row}, filter);
    }
  }
}

/// The end of the source in column steps and rows, and how far a vertex lies beyond it.
double steps_beyond(const Fixture& source, const TileGrid& grid, LatticeVertex vertex) {
  const SourceAxis x = source.axis(source.width);
  const SourceAxis z = source.axis(source.height);
  const WorldPoint world = grid.world_from_lattice(vertex);
  return std::max((world.x - x.end_world()) / (2.0 * grid.sigma_x()), (world.z - z.end_world()) / grid.sigma_z());
}

TEST(GridResampler, BeyondTheSourceTheSlopeGoesOnForItsStepsAndTheSurfaceEndsAfterThree) {
  const Fixture source(20, 20, Registration::kPoint, [](double x, double z) { return static_cast<float>(x + z); });
  const TileGrid grid = TileGrid::make(TileShape::make(54, 61, 1), 1, 1, 500.0, 500.0);
  const std::vector<float> heights = source.cut(grid, {0, 0});
  std::int64_t held = 0;
  std::int64_t ended = 0;
  for (int r = 0; r < 61; ++r) {
    for (int c = 0; c < 54; ++c) {
      const LatticeVertex vertex = grid.lattice_vertex({0, 0}, {c, r});
      const double beyond = steps_beyond(source, grid, vertex);
      const float height = heights[static_cast<std::size_t>(r * 54 + c)];
      if (beyond <= 3.0) {
        const auto continued = [](double place) { return std::clamp(place, -25.0, 190.0 + 25.0); };
        const WorldPoint world = grid.world_from_lattice(vertex);
        ASSERT_NEAR(height, continued(world.x) + continued(world.z), 2e-4) << "2.5 samples of slope 1, then level";
        ++held;
      } else if ((vertex.x % 4 != 0 && vertex.x != 100) || (vertex.z % 4 != 0 && vertex.z != 58)) {
        // A vertex of the first two levels, and not at the tiles' end, where those of all levels are.
        ASSERT_TRUE(std::isnan(height)) << c << "," << r;
        ++ended;
      }
    }
  }
  EXPECT_GT(held, 500);
  EXPECT_GT(ended, 500);
}

/// Every triangle of every level of detail that touches the source is whole, those of overviews too.
TEST(GridResampler, NoLevelLosesGroundOfTheSource) {
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i) {
    const auto width = static_cast<std::int64_t>(20 + random() % 130);
    const auto height = static_cast<std::int64_t>(20 + random() % 130);
    const Registration registration = i % 2 == 0 ? Registration::kArea : Registration::kPoint;
    const Fixture source(width, height, registration, bumps);
    const TileShape shape = TileShape::make(20, 19, 4);
    const double extent = 150.0 + static_cast<double>(random() % 60);
    const auto tiles = [&](std::int64_t samples) {
      return static_cast<std::int64_t>(std::ceil(source.axis(samples).end_world() / extent));
    };
    const TileGrid grid = TileGrid::make(shape, tiles(width), tiles(height), extent, extent);
    std::map<std::pair<std::int64_t, std::int64_t>, float> heights;
    for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
      const std::vector<float> cut = source.cut(grid, grid.tile_at(tile));
      for (int r = 0; r < shape.rows(); ++r) {
        for (int c = 0; c < shape.columns(); ++c) {
          const LatticeVertex vertex = grid.lattice_vertex(grid.tile_at(tile), {c, r});
          heights[{vertex.x, vertex.z}] = cut[static_cast<std::size_t>(r * shape.columns() + c)];
        }
      }
    }
    const WorldPoint end{source.axis(width).end_world(), source.axis(height).end_world()};
    const int stride = plane_stride(shape);
    const Planes planes(grid, stride, plane_count(grid, stride), false);
    std::int64_t triangles = 0;
    for (int plane = 0; plane <= planes.count(); ++plane) {
      const TileShape& mesh = planes.mesh_shape();
      for (int level = 0; level < mesh.levels(); ++level) {
        const std::vector<std::uint32_t> strip = strip_indices(mesh, level);
        std::vector<std::uint32_t> indices = stitch_indices(mesh);
        for (std::size_t k = 0; k + 2 < strip.size(); ++k) {
          if (strip[k] == strip[k + 1] || strip[k + 1] == strip[k + 2]) continue;  // between two rows
          indices.insert(indices.end(), {strip[k], strip[k + 1], strip[k + 2]});
        }
        for (std::int64_t flat = 0; flat < planes.grid(plane).tile_count(); ++flat) {
          const TileIndex tile = planes.grid(plane).tile_at(flat);
          for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
            double least_x = HUGE_VAL;
            double least_z = HUGE_VAL;
            double most_x = -HUGE_VAL;
            double most_z = -HUGE_VAL;
            bool is_whole = true;
            for (std::size_t k = t; k < t + 3; ++k) {
              const GridVertex at{static_cast<int>(indices[k]) % shape.columns(),
                                  static_cast<int>(indices[k]) / shape.columns()};
              const LatticeVertex vertex = planes.grid(plane).lattice_vertex(tile, at);
              const LatticeVertex place = planes.place(plane, vertex);
              const WorldPoint world = grid.world_from_lattice(place);
              least_x = std::min(least_x, world.x);
              least_z = std::min(least_z, world.z);
              most_x = std::max(most_x, world.x);
              most_z = std::max(most_z, world.z);
              is_whole = is_whole && !planes.is_beyond(plane, vertex) && !std::isnan(heights.at({place.x, place.z}));
            }
            // Stitches have no area; of planes some lie where the tiles' edge stands in for all that is beyond.
            if (plane > 0 && (least_x == most_x || least_z == most_z)) continue;
            if (least_x >= end.x || least_z >= end.z) continue;
            ++triangles;
            ASSERT_TRUE(is_whole) << "plane " << plane << " level " << level << " triangle " << t / 3 << " at "
                                  << least_x << ".." << most_x << "," << least_z << ".." << most_z << ", raster " << i;
          }
        }
      }
    }
    EXPECT_GT(triangles, 100);
  }
}

}  // namespace
}  // namespace isohf
