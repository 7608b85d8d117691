#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hand_scene.h"
#include "isohf/lattice/barycentric.h"
#include "memory_tiles.h"

namespace isohf::test {
namespace {

using view::Camera;
using view::PicturePoint;
using view::Steering;
using view::Vec3;

TileGrid steered_grid() {
  return TileGrid::make(TileShape::make(28, 27, 3), 5, 4, 600.0, 600.0);
}

struct OwnTiles {
  explicit OwnTiles(const MemoryTiles::Alter& alter) : tiles(steered_grid(), alter) {}
  MemoryTiles tiles;
};

struct Scene : OwnTiles, HandScene {
  explicit Scene(const MemoryTiles::Alter& alter = {}) : OwnTiles(alter), HandScene(tiles, 8.0) {}
};

double barycentric_height(const MemoryTiles& tiles, WorldPoint at) {
  const TilePoint place = tiles.grid().locate(at);
  const TileShape& shape = tiles.grid().shape();
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(shape.stored_vertex_count()));
  tiles.read(place.tile, codes);
  std::vector<double> heights;
  for (const std::uint16_t code : codes) {
    heights.push_back(code == view::kVoidCode ? std::numeric_limits<double>::quiet_NaN()
                                              : tiles.scale().offset + tiles.scale().scale * code);
  }
  return interpolate(barycentric(shape, place.point),
                     View2D<const double>(heights.data(), shape.columns(), shape.rows()));
}

TEST(Ground, HeightsAreThoseOfTheTriangles) {
  Scene scene;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(0.0, steered_grid().world_width());
  std::uniform_real_distribution<double> z(0.0, steered_grid().world_height());
  for (int i = 0; i < 300; ++i) {
    const WorldPoint at{x(random), z(random)};
    const auto found = scene.ground.height(at);
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, barycentric_height(scene.tiles, at), 1e-9);
  }
}

/// The first point by brute force: small steps, then halving.
std::optional<double> first_meeting(const Scene& scene, Vec3 eye, Vec3 along, double step, double reach) {
  const auto above = [&](double t) {
    const Vec3 at = eye + t * along;
    if (!steered_grid().contains(WorldPoint{at.x, at.z})) return std::numeric_limits<double>::quiet_NaN();
    return at.y - scene.state.exaggeration * barycentric_height(scene.tiles, {at.x, at.z});
  };
  for (double t = step; t < reach; t += step) {
    double from = t - step;
    double to = t;
    if (!(above(from) * above(to) <= 0.0)) continue;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (from + to);
      (above(from) * above(middle) <= 0.0 ? to : from) = middle;
    }
    return to;
  }
  return std::nullopt;
}

TEST(Ground, ARayMeetsTheSurfaceWhereItFirstCrossesIt) {
  Scene scene;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int met = 0;
  for (int i = 0; i < 60; ++i) {
    const Vec3 eye{share(random) * steered_grid().world_width(), 900.0 + 900.0 * share(random),
                   share(random) * steered_grid().world_height()};
    const Vec3 along = normalised(Vec3{share(random) - 0.5, -0.9 * share(random), share(random) - 0.5});
    const auto expected = first_meeting(scene, eye, along, 4.0, 5000.0);
    const auto found = scene.ground.hit(eye, along, scene.state.exaggeration);
    ASSERT_EQ(found.has_value(), expected.has_value()) << "ray " << i;
    if (!found) continue;
    ++met;
    EXPECT_NEAR(length(*found - eye), *expected, 1e-6) << "ray " << i;
  }
  EXPECT_GT(met, 20);
}

TEST(Ground, ARayAlongARowASlantOrStraightDownMeetsTheSurface) {
  Scene scene;
  const double step = steered_grid().sigma_x();
  for (const Vec3 along :
       {Vec3{0.0, -1.0, 0.0}, Vec3{step, -4.0 * step, 0.0}, Vec3{0.0, -4.0 * step, step},
        Vec3{step, -4.0 * step, steered_grid().sigma_z()}, Vec3{-step, -4.0 * step, steered_grid().sigma_z()}}) {
    const Vec3 eye{1200.0, 1500.0, 12.0 * steered_grid().sigma_z()};
    const auto found = scene.ground.hit(eye, along, scene.state.exaggeration);
    ASSERT_TRUE(found) << along.x << " " << along.y << " " << along.z;
    EXPECT_NEAR(found->y, scene.state.exaggeration * barycentric_height(scene.tiles, {found->x, found->z}), 1e-6);
  }
}

