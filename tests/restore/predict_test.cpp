#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/restore/grid_sampler.h"
#include "isohf/restore/predict/place_mesh.h"
#include "isohf/restore/predict/spline_predictor.h"
#include "isohf/restore/rows/spline_rows.h"
#include "isohf/sampling/resample/kernels.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(FixedTriangle, IsTheTriangleThatBarycentricFinds) {
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(8, 7, 2), TileShape::make(12, 11, 2)}) {
    const std::int64_t last_x = kPlaceParts * shape.cell_columns();
    const std::int64_t last_z = kPlaceParts * shape.cell_rows();
    for (std::int64_t x = 0; x <= last_x; x += 32) {
      for (std::int64_t z = 0; z <= last_z; z += 32) {
        const FixedTriangle found = fixed_triangle(shape, {x, z});
        const Barycentric exact = barycentric(shape, {static_cast<double>(x) / 256.0, static_cast<double>(z) / 512.0});
        ASSERT_EQ(found.weights[0] + found.weights[1] + found.weights[2], 1024);
        for (std::size_t i = 0; i < 3; ++i) {
          ASSERT_EQ(found.weights[i] / 1024.0, exact.weights[i]) << x << "," << z;
          ASSERT_TRUE(found.weights[i] == 0 || found.vertices[i] == exact.vertices[i]) << x << "," << z;
        }
      }
    }
  }
}

TEST(FixedQuintic, IsTheSplinesWeightsRounded) {
  for (std::int64_t n = 0; n < kPlaceParts; ++n) {
    const std::array<int, 6> found = fixed_quintic(n);
    const QuinticWeights exact = quintic_weights(2.0 + static_cast<double>(n) / 512.0);
    int sum = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      sum += found[i];
      ASSERT_NEAR(found[i], exact.weights[i] * 16384.0, i == 2 ? 2.6 : 0.5 + 1e-9) << n;  // it takes the others' rest
    }
    ASSERT_EQ(sum, 16384);
  }
}

/// Tiles of a field over the whole lattice, in codes of a hundredth; shared vertices are equal.
struct Field {
  static constexpr int kTiles = 3;

  /// around  more tiles on each side, which hold the lattice mirrored about its outermost vertices
  explicit Field(int around = 0)
      : grid(TileGrid::make(inner.shape(), kTiles + 2 * around, kTiles + 2 * around, 40.0, 40.0)),
        around_tiles(around) {}

  TileGrid inner = TileGrid::make(TileShape::make(12, 11, 2), kTiles, kTiles, 40.0, 40.0);
  TileGrid grid;
  int around_tiles;
  Quantisation quantisation{CodeType::kU16, -300.0, 0.01};
  bool has_hole = false;

  [[nodiscard]] double height(WorldPoint at) const {
    return 40.0 * std::sin(at.x * 0.11) * std::cos(at.z * 0.07) + 0.3 * at.x;
  }
  /// Rows are mirrored as a whole, and each along itself: the odd ones begin half a column step further West.
  [[nodiscard]] LatticeVertex mirrored(LatticeVertex at) const {
    const TileShape& shape = inner.shape();
    const std::int64_t row = at.z - std::int64_t{around_tiles} * shape.cell_rows() + 1;
    const bool is_odd = (row & 1) != 0;
    const std::int64_t first = is_odd ? -2 : -1;
    const std::int64_t column = (at.x - std::int64_t{2} * around_tiles * shape.cell_columns() - first) / 2;
    return {first + 2 * mirror_index(column, kTiles * shape.cell_columns() + (is_odd ? 3 : 2)),
            mirror_index(row, kTiles * shape.cell_rows() + 3) - 1};
  }
  [[nodiscard]] TileCodes read(TileIndex tile) const {
    TileCodes codes{CodeType::kU16, {}, {}};
    for (int r = 0; r < grid.shape().rows(); ++r) {
      for (int c = 0; c < grid.shape().columns(); ++c) {
        const LatticeVertex vertex = grid.lattice_vertex(tile, {c, r});
        const WorldPoint at = inner.world_from_lattice(around_tiles > 0 ? mirrored(vertex) : vertex);
        const bool is_void = has_hole && std::hypot(at.x - 70.0, at.z - 50.0) < 11.0;
        codes.codes.push_back(is_void ? 65535 : static_cast<std::uint16_t>(std::lround((height(at) + 300.0) * 100.0)));
      }
    }
    return codes;
  }
  [[nodiscard]] ReadTile reader() const {
    return [this](TileIndex tile) { return read(tile); };
  }
};

