#include "renderer.h"

#include <algorithm>
#include <array>
#include <random>

#include "camera.h"
#include "gl/offscreen.h"
#include "gl_test.h"
#include "memory_tiles.h"
#include "paging/tile_box.h"
#include "session.h"

namespace isohf::view {
namespace {

class RendererTest : public test::GlTest {};

TileGrid small_grid() {
  return TileGrid::make(TileShape::make(68, 83, 4), 4, 3, 640.0, 640.0);
}

/// Green ground, and what draws it.
struct DrawnGround {
  explicit DrawnGround(const test::MemoryTiles& source)
      : shared(source.grid().shape(), make_index_arrays(source.grid().shape())),
        box(source, shared, {}, workers),
        renderer(source, shared) {
    renderer.set_palette({{0.0, 90, 160, 80}}, 0.0, 1.0);
  }

  const SharedGeometry shared;
  Workers workers{2};
  TileBox box;
  Renderer renderer;
};

TEST_F(RendererTest, DrawsEveryVisibleTile) {
  const test::MemoryTiles source(small_grid());
  DrawnGround scene(source);
  TileBox& box = scene.box;
  Renderer& renderer = scene.renderer;
  ViewState view;
  view.width = 640;
  view.height = 360;
  const Camera camera = overview_camera(source, view);
  view.eye = camera.eye;
  view.forward = camera.forward();
  view.far_distance = 1.2 * farthest_corner(source.grid(), whole_bounds(source), view.eye, 1.0);
  box.finish({view.eye.x, view.eye.z}, view.far_distance);
  Offscreen target(view.width, view.height, GL_RGBA8);
  for (const double level : {0.0, 0.3, 1.0, 1.7, 3.0}) {
    view.fixed_level = level;
    const FrameFigures figures = renderer.draw(view, box.range(), [&](PlaneTile at) { return box.resident(at.tile); });
    EXPECT_EQ(figures.visible_tiles, 12);
    EXPECT_EQ(figures.absent_tiles, 0);
    check_gl("drawing");
  }
  const auto pixels = target.read_rgba8();
  std::size_t green = 0;  // the lowland colours: the terrain is there
  for (std::size_t i = 0; i < pixels.size(); i += 4) green += pixels[i + 1] > pixels[i + 2] ? 1 : 0;
  EXPECT_GT(green, pixels.size() / 4 / 10);
}

/// A void vertex stands as high as its code says, and what its triangles would show is left out, also in pixels of which
/// they touch a sample.
TEST_F(RendererTest, NothingOfVoidsIsSeenInTheSky) {
  const auto holes = [](TileIndex tile, std::vector<std::uint16_t>& codes) {
    std::mt19937 random(static_cast<unsigned>(tile.column + 10 * tile.row));
    for (std::uint16_t& code : codes) code = random() % 30 == 0 ? 65535 : 200;
  };
  const auto level = [](TileIndex, std::vector<std::uint16_t>& codes) { std::fill(codes.begin(), codes.end(), 200); };
  const auto drawn = [](const test::MemoryTiles& source, bool has_ground) {
    DrawnGround scene(source);
    TileBox& box = scene.box;
    ViewState view;
    view.width = 320;
    view.height = 200;
    Camera camera;
    camera.look_at({1280.0, 20.0, 2400.0}, {1280.0, 60.0, 600.0});
    view.eye = camera.eye;
    view.forward = camera.forward();
    view.far_distance = 6000.0;
    view.fixed_level = 0.0;
    box.finish({view.eye.x, view.eye.z}, view.far_distance);
    const Offscreen target(view.width, view.height, GL_RGBA8, kPictureSamples);
    scene.renderer.draw(view, box.range(), [&](PlaneTile at) { return has_ground ? box.resident(at.tile) : nullptr; });
    return target.read_rgba8();
  };
  const test::MemoryTiles smooth(small_grid(), level);
  const std::vector<std::uint8_t> sky = drawn(smooth, false);
  const std::vector<std::uint8_t> ground = drawn(smooth, true);
  const std::vector<std::uint8_t> found = drawn(test::MemoryTiles(small_grid(), holes), true);
  const auto first = std::mismatch(sky.begin(), sky.end(), ground.begin()).first - sky.begin();
  const auto whole_rows = first / (4 * 320) * (4 * 320);
  EXPECT_GT(whole_rows, 4 * 320 * 30) << "rows of sky above all ground";
  EXPECT_LT(first, static_cast<std::ptrdiff_t>(sky.size())) << "there is ground";
  EXPECT_TRUE(std::equal(sky.begin(), sky.begin() + whole_rows, found.begin()));
}

TEST_F(RendererTest, OverviewsHaveAllCornersInView) {
  const test::MemoryTiles source(small_grid());
  const WorldBounds ground = source.covered();
  const TileBounds whole = whole_bounds(source);
  for (const auto& [width, height] : {std::pair{640, 360}, std::pair{300, 500}, std::pair{200, 80}}) {
    ViewState view;
    view.width = width;
    view.height = height;
    const Camera camera = overview_camera(source, view);
    PicturePoint low{1e9, 1e9};
    PicturePoint high{-1e9, -1e9};
    for (int corner = 0; corner < 8; ++corner) {
      const auto at = project(
          camera, view, box_corner({ground.x0, whole.low, ground.z0}, {ground.x1, whole.high, ground.z1}, corner));
      ASSERT_TRUE(at);
      low = {std::min(low.x, at->x), std::min(low.y, at->y)};
      high = {std::max(high.x, at->x), std::max(high.y, at->y)};
    }
    EXPECT_NEAR(low.x, width - high.x, 2.0) << "in the middle";
    EXPECT_NEAR(low.y, height - high.y, 2.0) << "in the middle";
    EXPECT_GT(low.x, 0.0) << width;
    EXPECT_GT(low.y, 0.0) << width;
  }
}

TEST_F(RendererTest, HasTheSkyOfTheBody) {
  const auto zenith = [](const std::string& body) {
    test::MemoryTiles source(small_grid());
    source.set_body(body);
    Options options;
    options.view.width = 32;
    options.view.height = 32;
    options.sun.elevation_deg = 20.0;
    options.position = Vec3{100.0, 500.0, 100.0};
    options.look_at = Vec3{100.0, 600.0, 90.0};
    Session session(source, options);
    const Offscreen target(32, 32, GL_RGBA8);
    session.complete_frame();
    const auto pixels = target.read_rgba8();
    return std::array<int, 3>{pixels[0], pixels[1], pixels[2]};
  };
  EXPECT_GT(zenith("Earth")[2], zenith("Earth")[0] + 30) << "blue";
  EXPECT_EQ(zenith(""), zenith("Earth"));
  EXPECT_GT(zenith("Mars")[0], zenith("Mars")[2] + 20) << "dust";
  EXPECT_LT(zenith("Moon")[2], 60) << "no air";
}

/// From a sun anywhere, but none at night.
TEST_F(RendererTest, DrawsShadowsIfTheyAreWanted) {
  const test::MemoryTiles source(small_grid());
  const auto picture = [&](double azimuth_deg, double elevation_deg, bool shadows) {
    Options options;
    options.view.width = 160;
    options.view.height = 120;
    options.exaggeration = 4.0;
    options.sun.azimuth_deg = azimuth_deg;
    options.sun.elevation_deg = elevation_deg;
    Session session(source, options);
    session.shadows = shadows;
    const Offscreen target(160, 120, GL_RGBA8);
    session.complete_frame();
    return target.read_rgba8();
  };
  for (const double azimuth_deg : {90.0, 180.0, 200.0}) {
    EXPECT_NE(picture(azimuth_deg, 6.0, true), picture(azimuth_deg, 6.0, false)) << azimuth_deg;
  }
  EXPECT_EQ(picture(90.0, -3.0, true), picture(90.0, -3.0, false));
}

TEST_F(RendererTest, DrawsWhatLiesOnTheShoreInTheColourOfTheSea) {
  // All at 0 but a hill, which makes a colour of the palette wide.
  const test::MemoryTiles source(small_grid(), [](TileIndex tile, std::vector<std::uint16_t>& codes) {
    std::fill(codes.begin(), codes.end(), tile == TileIndex{0, 0} ? std::uint16_t{60000} : std::uint16_t{10000});
  });
  Options options;
  options.view.width = 160;
  options.view.height = 120;
  options.position = Vec3{1920.0, 500.0, 1300.0};
  options.look_at = Vec3{1920.0, 0.0, 1299.0};
  Session session(source, options);
  const TileBounds whole = whole_bounds(source);
  session.renderer().set_palette(
      {{-20.0, 20, 40, 200}, {0.001, 20, 40, 200}, {0.001, 20, 200, 40}, {100.0, 20, 200, 40}}, whole.low, whole.high);
  const Offscreen target(160, 120, GL_RGBA8);
  session.complete_frame();
  const auto pixels = target.read_rgba8();
  for (std::size_t i = 0; i < pixels.size(); i += 4) ASSERT_GT(pixels[i + 2], pixels[i + 1]) << i / 4;
}

/// The largest change of any pixel between small steps of level, compared with that between whole levels.
TEST_F(RendererTest, FadesBetweenLevelsWithoutJumps) {
  // Low, and southwards: hills cover hills, and strips run from near to far.
  const test::MemoryTiles source(small_grid());
  Options options;
  options.view.width = 320;
  options.view.height = 240;
  options.exaggeration = 3.0;
  options.position = Vec3{1200.0, 140.0, 100.0};
  options.look_at = Vec3{1300.0, 60.0, 900.0};
  Session session(source, options);
  const Offscreen target(320, 240, GL_RGBA8);
  constexpr std::size_t kSteps = 16;  // a level
  std::vector<std::vector<std::uint8_t>> pictures;
  for (std::size_t i = 0; i <= 2 * kSteps; ++i) {
    session.view.fixed_level = static_cast<double>(i) / kSteps;
    target.bind();
    session.complete_frame();
    pictures.push_back(target.read_rgba8());
  }
  struct Change {
    int largest = 0;
    double mean = 0.0;
  };
  const auto between = [&](std::size_t from, std::size_t to) {
    Change change;
    for (std::size_t i = 0; i < pictures[from].size(); ++i) {
      const int off = std::abs(pictures[from][i] - pictures[to][i]);
      change.largest = std::max(change.largest, off);
      change.mean += off / (0.75 * static_cast<double>(pictures[from].size()));  // alpha never differs
    }
    return change;
  };
  for (const std::size_t first : {std::size_t{0}, kSteps}) {
    const Change whole = between(first, first + kSteps);
    double away = 0.0;
    for (std::size_t i = first; i < first + kSteps; ++i) {
      const Change step = between(i, i + 1);
      EXPECT_LT(2 * step.largest, whole.largest) << i;
      EXPECT_LT(2 * step.mean, whole.mean) << i;
      // Rounding to 8 bits alone may take a picture back by a little.
      EXPECT_GT(between(first, i + 1).mean, away - 0.05) << i;
      away = between(first, i + 1).mean;
    }
    // Nothing changes places at β = ½, where the meshes change order: a step like those beside it.
    const std::size_t half = first + kSteps / 2;
    const int beside = std::max(between(half - 2, half - 1).largest, between(half, half + 1).largest);
    EXPECT_LE(between(half - 1, half).largest, beside + beside / 2 + 2);
  }
}

TEST(Camera, LooksStraightDownWithNorthUp) {
  Camera camera;
  camera.heading_rad = 2.0;
  camera.look_at({100.0, 5000.0, 100.0}, {100.0, 0.0, 100.0});
  EXPECT_EQ(camera.heading_rad, 0.0);
  camera.look_at({100.0, 5000.0, 100.0}, {101.0, 0.0, 100.0});
  EXPECT_GT(camera.heading_rad, 1.5) << "East is looked at";
}

}  // namespace
}  // namespace isohf::view
