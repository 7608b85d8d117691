#include "verify/verify_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

namespace isohf::view {
namespace {

using Side = std::pair<std::uint32_t, std::uint32_t>;

/// Counts directed sides; a side and its reverse cancel.
class SideCount {
 public:
  void add(std::uint32_t from, std::uint32_t to, int sign) {
    if (from < to) {
      count_[{from, to}] += sign;
    } else {
      count_[{to, from}] -= sign;
    }
  }
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a == b || b == c || a == c) return;
    add(a, b, 1);
    add(b, c, 1);
    add(c, a, 1);
  }
  [[nodiscard]] const std::map<Side, int>& sides() const { return count_; }

 private:
  std::map<Side, int> count_;
};

std::vector<std::uint32_t> border(const TileShape& shape) {
  const int columns = shape.columns();
  const int rows = shape.rows();
  std::vector<std::uint32_t> loop;
  const auto add = [&](int column, int row) { loop.push_back(static_cast<std::uint32_t>(column + row * columns)); };
  for (int row = 1; row < rows - 2; ++row) add(1, row);
  for (int column = 1; column < columns - 3; ++column) add(column, rows - 2);
  for (int row = rows - 2; row > 1; --row) add(row % 2 == 0 ? columns - 2 : columns - 3, row);
  for (int column = columns - 3; column > 1; --column) add(column, 1);
  return loop;
}

}  // namespace

std::string check_name(int id) {
  static const std::map<int, const char*> kNames{
      {finding::kTileUndecodable, "readable"}, {finding::kSharedVertex, "shared vertices"},
      {finding::kNormal, "shared vertices"},   {finding::kDrawnVertex, "vertices"},
      {finding::kDrawnCoverage, "coverage"},   {finding::kDrawnHeight, "heights"},
      {finding::kDrawnCrack, "cracks"},        {finding::kDrawnMesh, "mesh"},
      {finding::kDrawnShadow, "shadows"}};
  return kNames.at(id);
}

std::string vertex_name(GridVertex vertex) {
  return fmt::format("vertex (c {}, r {})", vertex.column, vertex.row);
}

std::string pixel_name(const TileShape& shape, const PixelWindow& window, int i, int j, const PixelSample& sample) {
  std::string text = fmt::format("object space ({:.2f}, {:.2f})", (window.x0 + i + 0.5) / kPixelsPerX,
                                 (window.z0 + j + 0.5) / kPixelsPerZ);
  if (sample.weights[0] + sample.weights[1] + sample.weights[2] < 0.5F) return text + ", outside the tile";
  text += ", triangle";
  for (const std::uint32_t vertex : sample.vertices) {
    const auto columns = static_cast<std::uint32_t>(shape.columns());
    text += fmt::format(" (c {}, r {})", vertex % columns, vertex / columns);
  }
  return text;
}

std::vector<float> heights_from(std::span<const std::uint16_t> codes, double code_height) {
  std::vector<float> heights(codes.size());
  std::transform(codes.begin(), codes.end(), heights.begin(), [=](std::uint16_t code) {
    return code == kVoidCode ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code_height * code);
  });
  return heights;
}

void verify_mesh(const SharedGeometry& shared, ViewReport& report) {
  const TileShape& shape = shared.shape();
  const auto columns = static_cast<std::uint32_t>(shape.columns());
  const std::vector<std::uint32_t> loop = border(shape);
  for (int level = 0; level < shape.levels(); ++level) {
    SideCount count;
    const std::vector<std::uint32_t> strip = shared.read_strip(level);
    for (std::size_t i = 2; i < strip.size(); ++i) {
      if (i % 2 == 0) {
        count.add_triangle(strip[i - 2], strip[i - 1], strip[i]);
      } else {
        count.add_triangle(strip[i - 1], strip[i - 2], strip[i]);
      }
    }
    const std::vector<std::uint32_t> stitch = shared.read_stitch(level);
    for (std::size_t i = 2; i < stitch.size(); i += 3) count.add_triangle(stitch[i - 2], stitch[i - 1], stitch[i]);
    for (std::size_t i = 0; i < loop.size(); ++i) count.add(loop[i], loop[(i + 1) % loop.size()], -1);
    std::int64_t open = 0;
    std::string where;
    for (const auto& [side, uses] : count.sides()) {
      if (uses == 0) continue;
      if (open++ == 0) {
        where = fmt::format("the side from vertex (c {}, r {}) to (c {}, r {}) has {} triangle{} too {} on one side",
                            side.first % columns, side.first / columns, side.second % columns, side.second / columns,
                            std::abs(uses), std::abs(uses) == 1 ? "" : "s", uses > 0 ? "many" : "few");
      }
    }
    if (open == 0) continue;
    report.add({finding::kDrawnMesh, {0, 0}, level, where, static_cast<double>(open), open});
  }
}

ViewReport verify_view(const TileSource& source, const IndexArrays& arrays, const ViewChecks& options) {
  const TileGrid& grid = source.grid();
  ViewReport report;
  const SharedGeometry shared(grid.shape(), arrays);
  MeshOracle oracle(grid.shape());
  TileProbe probe(grid, shared, source.scale().scale);
  const CheckContext context{source, shared, oracle, probe, options, report};
  verify_mesh(shared, report);
  verify_tiles(context);
  // Tiles that disagree shade each other in two ways.
  if (options.shadows && report.passed()) verify_shadows(context);
  return report;
}

}  // namespace isohf::view
