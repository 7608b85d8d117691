#include "isohf/archive/tile_statistics.h"
#include "isohf/archive/tile/tile_codes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace isohf {
namespace {

/// 3 x 2 tiles of 12 x 11; the source ends within the last ones.
Metadata metadata(double x1, double z1, CodeType type) {
  Metadata made(TileGrid::make(TileShape::make(12, 11, 1), 3, 2, 8.0, 8.0));
  made.valid = {0.0, 0.0, x1, z1};
  made.quantisation = type == CodeType::kF32 ? Quantisation{type, 0.0, 1.0} : Quantisation{type, 10.0, 0.5};
  return made;
}

/// Codes that tell where they are: the vertex's lattice x and z, and every seventh a void.
std::int64_t code_of(LatticeVertex vertex) {
  return (vertex.x + 3) * 40 + vertex.z + 3;
}
bool is_void(LatticeVertex vertex) {
  return code_of(vertex) % 7 == 0;
}

TileStatistics all_tiles(const Metadata& about) {
  const CountedVertices counted(about);
  const TileGrid& grid = about.grid;
  TileStatistics sum;
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    TileCodes tile = void_tile(grid.shape(), about.quantisation);
    for (int row = 0; row < grid.shape().rows(); ++row) {
      for (int column = 0; column < grid.shape().columns(); ++column) {
        const LatticeVertex vertex = grid.lattice_vertex(grid.tile_at(i), {column, row});
        const auto at = static_cast<std::size_t>(row * grid.shape().columns() + column);
        if (is_void(vertex)) continue;
        if (tile.type == CodeType::kF32) tile.heights[at] = static_cast<float>(code_of(vertex));
        if (tile.type != CodeType::kF32) tile.codes[at] = static_cast<std::uint16_t>(code_of(vertex));
      }
    }
    const TileStatistics found = tile_statistics(counted, grid.tile_at(i), tile, about.quantisation);
    EXPECT_EQ(counted.of_tile(grid.tile_at(i)), found.vertices) << i;
    sum.vertices += found.vertices;
    sum.voids += found.voids;
    sum.sum += found.sum;
    sum.min = std::min(sum.min, found.min);
    sum.max = std::max(sum.max, found.max);
  }
  return sum;
}

TEST(TileStatistics, CountEveryVertexOnTheSourcesGroundOnce) {
  for (const CodeType type : {CodeType::kU16, CodeType::kF32}) {
    for (const auto& [x1, z1] : {std::pair{24.0, 16.0}, {19.3, 11.9}, {20.0, 8.0}, {0.4, 0.4}}) {
      SCOPED_TRACE(testing::Message() << to_string(type) << " " << x1 << " " << z1);
      const Metadata about = metadata(x1, z1, type);
      const TileGrid& grid = about.grid;
      // The definition: all visible vertices by their place on the lattice, each but once.
      std::set<std::pair<std::int64_t, std::int64_t>> seen;
      TileStatistics wanted;
      for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
        for (int row = 0; row < grid.shape().rows(); ++row) {
          for (int column = 0; column < grid.shape().columns(); ++column) {
            if (!is_visible(grid.shape(), {column, row})) continue;
            const LatticeVertex vertex = grid.lattice_vertex(grid.tile_at(i), {column, row});
            const WorldPoint place = grid.world_from_lattice(vertex);
            if (place.x > x1 || place.z > z1 || !seen.insert({vertex.x, vertex.z}).second) continue;
            ++wanted.vertices;
            wanted.voids += is_void(vertex) ? 1 : 0;
            if (is_void(vertex)) continue;
            const double elevation =
                about.quantisation.offset + about.quantisation.scale * static_cast<double>(code_of(vertex));
            wanted.sum += elevation;
            wanted.min = std::min(wanted.min, elevation);
            wanted.max = std::max(wanted.max, elevation);
          }
        }
      }
      const TileStatistics found = all_tiles(about);
      EXPECT_EQ(found.vertices, wanted.vertices);
      EXPECT_EQ(found.voids, wanted.voids);
      EXPECT_DOUBLE_EQ(found.sum, wanted.sum);
      EXPECT_EQ(found.min, wanted.min);
      EXPECT_EQ(found.max, wanted.max);
    }
  }
}

TEST(TileStatistics, TheEdgeOfAJoinedGlobeCountsOnce) {
  Metadata globe = metadata(24.0, 16.0, CodeType::kU16);
  const std::int64_t open = all_tiles(globe).vertices;
  globe.wraps_x = true;
  EXPECT_EQ(all_tiles(globe).vertices, open - 17) << "the first column of all rows is the last one";
}

}  // namespace
}  // namespace isohf
