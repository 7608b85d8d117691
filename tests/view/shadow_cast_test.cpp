#include "paging/shadow_cast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "ground.h"
#include "isohf/lattice/shadow_path.h"
#include "memory_tiles.h"
#include "session.h"

namespace isohf::view {
namespace {

using test::MemoryTiles;
constexpr double kDegree = std::numbers::pi / 180.0;

TileGrid grid() {
  return TileGrid::make(TileShape::make(20, 19, 3), 5, 4, 160.0, 160.0);
}

/// A ground with a ridge here and there, a height for each place of the lattice.
void raise_ridges(const TileGrid& over, TileIndex tile, std::vector<std::uint16_t>& codes) {
  const TileShape& shape = over.shape();
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      const LatticeVertex at = over.lattice_vertex(tile, {c, r});
      const double x = 0.07 * static_cast<double>(at.x);
      const double z = 0.11 * static_cast<double>(at.z);
      const double height =
          std::sin(x + 0.4 * z) * std::cos(1.3 * z - 0.5 * x) + 0.4 * std::sin(3.1 * x) * std::sin(2.7 * z);
      codes[static_cast<std::size_t>(r * shape.columns() + c)] = static_cast<std::uint16_t>(15000.0 + 9000.0 * height);
    }
  }
}

std::vector<TileShadow> cast(const TileSource& source, const CastingSun& sun, const std::vector<TileIndex>& tiles,
                             std::string* unread = nullptr) {
  const std::atomic<bool> leaves{false};
  std::string nobody;
  return cast_shadows(source, sun, tiles, {}, leaves, unread != nullptr ? *unread : nobody);
}

/// Whether half of the sun and more is hidden from a vertex.
bool is_half_hidden(const TileShadow& shadow, std::size_t vertex) {
  return static_cast<float>(shadow.depths[vertex]) * shadow.gain >= 0.5F * 32767.0F;
}

/// Height at a place, world units; NaN beyond.
double height_at(Ground& ground, double x, double z) {
  return ground.height({x, z}).value_or(std::nan(""));
}

/// Whether a ray from there meets the ground.
bool is_dark(Ground& ground, double x, double z, const CastingSun& sun) {
  const double height = height_at(ground, x, z);
  const double step = 0.2 * grid().sigma_x();
  for (int n = 1;; ++n) {
    const double way = n * step;
    const double there =
        height_at(ground, x + way * std::sin(sun.azimuth_deg * kDegree), z - way * std::cos(sun.azimuth_deg * kDegree));
    if (std::isnan(there)) return false;
    if (there > height + way * std::tan(sun.elevation_deg * kDegree) + 1e-6) return true;
  }
}

// Vertices of all tiles, lit and dark as a ray from each says, but for those within a cell of a border.
TEST(CastShadows, AgreeWithRaysForSunsThatStandAnywhere) {
  const MemoryTiles source(grid(), [](TileIndex tile, auto& codes) { raise_ridges(grid(), tile, codes); });
  Ground ground(source);
  const TileShape& shape = source.grid().shape();
  std::vector<TileIndex> all;
  for (std::int64_t tile = 0; tile < source.grid().tile_count(); ++tile) all.push_back(source.grid().tile_at(tile));
  for (int azimuth = 0; azimuth < 360; azimuth += 24) {
    const CastingSun sun{azimuth + 3.0, azimuth % 72 == 0 ? 4.0 : 13.0};
    int wrong = 0;
    int compared = 0;
    int dark = 0;
    for (const TileShadow& shadow : cast(source, sun, all)) {
      for (int r = 1; r <= shape.rows() - 2; r += 2) {
        for (int c = 2; c < last_visible_column(shape, r); c += 3) {
          const WorldPoint at = source.grid().world_from_object(
              shadow.tile, {static_cast<double>(object_x(shape.columns(), c, r)), r - 1.0});
          const bool want = is_dark(ground, at.x, at.z, sun);
          const double cell = 2.0 * source.grid().sigma_x();
          bool on_border = false;
          for (const auto& [dx, dz] : {std::pair{cell, 0.0}, {-cell, 0.0}, {0.0, cell}, {0.0, -cell}}) {
            if (!std::isnan(height_at(ground, at.x + dx, at.z + dz))) {
              on_border = on_border || is_dark(ground, at.x + dx, at.z + dz, sun) != want;
            }
          }
          if (on_border) continue;
          ++compared;
          dark += want ? 1 : 0;
          wrong += is_half_hidden(shadow, static_cast<std::size_t>(r * shape.columns() + c)) != want ? 1 : 0;
        }
      }
    }
    EXPECT_GT(compared, 500) << azimuth;
    EXPECT_GT(dark, 30) << azimuth;
    EXPECT_LE(wrong, compared / 200) << azimuth;
  }
}

