#include "verify/verify_view.h"

#include <gmock/gmock.h>

#include <cmath>

#include "gl_test.h"
#include "isohf/convert.h"
#include "memory_tiles.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf::view {
namespace {

using test::MemoryTiles;

TileGrid tiny_grid() {
  return TileGrid::make(TileShape::make(20, 27, 3), 3, 2, 480.0, 496.0);
}

std::string text_of(const ViewReport& report) {
  std::string text;
  for (const ViewFinding& finding : report.findings) {
    text += check_name(finding.id) + ", tile (" + std::to_string(finding.tile.column) + "," +
            std::to_string(finding.tile.row) + "), level " + std::to_string(finding.level) + ": " + finding.where +
            " [" + std::to_string(finding.count) + "]\n";
  }
  return text;
}

class VerifyViewTest : public test::GlTest {};

TEST_F(VerifyViewTest, PassesOnSoundTiles) {
  const MemoryTiles source(tiny_grid());
  const ViewReport report = verify_view(source, make_index_arrays(source.grid().shape()));
  EXPECT_TRUE(report.passed()) << text_of(report);
  EXPECT_EQ(report.tiles, 6);
  EXPECT_GT(report.shared_vertices, 450);
  EXPECT_EQ(report.suns_deg.size(), 4U);
  EXPECT_EQ(report.shadow_vertices, 4 * 2 * 6 * source.grid().shape().visible_vertex_count());
  EXPECT_EQ(report.worst_shadow, 0.0);
}

TEST_F(VerifyViewTest, PassesWhereTilesHaveVoids) {
  // A hole across a corner of four tiles, by world place so that all four agree, and one tile wholly void.
  const TileGrid grid = tiny_grid();
  const MemoryTiles source(grid, [&](TileIndex tile, std::vector<std::uint16_t>& codes) {
    for (int row = 0; row < grid.shape().rows(); ++row) {
      for (int column = 0; column < grid.shape().columns(); ++column) {
        const LatticeVertex at = grid.lattice_vertex(tile, {column, row});
        if (std::abs(at.x - 32) + std::abs(at.z - 24) < 7 || at.x > 63) {
          codes[static_cast<std::size_t>(row * grid.shape().columns() + column)] = kVoidCode;
        }
      }
    }
  });
  const ViewReport report = verify_view(source, make_index_arrays(grid.shape()));
  EXPECT_TRUE(report.passed()) << text_of(report);
  EXPECT_GT(report.shadow_vertices, 0);
}

TEST_F(VerifyViewTest, PassesOnOddShapes) {
  for (const auto& [columns, rows, levels] : {std::array{5, 5, 1}, std::array{6, 5, 1}, std::array{12, 11, 3}}) {
    const MemoryTiles source(TileGrid::make(TileShape::make(columns, rows, levels), 2, 2, 10.0, 10.0));
    const ViewReport report = verify_view(source, make_index_arrays(source.grid().shape()));
    EXPECT_TRUE(report.passed()) << columns << "x" << rows << "\n" << text_of(report);
  }
}

/// Every finding names the level at fault, and one of them is of the check that a person would look for.
void expect_found(const IndexArrays& arrays, int id, int level, const std::string& what) {
  const MemoryTiles source(tiny_grid());
  const ViewReport report = verify_view(source, arrays);
  EXPECT_FALSE(report.passed()) << what;
  const bool named = std::any_of(report.findings.begin(), report.findings.end(), [&](const ViewFinding& finding) {
    return finding.id == id && finding.level == level;
  });
  EXPECT_TRUE(named) << what << "\n" << text_of(report);
}

TEST_F(VerifyViewTest, FindsBrokenStrips) {
  const IndexArrays sound = make_index_arrays(tiny_grid().shape());
  for (int level = 0; level < 3; ++level) {
    const auto l = static_cast<std::size_t>(level);
    const std::size_t middle = sound.strips[l].size() / 2;
    IndexArrays broken = sound;
    // One of the repeated vertices at a row's end may happen to draw the same triangles; any other may not.
    for (std::size_t i = 1; i + 1 < sound.strips[l].size(); i += 1 + sound.strips[l].size() / 9) {
      if (sound.strips[l][i] == sound.strips[l][i - 1] || sound.strips[l][i] == sound.strips[l][i + 1]) continue;
      for (const int off : {-1, 1}) {
        broken = sound;
        broken.strips[l][i] += static_cast<std::uint32_t>(off);
        expect_found(broken, finding::kDrawnMesh, level, "index " + std::to_string(i) + " is off by one");
      }
    }
    broken = sound;
    broken.strips[l][middle + 5] += 1;
    expect_found(broken, finding::kDrawnHeight, level, "an index is one too large");
    broken = sound;
    broken.strips[l].resize(broken.strips[l].size() - 1);
    expect_found(broken, finding::kDrawnCoverage, level, "the last triangle is missing");
    broken = sound;
    broken.strips[l].insert(broken.strips[l].begin(), broken.strips[l].front());
    expect_found(broken, finding::kDrawnMesh, level, "all triangles face down");
    broken = sound;
    for (std::uint32_t& index : broken.strips[l]) index += static_cast<std::uint32_t>(tiny_grid().shape().columns());
    for (std::uint32_t& index : broken.strips[l]) index = std::min<std::uint32_t>(index, 20 * 27 - 1);
    expect_found(broken, finding::kDrawnCoverage, level, "all indices are one row too far South");
  }
}

TEST_F(VerifyViewTest, FindsSwappedStripsOfTwoLevels) {
  IndexArrays broken = make_index_arrays(tiny_grid().shape());
  std::swap(broken.strips[1], broken.strips[2]);
  expect_found(broken, finding::kDrawnHeight, 1, "level 1 draws the mesh of level 2");
}

TEST_F(VerifyViewTest, FindsBrokenStitches) {
  const IndexArrays sound = make_index_arrays(tiny_grid().shape());
  for (std::size_t triangle = 0; triangle < sound.stitch_counts[2] / 3; ++triangle) {
    IndexArrays broken = sound;
    broken.stitch[3 * triangle + 1] = broken.stitch[3 * triangle];
    const int level = 3 * triangle < sound.stitch_counts[1] ? 1 : 2;
    expect_found(broken, finding::kDrawnMesh, level, "stitch triangle " + std::to_string(triangle) + " is missing");
    broken = sound;
    std::swap(broken.stitch[3 * triangle + 1], broken.stitch[3 * triangle]);
    expect_found(broken, finding::kDrawnMesh, level, "stitch triangle " + std::to_string(triangle) + " faces away");
  }
  IndexArrays broken = sound;
  broken.stitch[4] += 1;
  expect_found(broken, finding::kDrawnMesh, 1, "a stitch triangle leaves the edge");
}

TEST_F(VerifyViewTest, FindsWhatWouldOpenCracks) {
  const IndexArrays sound = make_index_arrays(tiny_grid().shape());
  for (std::size_t level = 1; level < 3; ++level) {
    IndexArrays broken = sound;
    broken.stitch_counts[level] = 0;
    expect_found(broken, finding::kDrawnMesh, static_cast<int>(level), "a level has no stitch");
  }
  IndexArrays broken = sound;
  broken.strips[0].resize(broken.strips[0].size() - 3);
  expect_found(broken, finding::kDrawnMesh, 0, "the last triangles are missing");
}

void expect_tile_found(const MemoryTiles::Alter& alter, int id, const std::string& what) {
  const TileIndex bad{1, 1};
  const MemoryTiles source(tiny_grid(), [&](TileIndex tile, std::vector<std::uint16_t>& codes) {
    if (tile == bad) alter(tile, codes);
  });
  const ViewReport report = verify_view(source, make_index_arrays(source.grid().shape()));
  EXPECT_TRUE(std::any_of(report.findings.begin(), report.findings.end(),
                          [&](const ViewFinding& finding) { return finding.id == id; }))
      << what << "\n"
      << text_of(report);
  // A tile is found at fault when it meets its neighbours: by itself, or by the next one in order.
  for (const ViewFinding& finding : report.findings) {
    // Where only padding differs, another tile may see no more of it than the normals.
    EXPECT_THAT(finding.id, testing::AnyOf(id, finding::kNormal)) << what;
    EXPECT_TRUE(finding.tile == bad || finding.where.find("tile (1,1)") != std::string::npos) << text_of(report);
  }
}

TEST_F(VerifyViewTest, FindsTilesThatAreOffByOne) {
  const int columns = tiny_grid().shape().columns();
  expect_tile_found(
      [](TileIndex, std::vector<std::uint16_t>& codes) { std::rotate(codes.begin(), codes.begin() + 1, codes.end()); },
      finding::kSharedVertex, "one column further West");
  expect_tile_found(
      [&](TileIndex, std::vector<std::uint16_t>& codes) {
        std::rotate(codes.begin(), codes.begin() + columns, codes.end());
      },
      finding::kSharedVertex, "one row further North");
}

TEST_F(VerifyViewTest, FindsShiftedPadding) {
  const int columns = tiny_grid().shape().columns();
  const int rows = tiny_grid().shape().rows();
  expect_tile_found(
      [&](TileIndex, std::vector<std::uint16_t>& codes) {
        for (int row = 0; row < rows; ++row) codes[static_cast<std::size_t>(row * columns)] += 40;
      },
      finding::kSharedVertex, "the West padding column is off");
  expect_tile_found(
      [&](TileIndex, std::vector<std::uint16_t>& codes) {
        // As the paper prints Eq. 1: the padding of even rows one step further out (errata E5).
        for (int row = 0; row < rows; row += 2) {
          const auto at = static_cast<std::size_t>(row * columns);
          codes[at] = codes[at] > 30000 ? codes[at] - 7 : codes[at] + 7;
        }
      },
      finding::kSharedVertex, "the West padding of even rows is sampled one step further out");
  expect_tile_found(
      [&](TileIndex, std::vector<std::uint16_t>& codes) {
        std::rotate(codes.begin(), codes.begin() + 1, codes.begin() + columns);
      },
      finding::kSharedVertex, "the North padding row is one column off");
}

/// Heights of tile (1,1) are wrong where shadows are computed; findings name a vertex.
void expect_shadows_found(const std::function<void(std::span<float>)>& spoil, const std::string& what) {
  MemoryTiles source(tiny_grid());
  source.set_heights([&](TileIndex tile, std::span<float> heights) {
    if (tile == TileIndex{1, 1}) spoil(heights);
  });
  const ViewReport report = verify_view(source, make_index_arrays(source.grid().shape()));
  EXPECT_FALSE(report.passed()) << what;
  for (const ViewFinding& finding : report.findings) {
    EXPECT_EQ(finding.id, finding::kDrawnShadow) << what;
    EXPECT_EQ(finding.tile.row, 1) << what;
    EXPECT_NE(finding.where.find("vertex (c "), std::string::npos) << what;
    EXPECT_NE(finding.where.find("casts shadows as"), std::string::npos) << what;
  }
}

TEST_F(VerifyViewTest, FindsShadowsOfAnotherGround) {
  const auto columns = static_cast<std::ptrdiff_t>(tiny_grid().shape().columns());
  expect_shadows_found([&](std::span<float> h) { std::rotate(h.begin(), h.begin() + columns, h.end()); },
                       "a row further North");
  expect_shadows_found([](std::span<float> h) { std::fill(h.begin(), h.end(), 0.0F); }, "no ground");
  expect_shadows_found(
      [](std::span<float> h) {
        for (float& height : h) height += 3.0F;
      },
      "three codes too high");
  expect_shadows_found([](std::span<float> h) { h[h.size() / 2] = 65000.0F; }, "one caster too many");
}

TEST_F(VerifyViewTest, FindsShadowsThatAreNotThoseOfRays) {
  MemoryTiles source(tiny_grid());
  source.set_share(0.0F);
  const ViewReport report = verify_view(source, make_index_arrays(source.grid().shape()));
  ASSERT_EQ(report.ray_suns.size(), 2U);
  for (const ViewReport::RaySun& sun : report.ray_suns) {
    EXPECT_GT(sun.vertices, 0);
    EXPECT_EQ(sun.dark, sun.vertices);
    EXPECT_GT(sun.lit_though_dark, sun.vertices / 4);
    EXPECT_EQ(sun.dark_though_lit, 0);
  }
  ASSERT_EQ(report.findings.size(), 2U) << text_of(report);
  for (const ViewFinding& finding : report.findings) {
    EXPECT_EQ(finding.id, finding::kDrawnShadow);
    EXPECT_NE(finding.where.find("rays find"), std::string::npos);
  }
}

TEST_F(VerifyViewTest, FindsOneWrongElevationOnAnEdge) {
  const int columns = tiny_grid().shape().columns();
  expect_tile_found(
      [&](TileIndex, std::vector<std::uint16_t>& codes) { codes[static_cast<std::size_t>(9 * columns + 1)] += 1; },
      finding::kSharedVertex, "one code differs by one");
}

}  // namespace
}  // namespace isohf::view