TEST(Ground, ARayGoesThroughVoids) {
  Scene scene(
      [](TileIndex, std::vector<std::uint16_t>& codes) { std::fill(codes.begin(), codes.end(), view::kVoidCode); });
  EXPECT_FALSE(scene.ground.hit({100.0, 1e4, 100.0}, {0.0, -1.0, 0.0}, 1.0));
  EXPECT_FALSE(scene.ground.height({100.0, 100.0}));
}

TEST(Steering, TheWheelKeepsWhatIsUnderTheCursorThere) {
  Scene scene;
  const PicturePoint at{520.0, 340.0};
  const auto before = scene.hand.pick(at);
  ASSERT_TRUE(before);
  scene.hand.wheel(7.0, at);
  const PicturePoint after = scene.project(*before);
  EXPECT_NEAR(after.x, at.x, 1e-6);
  EXPECT_NEAR(after.y, at.y, 1e-6);
}

TEST(Steering, TurningKeepsTheGroundUnderTheCursorWhereItIs) {
  Scene scene;
  const PicturePoint at{700.0, 500.0};
  const auto held = scene.hand.pick(at);
  ASSERT_TRUE(held);
  const double heading = scene.camera.heading_rad;
  scene.hand.press(Steering::Drag::kOrbit, at);
  scene.hand.move({at.x + 90.0, at.y + 40.0});
  const PicturePoint now = scene.project(*held);
  EXPECT_NEAR(now.x, at.x, 1e-6);
  EXPECT_NEAR(now.y, at.y, 1e-6);
  // The scene follows the hand: dragged to the right, the viewer walks to the left and turns to the left with it.
  EXPECT_LT(std::remainder(scene.camera.heading_rad - heading, 6.283185307179586), 0.0);
}

TEST(Steering, ATurnEndsAtTheHorizonAndAboveTheGround) {
  for (const double x : {60.0, 640.0, 1200.0}) {
    for (const double y : {80.0, 360.0, 700.0}) {
      for (const double step : {5.0, 100.0, 400.0}) {
        Scene scene;
        const double lowest = scene.ground.whole().low * scene.state.exaggeration;
        for (double moved = 0.0; moved < 1200.0; moved += step) {
          scene.hand.press(Steering::Drag::kOrbit, {x, y});
          scene.hand.move({x + 0.3 * step, y - step});
          scene.hand.release();
          ASSERT_LE(scene.camera.pitch_rad, 1e-12) << x << " " << y << " " << moved;
          ASSERT_GE(scene.camera.eye.y, lowest + scene.hand.clearance()) << x << " " << y << " " << moved;
          ASSERT_GE(scene.height(), scene.hand.clearance() * 0.999) << x << " " << y << " " << moved;
        }
        // It went as far as it may.
        const bool is_low = scene.hand.height_above_ground() < 1.1 * scene.hand.clearance();
        EXPECT_TRUE(scene.camera.pitch_rad > -1e-9 || is_low) << x << " " << y << " " << scene.camera.pitch_rad;
      }
    }
  }
}

TEST(Steering, ADragUpFromBelowTheHorizonGoesBackTheSameWay) {
  Scene scene;
  const double pitch = scene.camera.pitch_rad;
  const PicturePoint at{640.0, 420.0};
  scene.hand.press(Steering::Drag::kOrbit, at);
  scene.hand.move({at.x, at.y - 60.0});
  EXPECT_GT(scene.camera.pitch_rad, pitch);
  scene.hand.move(at);
  EXPECT_NEAR(scene.camera.pitch_rad, pitch, 1e-12);
}

TEST(Steering, SpeedFollowsTheHeightAboveGround) {
  const auto way_from = [](double height) {
    Scene scene;
    const double ground = 8.0 * *scene.ground.height({1500.0, 1200.0});
    scene.camera.look_at({1500.0, ground + height, 1200.0}, {2500.0, ground + height, 1200.0});
    const Vec3 before = scene.camera.eye;
    scene.hand.update(0.01, {1.0, 0.0, 0.0}, 1.0);
    return length(scene.camera.eye - before);
  };
  EXPECT_NEAR(way_from(2000.0) / way_from(500.0), 4.0, 0.02);
}

TEST(Steering, GoingThereStopsShortOfTheGround) {
  Scene scene;
  for (int i = 0; i < 40; ++i) {
    scene.hand.approach({640.0, 400.0});
    for (int frame = 0; frame < 40; ++frame) scene.hand.update(0.02, {}, 1.0);
    ASSERT_GE(scene.height(), scene.hand.clearance() * 0.999);
  }
}

}  // namespace
}  // namespace isohf::test