TEST(SplinePredictor, AgreesWithTheSplinesInDoublesAndIsVoidWhereTheTrianglesAre) {
  for (const bool has_hole : {false, true}) {
    Field field;
    field.has_hole = has_hole;
    const SampleGrid samples{61, 57, 0.7, 0.4, 1.95, 2.1};
    SplinePredictor predictor(field.grid, false, field.quantisation, 8, field.reader(), samples);
    const Field mirrored(4);
    SampleGrid inside = samples;
    inside.first_x += 4 * 40.0;
    inside.first_z += 4 * 40.0;
    GridSampler hex(mirrored.grid, false, field.quantisation, mirrored.reader(), inside, RestoreMethod::kHex);
    GridSampler flat(field.grid, false, field.quantisation, field.reader(), samples, RestoreMethod::kBarycentric);
    std::vector<double> found(static_cast<std::size_t>(samples.width));
    std::vector<double> smooth(found.size());
    std::vector<double> triangles(found.size());
    int voids = 0;
    for (std::int64_t row = 0; row < samples.height; ++row) {
      predictor.read(row, 1, found);
      hex.read(row, 1, smooth);
      flat.read(row, 1, triangles);
      for (std::size_t c = 0; c < found.size(); ++c) {
        // Places are off by up to a 1024th of a lattice step, of 24 metres along a row and 14 down a column.
        ASSERT_EQ(std::isnan(found[c]), std::isnan(triangles[c])) << c << "," << row;
        voids += std::isnan(found[c]) ? 1 : 0;
        const double other = has_hole ? triangles[c] : smooth[c];
        ASSERT_TRUE(std::isnan(found[c]) || std::abs(found[c] - other) < (has_hole ? 8.0 : 0.045)) << c << "," << row;
      }
    }
    EXPECT_EQ(voids > 50, has_hole) << voids;
  }
}

TEST(SplinePredictor, GivesTheSameHoweverRowsAreCutAndWhereverTheyAre) {
  const test::TemporaryFolder folder;
  Field field;
  field.has_hole = true;
  const SampleGrid samples{50, 70, 1.0, -3.0, 2.3, 1.8};
  for (const bool wraps : {false, true}) {
    std::vector<double> whole(static_cast<std::size_t>(samples.width * samples.height));
    SplinePredictor(field.grid, wraps, field.quantisation, 8, field.reader(), samples).read(0, samples.height, whole);
    for (const std::int64_t step : {1, 7, 35, -1, -8, -70}) {
      const std::int64_t rows = std::abs(step);
      const ScratchFolder scratch = step < 0 ? ScratchFolder(folder.path()) : std::nullopt;
      SplinePredictor predictor(field.grid, wraps, field.quantisation, 8, field.reader(), samples, scratch);
      for (std::int64_t row = 0; row < samples.height; row += rows) {
        std::vector<double> part(static_cast<std::size_t>(samples.width * std::min(rows, samples.height - row)));
        predictor.read(row, std::min(rows, samples.height - row), part);
        ASSERT_EQ(std::memcmp(part.data(), whole.data() + row * samples.width, part.size() * sizeof(double)), 0)
            << rows << ": " << row;
      }
    }
  }
}

WorldPoint cubic(double column, double row) {
  if (column < 1.0 && row > 60.0) return {std::nan(""), 0.0};
  return {2.0 * column + 1e-3 * column * column - 1e-6 * row * row * row, 3.0 * row - 1e-4 * column * row};
}

