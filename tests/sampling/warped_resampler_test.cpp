#include "isohf/sampling/resample/tile_resampler.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "isohf/projection/choose_projection.h"
#include "isohf/projection/projected_extent.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
constexpr Filter kFilters[] = {Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3};

/// A projected source held whole.
struct Fixture {
  SourceGeometry geometry;
  TileGrid grid;
  std::vector<float> heights;

  Fixture(const std::string& request, const GeoExtent& ground, std::int64_t width, std::int64_t height,
          const std::function<double(double longitude, double latitude)>& height_at, bool goes_round = false)
      : grid(TileGrid::make(TileShape::make(36, 35, 2), 1, 1, 1.0, 1.0)) {
    const ProjectionSpec spec =
        choose_projection(ProjectionRequest::parse(request), {"dem.tif", "", {}, ground, goes_round, false}).spec;
    const MapBounds bounds = projected_bounds(Projection(spec), ground);
    const double dx = (ground.east - ground.west) / static_cast<double>(width);
    const double dz = (ground.north - ground.south) / static_cast<double>(height);
    const GeoPoint first{ground.west + dx / 2.0, ground.north - dz / 2.0};
    geometry.width = width;
    geometry.height = height;
    geometry.registration = Registration::kArea;
    geometry.wraps_x = goes_round;
    geometry.warp =
        WarpPlace{spec, {bounds.west, bounds.north}, {first.longitude, first.latitude}, dx, dz, width, height};
    const double extent = std::max(bounds.east - bounds.west, bounds.north - bounds.south) / 3.0;
    grid = TileGrid::make(TileShape::make(36, 35, 2), 3, 3, extent, extent);
    for (std::int64_t r = 0; r < height; ++r) {
      for (std::int64_t c = 0; c < width; ++c) {
        heights.push_back(static_cast<float>(
            height_at(first.longitude + static_cast<double>(c) * dx, first.latitude - static_cast<double>(r) * dz)));
      }
    }
  }

  /// Cuts with a band of just the samples that the cutter asks for.
  [[nodiscard]] std::vector<float> cut(TileIndex tile, Filter filter) const {
    const auto cutter = make_tile_resampler(grid, geometry, Kernel::make(filter), {-1e9, 1e9});
    const RowRange rows = cutter->rows_needed(tile.row);
    const std::optional<Window> about = cutter->window_about(tile);
    std::vector<float> band;
    const auto read = [&](const Window& window) -> std::optional<SourceBand> {
      EXPECT_TRUE(window.row >= rows.first && window.row + window.rows <= rows.last + 1);
      if (about) {
        EXPECT_TRUE(window.column >= about->column && window.row >= about->row);
        EXPECT_LE(window.column + window.columns, about->column + about->columns);
        EXPECT_LE(window.row + window.rows, about->row + about->rows);
      }
      for (std::int64_t r = window.row; r < window.row + window.rows; ++r) {
        const auto first = heights.begin() + r * geometry.width + window.column;
        band.insert(band.end(), first, first + window.columns);
      }
      return SourceBand{{band.data(), window.columns, window.rows}, window.row, {}, window.column};
    };
    std::vector<float> out(static_cast<std::size_t>(grid.shape().stored_vertex_count()), NAN);
    (void)cutter->cut(tile, read, out);
    return out;
  }

  /// Calls for every stored vertex: its height and its place.
  void for_each_vertex(Filter filter, const std::function<void(float, SourcePosition, LatticeVertex)>& look) const {
    const ExactWarp exact(*geometry.warp);
    for (std::int64_t tile = 0; tile < grid.tile_count(); ++tile) {
      const std::vector<float> cut_heights = cut(grid.tile_at(tile), filter);
      std::size_t i = 0;
      for (int r = 0; r < grid.shape().rows(); ++r) {
        for (int c = 0; c < grid.shape().columns(); ++c) {
          const LatticeVertex vertex = grid.lattice_vertex(grid.tile_at(tile), {c, r});
          look(cut_heights[i++], exact.source_from_world(grid.world_from_lattice(vertex)), vertex);
        }
      }
    }
  }

  [[nodiscard]] bool is_inside(SourcePosition at, double margin) const {
    const bool across =
        geometry.wraps_x || (at.u >= margin && at.u <= static_cast<double>(geometry.width - 1) - margin);
    return across && at.v >= margin && at.v <= static_cast<double>(geometry.height - 1) - margin;
  }
};

/// A level in degrees: planes in samples, whatever the projection.
double slope(double longitude, double latitude) {
  return 20.0 * longitude - 35.0 * latitude;
}

TEST(WarpedResampler, ReproducesAPlaneOfTheSourceAtEveryVertexToItsVeryEdge) {
  for (const char* request : {"lambert-conformal", "transverse-mercator", "local"}) {
    const Fixture source(request, {5.0, 40.0, 12.0, 46.0}, 140, 120, slope);
    for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
      source.for_each_vertex(filter, [&](float height, SourcePosition at, LatticeVertex) {
        if (!source.is_inside(at, 0.0)) return;
        const WarpPlace& place = *source.geometry.warp;
        const double expected =
            slope(place.first_sample.easting + at.u * place.step_x, place.first_sample.northing - at.v * place.step_z);
        // A hundredth of a sample at most, of slopes of 1 and 1.75 a sample; and the float's rounding.
        ASSERT_NEAR(height, expected, 0.0275 + 1e-3) << request;
      });
    }
  }
}

