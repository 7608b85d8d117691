#include "isohf/lattice/planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <vector>

#include "isohf/lattice/stitch.h"
#include "isohf/lattice/strip.h"
#include "lattice/mesh_check.h"
#include "lattice/vertex_below.h"

namespace isohf {
namespace {

using namespace test;

std::string name_of(const Planes& planes) {
  const TileGrid& grid = planes.grid(0);
  return std::to_string(grid.shape().columns()) + "x" + std::to_string(grid.shape().rows()) + ", " +
         std::to_string(grid.tile_columns()) + "x" + std::to_string(grid.tile_rows()) + " tiles, stride " +
         std::to_string(planes.stride());
}

/// Small shapes with every stride that they allow, on grids whose last coarse tiles are whole and cut.
std::vector<Planes> small_planes(int most_columns, int most_rows) {
  std::vector<Planes> all;
  for (const TileShape& shape : deepest_shapes(most_columns, most_rows)) {
    for (int stride = 2; stride < 1 << shape.levels(); stride *= 2) {
      for (const auto& [columns, rows] : {std::pair{stride, 1}, {stride + 1, stride - 1}, {2 * stride, 3 * stride}}) {
        const TileGrid grid = TileGrid::make(shape, columns, rows, 1.0, 1.0);
        for (const bool wraps : {false, true}) all.emplace_back(grid, stride, plane_count(grid, stride), wraps);
      }
    }
  }
  return all;
}

LatticeVertex operator*(std::int64_t factor, LatticeVertex v) {
  return {factor * v.x, factor * v.z};
}

TEST(Planes, StrideIsTheLargestThatTheShapeAllows) {
  EXPECT_EQ(plane_stride(TileShape::make(212, 243, 4)), 8);
  EXPECT_EQ(plane_stride(TileShape::make(212, 243, 1)), 8);  // levels aren't asked
  EXPECT_EQ(plane_stride(TileShape::make(16, 19, 2)), 4);
  EXPECT_EQ(plane_stride(TileShape::make(12, 11, 2)), 4);
  EXPECT_EQ(plane_stride(TileShape::make(10, 15, 2)), 0);
}

TEST(Planes, EndWithOneTile) {
  const TileShape shape = TileShape::make(12, 19, 4);
  const auto count = [&](std::int64_t columns, std::int64_t rows) {
    return plane_count(TileGrid::make(shape, columns, rows, 1.0, 1.0), 8);
  };
  EXPECT_EQ(count(1, 1), 0);
  EXPECT_EQ(count(1, 2), 1);
  EXPECT_EQ(count(8, 8), 1);
  EXPECT_EQ(count(9, 1), 2);
  EXPECT_EQ(count(64, 65), 3);
  const Planes planes(TileGrid::make(shape, 65, 9, 1.0, 2.0), 8, 3, false);
  EXPECT_EQ(planes.grid(1), TileGrid::make(shape, 9, 2, 8.0, 16.0));
  EXPECT_EQ(planes.grid(2), TileGrid::make(shape, 2, 1, 64.0, 128.0));
  EXPECT_EQ(planes.grid(3), TileGrid::make(shape, 1, 1, 512.0, 1024.0));
}

// The vertex below a coarse one is where its place says, visible and in an odd row; every coarse tile that stores it,
// as its own or as padding, finds the same one; and a plane finds it through the one below.
TEST(Planes, EachVertexIsOneOfTheTilesBelow) {
  for (const Planes& planes : small_planes(12, 19)) {
    const TileGrid& fine = planes.grid(0);
    const TileShape& shape = fine.shape();
    for (int plane = 1; plane <= planes.count(); ++plane) {
      const TileGrid& coarse = planes.grid(plane);
      for (std::int64_t t = 0; t < coarse.tile_count(); ++t) {
        for (std::int64_t i = 0; i < shape.stored_vertex_count(); ++i) {
          const GridVertex vertex = vertex_of(shape, static_cast<std::uint32_t>(i));
          const LatticeVertex v = coarse.lattice_vertex(coarse.tile_at(t), vertex);
          const test::TileVertex below = test::vertex_below(planes, plane, coarse.tile_at(t), vertex);
          ASSERT_TRUE(fine.contains(below.tile)) << name_of(planes);
          ASSERT_TRUE(is_visible(shape, below.vertex) && below.vertex.row % 2 == 1) << name_of(planes);
          ASSERT_EQ(fine.lattice_vertex(below.tile, below.vertex), planes.place(plane, v)) << name_of(planes);
          const LatticeVertex straight = planes.scale(plane) * v;
          const LatticeVertex end = {fine.tile_columns() * 2 * shape.cell_columns(),
                                     fine.tile_rows() * shape.cell_rows()};
          if (straight.x >= 0 && straight.x <= end.x && straight.z >= 0 && straight.z <= end.z) {
            ASSERT_EQ(planes.place(plane, v), straight) << name_of(planes);
          }
          const LatticeVertex between{planes.x_below(plane - 1, plane, v.x), planes.z_below(plane - 1, plane, v.z)};
          ASSERT_EQ(planes.place(plane - 1, between), planes.place(plane, v)) << name_of(planes);
        }
      }
    }
  }
}

TEST(Planes, VerticesFarBeyondTheTilesAreVoid) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 19, 4), 9, 9, 1.0, 1.0);  // 144 x 144
  const Planes planes(grid, 8, 2, false);
  EXPECT_FALSE(planes.is_beyond(1, {34, 26}));  // 8 steps of 2 and 1 behind 18
  EXPECT_TRUE(planes.is_beyond(1, {35, 26}));
  EXPECT_TRUE(planes.is_beyond(1, {34, 27}));
  EXPECT_FALSE(planes.is_beyond(1, {-2, -1}));
  EXPECT_FALSE(planes.is_beyond(0, {200, 200}));  // padding of tiles
}