TEST(PlaceMesh, HoldsCubicsForRastersOfAnySizeAndIsTheSameFromItsBytes) {
  const TileGrid grid = TileGrid::make(TileShape::make(12, 11, 2), 3, 3, 40.0, 40.0);
  for (const std::int64_t columns : {1, 2, 3, 4, 31, 32, 33, 97, 500}) {
    for (const std::int64_t rows : {1, 2, 5, 64, 130}) {
      const PlaceMesh mesh(columns, rows, grid, cubic);
      const std::vector<std::byte> bytes = mesh.bytes();
      ASSERT_EQ(bytes.size(), 8 * PlaceMesh::value_count(columns, rows));
      const PlaceMesh again(columns, rows, bytes);
      std::vector<FixedPlace> line(static_cast<std::size_t>(columns));
      std::vector<FixedPlace> from_bytes(line.size());
      for (std::int64_t row = 0; row < rows; ++row) {
        mesh.row(row, line);
        again.row(row, from_bytes);
        for (std::size_t c = 0; c < line.size(); ++c) {
          ASSERT_EQ(line[c].x, from_bytes[c].x);
          ASSERT_EQ(line[c].z, from_bytes[c].z);
          if (line[c].x == FixedPlace::kNone) {
            ASSERT_GT(rows, 60);
            continue;
          }
          const WorldPoint exact = cubic(static_cast<double>(c), static_cast<double>(row));
          // Nodes and two sums are rounded to a part each, and the sample's share of a cell of 32 to a 16384th.
          ASSERT_NEAR(static_cast<double>(line[c].x), exact.x / grid.sigma_x() * 256.0, 3.0) << columns << "x" << rows;
          ASSERT_NEAR(static_cast<double>(line[c].z), exact.z / grid.sigma_z() * 512.0, 3.0);
        }
      }
      for (const std::size_t wrong : {std::size_t{0}, bytes.size() - 1, bytes.size() - 8}) {
        EXPECT_THROW(PlaceMesh(columns, rows, std::span(bytes).first(wrong)), Error);
      }
    }
  }
}

TEST(PlaceMesh, RefusesNodesFarAway) {
  std::vector<std::byte> bytes(8 * PlaceMesh::value_count(40, 40));
  EXPECT_NO_THROW(PlaceMesh(40, 40, bytes));
  bytes[7] = std::byte{0x7F};
  EXPECT_THROW(PlaceMesh(40, 40, bytes), Error);
  bytes[7] = std::byte{0x80};  // no node
  EXPECT_NO_THROW(PlaceMesh(40, 40, bytes));
  EXPECT_EQ(PlaceMesh::step(10000, 10000), 32);
  for (const std::int64_t side : {100000, 1000000, 1000000000}) {
    EXPECT_LE(PlaceMesh::value_count(side, side), std::size_t{3} << 20U);
  }
}

TEST(FixedHeights, CountFloatsSoThatTheyFit) {
  Quantisation floats;
  floats.type = CodeType::kF32;
  for (const double largest : {1e-30, 0.001, 1.0, 3.39e6, 1e30}) {
    const int bits = FixedHeights::bits_for(floats, largest);
    ASSERT_TRUE(FixedHeights::are_valid(floats, bits));
    const FixedHeights heights(floats, bits);
    TileCodes tile{CodeType::kF32, {}, {static_cast<float>(largest), HUGE_VALF, -HUGE_VALF, std::nanf("")}};
    EXPECT_GE(heights.at(tile, 0), 0x1p28);
    EXPECT_LE(heights.at(tile, 0), 0x1p29);
    EXPECT_EQ(heights.at(tile, 1), 0x1p30);
    EXPECT_EQ(heights.at(tile, 2), -0x1p30);
    EXPECT_TRUE(std::isnan(heights.at(tile, 3)));
    EXPECT_NEAR(heights.elevation(heights.at(tile, 0)), largest, largest * 1e-7);
  }
  EXPECT_EQ(FixedHeights::bits_for(floats, 0.0), 0);
  EXPECT_FALSE(FixedHeights::are_valid(Quantisation{}, 9));
}

}  // namespace
}  // namespace isohf