// A tile by itself has the shadows that it has among all others: casters are looked for as far as they may stand, and
// lines of light lie at the same places.
TEST(CastShadows, AreThoseOfAllTilesTogether) {
  const MemoryTiles source(grid(), [](TileIndex tile, auto& codes) { raise_ridges(grid(), tile, codes); });
  std::vector<TileIndex> all;
  for (std::int64_t tile = 0; tile < source.grid().tile_count(); ++tile) all.push_back(source.grid().tile_at(tile));
  for (int azimuth = 0; azimuth < 360; azimuth += 15) {
    const CastingSun sun{azimuth + 1.0, 11.0};
    for (const TileShadow& whole : cast(source, sun, all)) {
      const TileShadow own = std::move(cast(source, sun, {whole.tile}).front());
      EXPECT_EQ(own.gain, whole.gain);
      int differ = 0;
      int worst = 0;
      for (std::size_t i = 0; i < whole.depths.size(); ++i) {
        // In the sun a depth says how near a caster's line passes; beyond the tiles swept there is none.
        const int off = std::abs(std::max<int>(0, own.depths[i]) - std::max<int>(0, whole.depths[i]));
        worst = std::max(worst, off);
        differ += static_cast<double>(off) * static_cast<double>(whole.gain) > 0.05 * 32767.0 ? 1 : 0;
      }
      EXPECT_LE(differ, 2) << azimuth << " tile " << whole.tile.column << ',' << whole.tile.row << " worst " << worst;
    }
  }
}

TEST(CastShadows, ReadNoMoreThanMayCast) {
  const MemoryTiles source(grid());
  const TileRange one{{2, 2}, {3, 3}};
  const CastingLimits limits;
  // From high above only what is near.
  EXPECT_EQ(casting_range(source, {315.0, 89.0}, one, limits), (TileRange{{1, 1}, {4, 3}}));
  EXPECT_EQ(casting_range(source, {90.0, 89.0}, one, limits), (TileRange{{2, 2}, {4, 3}}));
  EXPECT_EQ(casting_range(source, {180.0, 0.1}, one, limits), (TileRange{{2, 2}, {3, 4}}));
  EXPECT_EQ(casting_range(source, {225.0, 0.1}, one, limits), (TileRange{{0, 2}, {4, 4}}));
  EXPECT_EQ(casting_range(source, {270.0, 0.1}, one, {2, 100}), (TileRange{{1, 2}, {3, 3}}));
  EXPECT_EQ(casting_range(source, {270.0, 0.1}, one, {100, 2}), (TileRange{{1, 2}, {3, 3}}));
}

TEST(CastShadows, SayWhatCouldNotBeRead) {
  MemoryTiles source(grid());
  source.set_heights([](TileIndex tile, std::span<float>) {
    if (tile == TileIndex{1, 2}) throw Error(ErrorCode::kCorrupt, "tile (1,2)");
  });
  std::string unread;
  EXPECT_EQ(cast(source, {270.0, 2.0}, {{2, 2}}, &unread).size(), 1U);
  EXPECT_EQ(unread, "tile (1,2)");
}

// Heights three times as high cast what true ones cast under a sun whose tangent is a third.
TEST(CastShadows, AreThoseOfTheHeightsThatAreDrawn) {
  const MemoryTiles source(grid(), [](TileIndex tile, auto& codes) { raise_ridges(grid(), tile, codes); });
  const double over_true_deg = std::atan(std::tan(20.0 * kDegree) / 3.0) / kDegree;
  auto drawn = casting_sun(123.0, 20.0, 3.0);
  ASSERT_TRUE(drawn);
  const TileShadow shadow = cast(source, *drawn, {{2, 2}}).front();
  // The sun's disc is that of the sun in the sky.
  const auto differ = [&](double elevation_deg) {
    const TileShadow other = cast(source, {123.0, elevation_deg}, {{2, 2}}).front();
    int count = 0;
    for (std::size_t i = 0; i < other.depths.size(); ++i) {
      count += is_half_hidden(other, i) != is_half_hidden(shadow, i) ? 1 : 0;
    }
    return count;
  };
  EXPECT_LE(differ(over_true_deg), 2);
  EXPECT_GT(differ(20.0), 20);
}

TEST(CastingSun, CastsNothingAtNightOrOverhead) {
  EXPECT_FALSE(casting_sun(90.0, -1.0, 1.0));
  EXPECT_FALSE(casting_sun(90.0, 0.0, 1.0));
  EXPECT_FALSE(casting_sun(90.0, 90.0, 1.0));
  EXPECT_FALSE(casting_sun(90.0, 89.8, 1.0));
  EXPECT_TRUE(casting_sun(0.0, 5.0, 1.0));
}

}  // namespace
}  // namespace isohf::view