TEST(Planes, PaddingOfAJoinedPlaneIsTheOtherEdges) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 19, 4), 64, 3, 1.0, 1.0);
  const Planes planes(grid, 8, 2, true);
  const std::int64_t width = 64 * 2 * 8;
  EXPECT_EQ(planes.place(1, {-1, 1}), (LatticeVertex{width - 8, 8}));
  EXPECT_EQ(planes.place(2, {17, 1}), (LatticeVertex{64, 48}));  // z moved to the last row
  const Planes cut(TileGrid::make(grid.shape(), 65, 3, 1.0, 1.0), 8, 3, true);
  EXPECT_EQ(cut.place(1, {-1, 1}), (LatticeVertex{0, 8}));
  EXPECT_EQ(cut.place(1, {131, 1}), (LatticeVertex{width + 16, 8}));
}

using PlaceTriangle = std::array<std::pair<std::int64_t, std::int64_t>, 3>;

/// Turned so that the least place is first: equal where place and winding are.
PlaceTriangle turned(PlaceTriangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// The triangles of a level of a whole plane, at their places in plane 0, but those without an area.
std::set<PlaceTriangle> mesh_of(const Planes& planes, int plane, int level) {
  std::set<PlaceTriangle> mesh;
  const TileGrid& grid = planes.grid(plane);
  const TileShape& shape = planes.mesh_shape();
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    for (const Triangle& t : triangles_of_strip(strip_indices(shape, level))) {
      PlaceTriangle places;
      for (std::size_t k = 0; k < 3; ++k) {
        const LatticeVertex v = planes.place(plane, grid.lattice_vertex(grid.tile_at(i), vertex_of(shape, t[k])));
        places[k] = {v.x, v.z};
      }
      const auto& [a, b, c] = places;
      const std::int64_t area =
          (b.second - a.second) * (c.first - a.first) - (b.first - a.first) * (c.second - a.second);
      EXPECT_GE(area, 0) << name_of(planes);
      if (area == 0) continue;
      for (const std::uint32_t index : t) {
        const LatticeVertex v = grid.lattice_vertex(grid.tile_at(i), vertex_of(shape, index));
        EXPECT_FALSE(planes.is_beyond(plane, v)) << name_of(planes);
      }
      EXPECT_TRUE(mesh.insert(turned(places)).second) << name_of(planes);
    }
  }
  return mesh;
}

/// Makes one triangle of the two that share the side from `at`, a vertex on an edge between tiles, to the tip.
void join_halves(std::set<PlaceTriangle>& mesh, const TileGrid& fine, std::int64_t scale, std::int64_t coarse_tile) {
  const std::int64_t width = scale * 2 * fine.shape().cell_columns();
  std::map<std::pair<std::pair<std::int64_t, std::int64_t>, std::pair<std::int64_t, std::int64_t>>,
           std::vector<PlaceTriangle>>
      halves;  // by vertex and tip
  for (const PlaceTriangle& t : mesh) {
    // Half of one at an inner edge: two vertices there, one above the other, and the third beside.
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& at = t[k];
      const auto& next = t[(k + 1) % 3];
      const auto& last = t[(k + 2) % 3];
      if (at.first % width != 0 || at.first % coarse_tile == 0) continue;
      if (next.first == at.first && last.second == at.second) halves[{at, next}].push_back(t);
      if (last.first == at.first && next.second == at.second) halves[{at, last}].push_back(t);
    }
  }
  for (const auto& [side, pair] : halves) {
    ASSERT_LE(pair.size(), 2U);
    if (pair.size() < 2) continue;  // beside the last tiles' edge
    PlaceTriangle whole{};
    std::vector<std::pair<std::int64_t, std::int64_t>> corners;
    for (const PlaceTriangle& t : pair) {
      mesh.erase(t);
      for (const auto& corner : t) {
        if (corner != side.first && corner != side.second) corners.push_back(corner);
      }
    }
    ASSERT_EQ(corners.size(), 2U);
    std::sort(corners.begin(), corners.end());
    const bool tip_north = side.second.second < side.first.second;
    whole = {side.second, tip_north ? corners[0] : corners[1], tip_north ? corners[1] : corners[0]};
    mesh.insert(turned(whole));
  }
}

