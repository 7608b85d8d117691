#include "paging/plane_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "camera.h"
#include "gl/offscreen.h"
#include "gl_test.h"
#include "memory_tiles.h"
#include "session.h"

namespace isohf::view {
namespace {

TileGrid wide_grid() {
  return TileGrid::make(TileShape::make(28, 27, 3), 37, 29, 600.0, 600.0);
}

/// The plane that each tile of plane 0 is drawn by; fails where one is drawn twice.
std::map<std::pair<std::int64_t, std::int64_t>, int> cover(const Planes& planes,
                                                           const std::vector<ChosenTile>& chosen) {
  std::map<std::pair<std::int64_t, std::int64_t>, int> plane_at;
  for (const ChosenTile& one : chosen) {
    const std::int64_t size = planes.scale(one.at.plane);
    for (std::int64_t row = one.at.tile.row * size; row < (one.at.tile.row + 1) * size; ++row) {
      for (std::int64_t column = one.at.tile.column * size; column < (one.at.tile.column + 1) * size; ++column) {
        if (!planes.grid(0).contains(TileIndex{column, row})) continue;
        EXPECT_TRUE(plane_at.emplace(std::pair(column, row), one.at.plane).second) << column << "," << row;
      }
    }
  }
  return plane_at;
}

TEST(PlaneChoice, DrawsEachPlaceOnceAndNeighboursAtMostOnePlaneApart) {
  const TileGrid grid = wide_grid();
  const Planes planes(grid, 4, plane_count(grid, 4), false);
  ASSERT_EQ(planes.count(), 3);
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    // Any wishes whatever, residency too.
    std::map<std::tuple<int, std::int64_t, std::int64_t>, bool> finer;
    std::map<std::tuple<int, std::int64_t, std::int64_t>, bool> resident;
    const auto draw = [&](auto& known, PlaneTile at, double share) {
      return known
          .try_emplace({at.plane, at.tile.column, at.tile.row}, static_cast<double>(random() % 1000) < 1000.0 * share)
          .first->second;
    };
    const PlaneWishes wishes{[](PlaneTile) { return true; }, [&](PlaneTile at) { return draw(finer, at, 0.8); },
                             [&](PlaneTile at) { return draw(resident, at, 0.995); }};
    const std::vector<ChosenTile> chosen = choose_tiles(planes, {{0, 0}, {1, 1}}, wishes);
    const auto plane_at = cover(planes, chosen);
    ASSERT_EQ(plane_at.size(), static_cast<std::size_t>(grid.tile_count()));
    for (const auto& [place, plane] : plane_at) {
      for (const auto& [dc, dr] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
        const auto beside = plane_at.find({place.first + dc, place.second + dr});
        if (beside != plane_at.end()) {
          ASSERT_LE(std::abs(beside->second - plane), 1);
        }
      }
    }
    for (const ChosenTile& one : chosen) {
      const std::int64_t size = planes.scale(one.at.plane);
      const std::array<std::pair<std::int64_t, std::int64_t>, 4> beside{
          {{one.at.tile.column * size - 1, one.at.tile.row * size},
           {(one.at.tile.column + 1) * size, one.at.tile.row * size},
           {one.at.tile.column * size, one.at.tile.row * size - 1},
           {one.at.tile.column * size, (one.at.tile.row + 1) * size}}};
      for (std::size_t side = 0; side < 4; ++side) {
        const auto found = plane_at.find(beside[side]);
        const bool is_coarser = found != plane_at.end() && found->second > one.at.plane;
        ASSERT_EQ((one.coarser_sides >> side & 1U) != 0, is_coarser) << "side " << side;
      }
    }
  }
}

TEST(PlaneChoice, WithoutPlanesDrawsTheTilesOfTheRange) {
  const TileGrid grid = wide_grid();
  const Planes planes(grid, 0, 0, false);
  const PlaneWishes wishes{[](PlaneTile at) { return at.tile.column != 3; }, [](PlaneTile) { return true; },
                           [](PlaneTile) { return false; }};
  EXPECT_EQ(choose_tiles(planes, {{2, 7}, {6, 9}}, wishes).size(), 6U);
}

/// The analytic surface with coarse planes, decimated vertex by vertex.
class MemoryPlanes final : public TileSource {
 public:
  explicit MemoryPlanes(const TileGrid& grid) : TileSource(facts_of(grid, test::MemoryTiles::kScale)), tiles_(grid) {
    const int stride = plane_stride(grid.shape());
    facts_.planes.emplace(grid, stride, plane_count(grid, stride), false);
    for (int plane = 1; plane <= planes()->count(); ++plane) coarse_.push_back(std::make_unique<Coarse>(*this, plane));
  }
  [[nodiscard]] TileBounds bounds(TileIndex tile) const override { return tiles_.bounds(tile); }
  void read(TileIndex tile, std::span<std::uint16_t> codes) const override { tiles_.read(tile, codes); }
  [[nodiscard]] const TileSource& plane(int plane) const override {
    if (plane == 0) return *this;
    return *coarse_[static_cast<std::size_t>(plane) - 1];
  }

