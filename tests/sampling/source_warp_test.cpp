#include "isohf/sampling/resample/source_warp.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "isohf/projection/choose_projection.h"
#include "isohf/projection/projected_extent.h"

namespace isohf {
namespace {

/// A source over a ground, and the grid of tiles over its map.
struct Scene {
  std::string name;
  WarpPlace place;
  TileGrid grid;
};

Scene make_scene(const std::string& request, const GeoExtent& ground, std::int64_t width, std::int64_t height,
                 bool goes_round = false, const Ellipsoid& ellipsoid = {}) {
  const ProjectionSpec spec =
      choose_projection(ProjectionRequest::parse(request), {"dem.tif", "", ellipsoid, ground, goes_round, false}).spec;
  const MapBounds bounds = projected_bounds(Projection(spec), ground);
  const double dx = (ground.east - ground.west) / static_cast<double>(width);
  const double dz = (ground.north - ground.south) / static_cast<double>(height);
  const WarpPlace place{
      spec, {bounds.west, bounds.north}, {ground.west + dx / 2.0, ground.north - dz / 2.0}, dx, dz, width, height};
  const double extent = std::max(bounds.east - bounds.west, bounds.north - bounds.south) / 3.0;
  return {request, place, TileGrid::make(TileShape::make(68, 75, 3), 3, 3, extent, extent)};
}

std::vector<Scene> scenes() {
  return {
      make_scene("local", {6.0, 44.0, 7.0, 45.0}, 1200, 1200),
      make_scene("transverse-mercator", {-72.0, -40.0, -68.0, -20.0}, 400, 2000),
      make_scene("utm", {145.0, -36.0, 146.0, -35.0}, 1200, 1200),
      make_scene("lambert-conformal", {-10.0, 35.0, 30.0, 70.0}, 4000, 3500),
      make_scene("lambert-conformal", {178.0, 60.0, 184.0, 66.0}, 300, 300),
      make_scene("polar-stereographic", {-180.0, 60.0, 180.0, 90.0}, 1440, 120, true),
      make_scene("polar-stereographic", {0.0, -90.0, 90.0, -65.0}, 360, 100),
      make_scene("lambert-conformal", {-60.0, -30.0, -20.0, -4.0}, 1000, 800, false, {3396190.0, 169.8944}),
  };
}

/// visit(vertex, u, v) for every stored vertex of every tile.
template <typename Visit>
void visit_positions(const Scene& scene, const Visit& visit) {
  const SourceWarp warp(scene.grid, scene.place, 8.0);
  const TileShape& shape = scene.grid.shape();
  std::vector<double> u(static_cast<std::size_t>(shape.stored_vertex_count()));
  std::vector<double> v(u.size());
  for (std::int64_t tile = 0; tile < scene.grid.tile_count(); ++tile) {
    warp.positions(scene.grid.tile_at(tile), u, v);
    for (int r = 0; r < shape.rows(); ++r) {
      for (int c = 0; c < shape.columns(); ++c) {
        const auto i = static_cast<std::size_t>(r * shape.columns() + c);
        visit(scene.grid.lattice_vertex(scene.grid.tile_at(tile), {c, r}), u[i], v[i]);
      }
    }
  }
}

/// Compares the position of every vertex that matters with the projection's; at least one of `of_every` must.
void expect_close(const Scene& scene, std::int64_t of_every) {
  SCOPED_TRACE(scene.name);
  const ExactWarp exact(scene.place);
  double worst = 0.0;
  std::int64_t inside = 0;
  visit_positions(scene, [&](LatticeVertex vertex, double u, double v) {
    const SourcePosition at = exact.source_from_world(scene.grid.world_from_lattice(vertex));
    const bool matters = at.u >= -8.0 && at.u <= static_cast<double>(scene.place.width) + 7.0 && at.v >= -8.0 &&
                         at.v <= static_cast<double>(scene.place.height) + 7.0;
    if (!matters) return;
    ++inside;
    ASSERT_FALSE(std::isnan(u) || std::isnan(v)) << "vertex " << vertex.x << "," << vertex.z;
    worst = std::max(worst, std::abs(std::remainder(u - at.u, scene.place.columns_round())));
    worst = std::max(worst, std::abs(v - at.v));
  });
  EXPECT_LE(worst, SourceWarp::kTolerance);
  EXPECT_GT(inside, scene.grid.tile_count() * scene.grid.shape().stored_vertex_count() / of_every);
}

TEST(SourceWarp, PositionsAreWithinAHundredthOfASample) {
  for (const Scene& scene : scenes()) expect_close(scene, 8);
}

TEST(SourceWarp, PositionsAreWithinAHundredthOfASampleAnywhere) {
  const Ellipsoid mars{3396190.0, 169.894447223612};
  constexpr std::uint32_t kSeed = 20240617;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  for (const std::string kind : {"local", "transverse-mercator", "utm", "lambert-conformal", "polar-stereographic"}) {
    for (const bool on_mars : {false, true}) {
      for (int i = 0; i < 6; ++i) {
        const double size = between(0.3, 5.0);
        // The first ones lie at the antimeridian, the second ones as near to a pole as the kind goes.
        const double west = i == 0 ? 180.0 - size * between(0.2, 0.8) : between(-180.0, 180.0);
        const bool is_polar = kind == "polar-stereographic";
        const double most = is_polar ? 90.0 : 84.0;
        const double far = i == 1 ? most - size : between(is_polar ? 50.0 : 0.0, most - size);
        const bool in_south = random() % 2 == 0;
        const double south = in_south ? -far - size : far;
        const auto samples = static_cast<std::int64_t>(between(100.0, 3000.0));
        const GeoExtent ground{west, south, west + size, south + size};
        SCOPED_TRACE(::testing::Message() << (on_mars ? "Mars " : "Earth ") << west << " " << south << " " << size);
        if (kind == "utm" && on_mars) continue;  // of the Earth
        // Beside a pole the ground is a sliver of its square.
        expect_close(make_scene(kind, ground, samples, samples, false, on_mars ? mars : Ellipsoid{}), 100);
      }
    }
  }
}

TEST(SourceWarp, SharedVerticesHaveTheSameBitsInEveryTile) {
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    std::map<std::pair<std::int64_t, std::int64_t>, std::pair<std::uint64_t, std::uint64_t>> seen;
    visit_positions(scene, [&](LatticeVertex vertex, double u, double v) {
      const std::pair bits{std::bit_cast<std::uint64_t>(u), std::bit_cast<std::uint64_t>(v)};
      const auto [at, is_new] = seen.emplace(std::pair{vertex.x, vertex.z}, bits);
      ASSERT_EQ(at->second, bits) << vertex.x << "," << vertex.z;
    });
    EXPECT_LT(static_cast<std::int64_t>(seen.size()),
              scene.grid.tile_count() * scene.grid.shape().stored_vertex_count());
  }
}

TEST(SourceWarp, RowBoundsHoldAllVerticesOfARowOfTiles) {
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    const SourceWarp warp(scene.grid, scene.place, HUGE_VAL);
    std::vector<double> u(static_cast<std::size_t>(scene.grid.shape().stored_vertex_count()));
    std::vector<double> v(u.size());
    for (std::int64_t row = 0; row < scene.grid.tile_rows(); ++row) {
      const SourceWarp::RowBounds bounds = warp.row_bounds(row);
      for (std::int64_t column = 0; column < scene.grid.tile_columns(); ++column) {
        warp.positions({column, row}, u, v);
        for (const double at : v) {
          ASSERT_GE(at, bounds.least);
          ASSERT_LE(at, bounds.most);
        }
      }
    }
  }
}

TEST(ExactWarp, LeadsThereAndBackAcrossTheAntimeridian) {
  // Degrees that go on beyond 180, and the same ones counted from -180.
  for (const double west : {178.0, -182.0}) {
    const Scene scene = make_scene("lambert-conformal", {west, 60.0, west + 6.0, 66.0}, 300, 300);
    const ExactWarp exact(scene.place);
    for (const double u : {0.0, 100.0, 150.5, 299.0}) {
      for (const double v : {0.0, 17.25, 299.0}) {
        const SourcePosition back = exact.source_from_world(exact.world_from_source({u, v}));
        EXPECT_NEAR(back.u, u, 1e-7);
        EXPECT_NEAR(back.v, v, 1e-7);
      }
    }
    EXPECT_GT(exact.world_from_source({299.0, 150.0}).x, exact.world_from_source({0.0, 150.0}).x);
  }
}

}  // namespace
}  // namespace isohf