TEST(Planes, LevelZeroIsTheLastLevelOfThePlaneBelow) {
  for (const Planes& planes : small_planes(20, 19)) {
    if (planes.grid(0).tile_count() > 100) continue;
    const std::int64_t cells = 2 * planes.grid(0).shape().cell_columns();
    for (int plane = 1; plane <= planes.count(); ++plane) {
      std::set<PlaceTriangle> fine =
          mesh_of(planes, plane - 1, std::countr_zero(static_cast<unsigned>(planes.stride())));
      ASSERT_NO_FATAL_FAILURE(join_halves(fine, planes.grid(0), planes.scale(plane - 1), planes.scale(plane) * cells));
      ASSERT_EQ(mesh_of(planes, plane, 0), fine) << name_of(planes) << " plane " << plane;
    }
  }
}

/// Which tiles are drawn: of the plane that `refined` says for each coarsest tile.
struct Drawn {
  int plane;
  TileIndex tile;
  int level;
};

class Cut {
 public:
  explicit Cut(const Planes& planes) : planes_(planes) {}

  void draw(const Drawn& drawn) { drawn_.push_back(drawn); }

  /// The sum of all triangles: strips, stitch lists, and one-sided lists beside coarser tiles.
  std::vector<Edge> border() {
    EdgeChain chain;
    for (const Drawn& drawn : drawn_) {
      const TileShape& shape = planes_.mesh_shape();
      for (const Triangle& t : triangles_of_strip(strip_indices(shape, drawn.level))) {
        if (!repeats_a_vertex(t)) add(chain, drawn, t);
      }
      const std::vector<std::uint32_t> stitch = stitch_indices(shape);
      for (const Triangle& t : triangles_of_list(
               std::span(stitch).first(static_cast<std::size_t>(shape.stitch_index_count(drawn.level))))) {
        add(chain, drawn, t);
      }
      const std::pair<TileSide, TileIndex> beside[] = {{TileSide::kWest, {-1, 0}},
                                                       {TileSide::kEast, {1, 0}},
                                                       {TileSide::kNorth, {0, -1}},
                                                       {TileSide::kSouth, {0, 1}}};
      for (const auto& [side, step] : beside) {
        const TileIndex next{drawn.tile.column + step.column, drawn.tile.row + step.row};
        if (!planes_.grid(drawn.plane).contains(next) || !has(drawn.plane + 1, planes_.above(next))) continue;
        for (const Triangle& t : triangles_of_list(side_stitch_indices(shape, side, planes_.stride()))) {
          add(chain, drawn, t);
        }
      }
    }
    return chain.remaining();
  }

 private:
  [[nodiscard]] bool has(int plane, TileIndex tile) const {
    return std::any_of(drawn_.begin(), drawn_.end(),
                       [&](const Drawn& drawn) { return drawn.plane == plane && drawn.tile == tile; });
  }
  void add(EdgeChain& chain, const Drawn& drawn, const Triangle& t) const {
    Triangle places{};
    for (std::size_t k = 0; k < 3; ++k) {
      const LatticeVertex v = planes_.place(
          drawn.plane, planes_.grid(drawn.plane).lattice_vertex(drawn.tile, vertex_of(planes_.mesh_shape(), t[k])));
      places[k] = static_cast<std::uint32_t>(v.x + 65536 * v.z);
    }
    chain.add(places);
  }

  const Planes& planes_;
  std::vector<Drawn> drawn_;
};

/// Edges that are left on the rim of everything, and those inside.
void expect_closed(const Planes& planes, const std::vector<Edge>& border, const std::string& what) {
  const TileGrid& grid = planes.grid(0);
  const auto width = static_cast<std::uint32_t>(grid.tile_columns() * 2 * grid.shape().cell_columns());
  const auto height = static_cast<std::uint32_t>(grid.tile_rows() * grid.shape().cell_rows());
  std::int64_t around = 0;
  for (const auto& [from, to] : border) {
    const std::array<std::uint32_t, 4> x_and_z = {from % 65536, from / 65536, to % 65536, to / 65536};
    const auto [x0, z0, x1, z1] = x_and_z;
    const bool on_rim = (x0 == x1 && (x0 == 0 || x0 == width)) || (z0 == z1 && (z0 == 0 || z0 == height));
    ASSERT_TRUE(on_rim) << name_of(planes) << what << ": " << x0 << "," << z0 << " - " << x1 << "," << z1;
    around += std::abs(std::int64_t{x1} - x0) + std::abs(std::int64_t{z1} - z0);
  }
  ASSERT_EQ(around, 2 * (std::int64_t{width} + height)) << name_of(planes) << what;
}