TEST(WarpedResampler, GoesRoundTheSeamAndOverThePole) {
  const auto waves = [](double longitude, double latitude) {
    constexpr double kDegree = M_PI / 180.0;
    const double radius = (90.0 - latitude);
    return 10.0 * radius * std::cos(longitude * kDegree) - 7.0 * radius * std::sin(longitude * kDegree);
  };
  const Fixture source("polar-stereographic", {-180.0, 60.0, 180.0, 90.0}, 720, 120, waves, true);
  std::int64_t near_seam = 0;
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    source.for_each_vertex(filter, [&](float height, SourcePosition at, LatticeVertex) {
      if (!source.is_inside(at, 0.0)) return;
      const WarpPlace& place = *source.geometry.warp;
      const double expected =
          waves(place.first_sample.easting + at.u * place.step_x, place.first_sample.northing - at.v * place.step_z);
      near_seam += at.u < 1.0 || at.u > 718.0 ? 1 : 0;
      // Linear along meridians; a cosine of half-degree samples errs by radius * 12 * (half a sample)^2 / 2 < 0.005
      // when interpolated, and a hundredth of a sample is 0.03 along a meridian and 0.03 across at 30 degrees.
      // Mirrored taps at the pole and the far edge bend wider kernels.
      const double allowed = filter == Filter::kBilinear || source.is_inside(at, 3.0) ? 0.1 : 5.0;
      ASSERT_NEAR(height, expected, allowed) << to_string(filter) << " at " << at.u << "," << at.v;
    });
  }
  EXPECT_GT(near_seam, 100);
}

TEST(WarpedResampler, SharedVerticesHaveTheSameBitsInEveryTile) {
  std::mt19937 random(7);
  Fixture source("lambert-conformal", {5.0, 40.0, 12.0, 46.0}, 140, 120,
                 [](double x, double y) { return 50.0 * std::sin(x * 3.0) + 30.0 * std::cos(y * 5.0 + x); });
  for (int i = 0; i < 300; ++i) source.heights[random() % source.heights.size()] = kVoid;
  for (const Filter filter : kFilters) {
    std::map<std::pair<std::int64_t, std::int64_t>, std::uint32_t> seen;
    source.for_each_vertex(filter, [&](float height, SourcePosition, LatticeVertex vertex) {
      const std::uint32_t bits = std::isnan(height) ? 0x7FC00000U : std::bit_cast<std::uint32_t>(height);
      const auto [at, is_new] = seen.emplace(std::pair{vertex.x, vertex.z}, bits);
      EXPECT_EQ(at->second, bits) << to_string(filter) << " vertex " << vertex.x << "," << vertex.z;
    });
  }
}

TEST(WarpedResampler, BeyondTheSourceFollowsTheRule) {
  const Fixture source("lambert-conformal", {5.0, 40.0, 12.0, 46.0}, 140, 120, slope);
  const auto beyond = [&](SourcePosition at) {
    const auto over = [](double place, std::int64_t samples) {
      return std::max({-0.5 - place, place - (static_cast<double>(samples) - 0.5), 0.0});
    };
    return std::max(over(at.u, source.geometry.width), over(at.v, source.geometry.height));
  };
  const SourceAxes axes = make_axes(source.grid, source.geometry);
  const auto reach = static_cast<double>(std::min(axes.x.continued_samples(), axes.z.continued_samples()) - 1);
  ASSERT_GT(reach, 1.0);
  std::int64_t continued = 0;
  std::int64_t ended = 0;
  source.for_each_vertex(Filter::kBilinear, [&](float height, SourcePosition at, LatticeVertex) {
    if (beyond(at) > reach + 3.0) {
      EXPECT_TRUE(std::isnan(height));
      ++ended;
    }
    if (beyond(at) == 0.0 || beyond(at) > reach - 0.6) return;
    // The plane goes on.
    const WarpPlace& place = *source.geometry.warp;
    EXPECT_NEAR(
        height,
        slope(place.first_sample.easting + at.u * place.step_x, place.first_sample.northing - at.v * place.step_z),
        0.06);
    ++continued;
  });
  EXPECT_GT(continued, 100);
  EXPECT_GT(ended, 10);
}

TEST(WarpedResampler, VoidsNeverLeakIntoElevations) {
  Fixture source("transverse-mercator", {5.0, 40.0, 12.0, 46.0}, 140, 120, [](double, double) { return 100.0; });
  std::mt19937 random(11);
  for (int i = 0; i < 2000; ++i) source.heights[random() % source.heights.size()] = kVoid;
  for (const Filter filter : kFilters) {
    std::int64_t voids = 0;
    source.for_each_vertex(filter, [&](float height, SourcePosition, LatticeVertex) {
      if (std::isnan(height)) {
        ++voids;
      } else {
        // Weights sum to 1 but for their rounding to float.
        ASSERT_NEAR(height, 100.0F, 1e-3F) << to_string(filter);
      }
    });
    EXPECT_GT(voids, 0);
  }
}

}  // namespace
}  // namespace isohf
