#include "isohf/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/lattice/planes.h"
#include "isohf/lattice/stitch.h"
#include "isohf/lattice/strip.h"

namespace isohf {
namespace {

/// The shape with the levels that tiles drawn beside an overview need.
TileShape with_overview_levels(const TileShape& shape, int stride) {
  if (stride == 0) return shape;
  if (!allows_planes(shape, stride)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("the overview stride {} is not a power of two from 2 on that divides {} and {}", stride,
                            shape.cell_columns(), shape.cell_rows() / 2));
  }
  const int levels = std::countr_zero(static_cast<unsigned>(stride)) + 1;
  return TileShape::make(shape.columns(), shape.rows(), std::max(levels, shape.levels()));
}

bool repeats_a_vertex(const std::array<std::uint32_t, 3>& triangle) {
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

}  // namespace

TileMesh::TileMesh(const TileShape& shape, int overview_stride) : shape_(with_overview_levels(shape, overview_stride)) {
  const auto add = [&](const std::vector<std::uint32_t>& indices) {
    const Part part{indices_.size(), indices.size()};
    indices_.insert(indices_.end(), indices.begin(), indices.end());
    return part;
  };
  for (int level = 0; level < shape_.levels(); ++level) strips_.push_back(add(strip_indices(shape_, level)));
  const Part stitches = add(stitch_indices(shape_));
  for (int level = 0; level < shape_.levels(); ++level) {
    stitches_.push_back({stitches.first, static_cast<std::size_t>(shape_.stitch_index_count(level))});
  }
  for (const TileSide side : {TileSide::kWest, TileSide::kEast, TileSide::kNorth, TileSide::kSouth}) {
    sides_.push_back(overview_stride == 0 ? Part() : add(side_stitch_indices(shape_, side, overview_stride)));
  }
}

std::span<const std::uint32_t> TileMesh::part(const std::vector<Part>& parts, int at) const {
  if (at < 0 || at >= static_cast<int>(parts.size())) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{} is not a level or side from 0 to {}", at, parts.size() - 1));
  }
  const Part& part = parts[static_cast<std::size_t>(at)];
  return std::span(indices_).subspan(part.first, part.count);
}

std::vector<std::uint32_t> TileMesh::triangles(int level, std::span<const double> elevations, Stitches stitches) const {
  if (!elevations.empty() && static_cast<std::int64_t>(elevations.size()) != shape_.stored_vertex_count()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{} elevations for tiles of {} vertices", elevations.size(), shape_.stored_vertex_count()));
  }
  std::vector<std::uint32_t> list;
  const auto add = [&](const std::array<std::uint32_t, 3>& triangle) {
    const auto is_nodata = [&](std::uint32_t vertex) { return std::isnan(elevations[vertex]); };
    if (repeats_a_vertex(triangle)) return;
    if (!elevations.empty() && std::any_of(triangle.begin(), triangle.end(), is_nodata)) return;
    list.insert(list.end(), triangle.begin(), triangle.end());
  };
  const std::span<const std::uint32_t> strip = this->strip(level);
  const auto stitch = stitches == Stitches::kIncluded ? this->stitch(level) : std::span<const std::uint32_t>();
  list.reserve(static_cast<std::size_t>(3 * shape_.strip_triangle_count(level)) + stitch.size());
  // Every second triangle of a strip takes its first two vertices in the other order.
  for (std::size_t i = 0; i + 2 < strip.size(); ++i) add({strip[i + i % 2], strip[i + 1 - i % 2], strip[i + 2]});
  for (std::size_t i = 0; i + 2 < stitch.size(); i += 3) add({stitch[i], stitch[i + 1], stitch[i + 2]});
  return list;
}

std::vector<std::array<std::int16_t, 2>> object_positions(const TileShape& shape) {
  std::vector<std::array<std::int16_t, 2>> positions;
  positions.reserve(static_cast<std::size_t>(shape.stored_vertex_count()));
  for (int row = 0; row < shape.rows(); ++row) {
    for (int column = 0; column < shape.columns(); ++column) {
      const ObjectVertex at = object_from_grid(shape, {column, row});
      positions.push_back({static_cast<std::int16_t>(at.x), static_cast<std::int16_t>(at.z)});
    }
  }
  return positions;
}

}  // namespace isohf