// 2 x 2 tiles of plane 1 and part of a third, each drawn itself or by its tiles: every way in which tiles of two planes
// meet, at sides and at corners. No edge is left inside.
TEST(Planes, TilesOfTwoPlanesMeetWithoutTJunctions) {
  for (const TileShape& shape : {TileShape::make(12, 11, 2), TileShape::make(8, 7, 2), TileShape::make(12, 19, 4)}) {
    const int stride = plane_stride(shape) == 0 ? 2 : plane_stride(shape);
    const TileGrid grid = TileGrid::make(shape, 2 * stride + 1, 2 * stride, 1.0, 1.0);
    const Planes planes(grid, stride, 1, false);
    const TileGrid& coarse = planes.grid(1);
    const int levels = planes.mesh_shape().levels();
    for (int refined = 0; refined < 1 << coarse.tile_count(); ++refined) {
      Cut cut(planes);
      for (std::int64_t i = 0; i < coarse.tile_count(); ++i) {
        const TileIndex tile = coarse.tile_at(i);
        if ((refined >> i & 1) == 0) {
          cut.draw({1, tile, static_cast<int>(i + refined) % levels});
          continue;
        }
        const TileRange below = planes.below(1, tile);
        for (std::int64_t r = below.first.row; r < below.end.row; ++r) {
          for (std::int64_t c = below.first.column; c < below.end.column; ++c) {
            cut.draw({0, {c, r}, static_cast<int>(r + c + refined) % levels});
          }
        }
      }
      ASSERT_NO_FATAL_FAILURE(expect_closed(planes, cut.border(), ", refined " + std::to_string(refined)));
    }
  }
}

TEST(Planes, TilesOfThreePlanesMeetWithoutTJunctions) {
  const TileGrid grid = TileGrid::make(TileShape::make(8, 7, 2), 7, 7, 1.0, 1.0);
  const Planes planes(grid, 2, 2, false);
  Cut cut(planes);
  for (const TileIndex tile : {TileIndex{1, 0}, {0, 1}, {1, 1}}) cut.draw({2, tile, 1});
  for (const TileIndex tile : {TileIndex{1, 0}, {0, 1}, {1, 1}}) cut.draw({1, tile, 0});
  for (const TileIndex tile : {TileIndex{0, 0}, {1, 0}, {0, 1}, {1, 1}}) cut.draw({0, tile, 0});
  expect_closed(planes, cut.border(), "");
}

TEST(Planes, SideListsArePartsOfTheStitchListsWoundTheOtherWay) {
  for (const TileShape& shape : deepest_shapes(24, 35)) {
    if (shape.levels() == 1) continue;  // no stride of theirs is a plane's
    std::set<Triangle> stitches;
    for (const Triangle& t : triangles_of_list(stitch_indices(shape))) stitches.insert(t);
    std::size_t sides = 0;
    const int stride = 1 << (shape.levels() - 1);
    for (const TileSide side : {TileSide::kWest, TileSide::kEast, TileSide::kNorth, TileSide::kSouth}) {
      for (Triangle t : triangles_of_list(side_stitch_indices(shape, side, stride))) {
        const bool is_one = stitches.count({t[0], t[2], t[1]}) + stitches.count({t[1], t[0], t[2]}) +
                                stitches.count({t[2], t[1], t[0]}) ==
                            1;
        ASSERT_TRUE(is_one);
        ++sides;
      }
    }
    ASSERT_EQ(sides, stitches.size());
  }
}

TEST(Planes, LevelsRunThroughAllPlanes) {
  const Planes planes(TileGrid::make(TileShape::make(12, 19, 4), 64, 64, 1.0, 1.0), 8, 2, false);
  EXPECT_EQ(planes.levels(), 10);
  const Planes none(planes.grid(0), 0, 0, false);
  EXPECT_EQ(none.levels(), 4);
}

TEST(Planes, CoarsestPlaneThatIsFineEnough) {
  const Planes planes(TileGrid::make(TileShape::make(12, 19, 4), 64, 64, 8.0, 16.0), 8, 2, false);  // steps of 1 and 1
  EXPECT_EQ(planes.plane_for_spacing(7.9, 100.0), 0);
  EXPECT_EQ(planes.plane_for_spacing(8.0, 8.0), 1);
  EXPECT_EQ(planes.plane_for_spacing(100.0, 63.0), 1);
  EXPECT_EQ(planes.plane_for_spacing(1e9, 1e9), 2);
}

}  // namespace
}  // namespace isohf