 private:
  class Coarse final : public TileSource {
   public:
    Coarse(const MemoryPlanes& whole, int plane)
        : TileSource({whole.planes()->grid(plane), whole.scale(), whole.covered()}), whole_(whole), plane_(plane) {}
    [[nodiscard]] TileBounds bounds(TileIndex tile) const override {
      const TileRange range = whole_.planes()->below(plane_, tile);
      TileBounds all{false, 1e9, -1e9};
      for (std::int64_t row = range.first.row; row < range.end.row; ++row) {
        for (std::int64_t column = range.first.column; column < range.end.column; ++column) {
          const TileBounds one = whole_.plane(plane_ - 1).bounds({column, row});
          all = {true, std::min(all.low, one.low), std::max(all.high, one.high)};
        }
      }
      return all;
    }
    void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
      const TileGrid& own = grid();
      std::size_t i = 0;
      for (int row = 0; row < own.shape().rows(); ++row) {
        for (int column = 0; column < own.shape().columns(); ++column) {
          const LatticeVertex at = own.lattice_vertex(tile, {column, row});
          codes[i++] = whole_.planes()->is_beyond(plane_, at) ? kVoidCode
                                                              : test::analytic_code(whole_.planes()->place(plane_, at));
        }
      }
    }

   private:
    const MemoryPlanes& whole_;
    int plane_;
  };

  test::MemoryTiles tiles_;
  std::vector<std::unique_ptr<Coarse>> coarse_;
};

class PlanePictureTest : public test::GlTest {};

/// With planes a picture has the same ground as without them: no hole where tiles of two planes meet.
TEST_F(PlanePictureTest, HasNoHolesAndNoMoreTrianglesThanItNeeds) {
  const TileGrid grid = TileGrid::make(TileShape::make(28, 27, 3), 24, 20, 600.0, 600.0);
  const test::MemoryTiles plain(grid);
  const MemoryPlanes planes(grid);
  ASSERT_EQ(planes.planes()->count(), 3);
  for (const auto& [eye, target] : {std::pair{Vec3{2000.0, 900.0, 11000.0}, Vec3{9000.0, 0.0, 2000.0}},
                                    std::pair{Vec3{7000.0, 400.0, 6000.0}, Vec3{12000.0, 100.0, 1000.0}},
                                    std::pair{Vec3{7000.0, 9000.0, 15000.0}, Vec3{7200.0, 0.0, 6000.0}}}) {
    Options options;
    options.view.width = 480;
    options.view.height = 320;
    options.view.triangle_px = 60.0;
    options.exaggeration = 4.0;
    options.position = Vec3{eye.x, eye.y / 4.0, eye.z};
    options.look_at = Vec3{target.x, target.y / 4.0, target.z};
    options.memory_mib = 64;
    const auto picture = [&](const TileSource& source, FrameFigures& figures) {
      Session session(source, options);
      const Offscreen into(options.view.width, options.view.height, GL_RGBA8);
      into.bind();
      session.complete_frame();
      figures = session.figures();
      return into.read_rgba8();
    };
    FrameFigures without;
    FrameFigures with;
    const auto expected = picture(plain, without);
    const auto found = picture(planes, with);
    EXPECT_LT(with.triangles, without.triangles);
    EXPECT_EQ(with.absent_tiles, 0);
    // Away from the skyline, which coarser hills lower. The sky is bluer than it is red, shaded ground hardly.
    const auto is_sky = [&](const std::vector<std::uint8_t>& rgba, int x, int y) {
      const std::size_t at = 4 * (static_cast<std::size_t>(y) * 480 + static_cast<std::size_t>(x));
      return rgba[at + 2] > rgba[at] + 20;
    };
    int holes = 0;
    int ground = 0;
    for (int y = 12; y < 318; ++y) {
      for (int x = 2; x < 478; ++x) {
        bool all = true;
        for (int dy = -12; dy <= 2; ++dy) {
          for (int dx = -2; dx <= 2; ++dx) all = all && !is_sky(expected, x + dx, y + dy);
        }
        if (!all) continue;
        ++ground;
        holes += is_sky(found, x, y) ? 1 : 0;
      }
    }
    EXPECT_GT(ground, 20000);
    EXPECT_EQ(holes, 0);
  }
}

/// What lies before a short far distance is drawn as finely as without one.
TEST_F(PlanePictureTest, IsAsFineNearTheEyeWhereLessIsSeen) {
  const MemoryPlanes planes(TileGrid::make(TileShape::make(28, 27, 3), 24, 20, 600.0, 600.0));
  const auto finest = [&](std::optional<double> far_distance) {
    Options options;
    options.view.width = 480;
    options.view.height = 320;
    options.position = Vec3{7000.0, 100.0, 6000.0};
    options.look_at = Vec3{8000.0, 0.0, 5000.0};
    options.far_distance = far_distance;
    options.memory_mib = 64;
    Session session(planes, options);
    const Offscreen into(options.view.width, options.view.height, GL_RGBA8);
    session.complete_frame();
    std::set<std::pair<std::int64_t, std::int64_t>> tiles;
    for (const auto& [plane, tile] : session.renderer().drawn()) {
      const double x = (static_cast<double>(tile.column) + 0.5) * 600.0 - 7000.0;
      const double z = (static_cast<double>(tile.row) + 0.5) * 600.0 - 6000.0;
      if (plane == 0 && std::hypot(x, z) < 1200.0) tiles.insert({tile.column, tile.row});
    }
    return tiles;
  };
  EXPECT_GT(finest({}).size(), 2U);
  EXPECT_EQ(finest(2500.0), finest({}));
}

}  // namespace
}  // namespace isohf::view
