#include "isohf/lattice/tile_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr int kMaxLevels = 13;  // C-4 <= 2^14-4 holds one multiple of 2^12 with room, none of 2^14
constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

int coarsest_stride(int levels) {
  return 1 << (levels - 1);
}

/// The multiple of `step` that is nearest to `value` and lies in [step, limit].
int nearest_multiple(int value, int step, int limit) {
  const auto rounded = static_cast<int>((std::int64_t{std::max(value, 0)} + step / 2) / step * step);
  return std::clamp(rounded, step, limit / step * step);
}

}  // namespace

std::string TileShape::why_invalid(int columns, int rows, int levels) {
  if (levels < 1 || levels > kMaxLevels) return fmt::format("levels is {}, must lie in 1..{}", levels, kMaxLevels);
  if (columns < 5) return fmt::format("columns is {}, must be at least 5", columns);
  if (columns > kMaxTileColumns) {
    return fmt::format("columns is {}, must be at most {} so that object-space x fits 16 bits", columns,
                       kMaxTileColumns);
  }
  if (rows < 5) return fmt::format("rows is {}, must be at least 5", rows);
  if (rows > kMaxTileRows) return fmt::format("rows is {}, must be at most {}", rows, kMaxTileRows);
  if (rows % 2 == 0) return fmt::format("rows is {}, must be odd", rows);
  const int stride = coarsest_stride(levels);
  if ((columns - 4) % stride != 0) {
    return fmt::format("columns-4 is {}, must be a multiple of {} for {} levels", columns - 4, stride, levels);
  }
  if ((rows - 3) / 2 % stride != 0) {
    return fmt::format("(rows-3)/2 is {}, must be a multiple of {} for {} levels", (rows - 3) / 2, stride, levels);
  }
  return {};
}

TileShape TileShape::nearest(int columns, int rows, int levels) {
  const int kept_levels = std::clamp(levels, 1, kMaxLevels);
  const int stride = coarsest_stride(kept_levels);
  const int cells = nearest_multiple(columns - 4, stride, kMaxTileColumns - 4);
  const int cell_rows = nearest_multiple(rows - 3, 2 * stride, kMaxTileRows - 3);
  return {cells + 4, cell_rows + 3, kept_levels};
}

TileShape TileShape::make(int columns, int rows, int levels) {
  if (const std::string why = why_invalid(columns, rows, levels); !why.empty()) {
    const TileShape other = nearest(columns, rows, levels);
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("tile shape {}x{} with {} levels: {}; the nearest valid shape is {}x{} with {} levels",
                            columns, rows, levels, why, other.columns(), other.rows(), other.levels()));
  }
  return {columns, rows, levels};
}

std::int64_t TileShape::visible_vertex_count() const {
  return std::int64_t{rows_ - 1} / 2 * (columns_ - 3) + std::int64_t{rows_ - 3} / 2 * (columns_ - 2);
}

std::int64_t TileShape::triangle_count() const {
  return strip_triangle_count(0);
}

std::int64_t TileShape::strip_index_count(int level) const {
  // Eq. 3 as the appendix evaluates it: pairs of rows times (indices a pair), less the three that the last row omits.
  const std::int64_t stride = std::int64_t{1} << level;
  return (rows_ - 3) / (2 * stride) * ((columns_ - 4) * 4 / stride + 10) - 3;
}

std::int64_t TileShape::strip_triangle_count(int level) const {
  const std::int64_t stride = std::int64_t{1} << level;
  return ((columns_ - 4) * 2 / stride + 1) * ((rows_ - 3) / stride);
}

std::int64_t TileShape::stitch_triangle_count(int level) const {
  // Eq. 5, (R+C-7)(2 - 2^(1-level)), in integers: the sum over k = 1..level of (R+C-7)/2^(k-1).
  std::int64_t count = 0;
  for (int k = 1; k <= level; ++k) count += (rows_ + columns_ - 7) >> (k - 1);
  return count;
}

std::int64_t TileShape::stitch_index_count(int level) const {
  return 3 * stitch_triangle_count(level);
}

double TileShape::aspect() const {
  return (rows_ - 3) * kSin60 / (columns_ - 4);
}

double TileShape::printed_aspect() const {
  return rows_ * kSin60 / columns_;
}

std::vector<TileShape> find_shapes(int levels, const ShapeBudget& budget, double tolerance, int limit) {
  if (levels < 1 || levels > kMaxLevels) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("levels is {}, must lie in 1..{}", levels, kMaxLevels));
  }
  if (budget.count < 1) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("tile budget is {}, must be at least 1", budget.count));
  }
  const auto wanted = static_cast<double>(budget.count);
  const auto off_budget = [&](const TileShape& shape) {
    const std::int64_t count =
        budget.kind == ShapeBudget::Kind::kTriangles ? shape.triangle_count() : shape.stored_vertex_count();
    return std::abs(static_cast<double>(count) / wanted - 1.0);
  };
  const int stride = coarsest_stride(levels);
  std::vector<TileShape> found;
  for (int cells = stride; cells + 4 <= kMaxTileColumns; cells += stride) {
    // Only the two row counts on either side of the equilateral one can be best for these columns.
    const double ideal = cells / kSin60 / (2.0 * stride);
    for (const int pairs : {static_cast<int>(std::floor(ideal)), static_cast<int>(std::floor(ideal)) + 1}) {
      const int rows = pairs * 2 * stride + 3;
      if (!TileShape::why_invalid(cells + 4, rows, levels).empty()) continue;
      const TileShape shape = TileShape::make(cells + 4, rows, levels);
      if (off_budget(shape) <= tolerance) found.push_back(shape);
    }
  }
  std::sort(found.begin(), found.end(), [&](const TileShape& a, const TileShape& b) {
    const double distortion_a = std::abs(a.aspect() - 1.0);
    const double distortion_b = std::abs(b.aspect() - 1.0);
    if (distortion_a != distortion_b) return distortion_a < distortion_b;
    const double off_a = off_budget(a);
    const double off_b = off_budget(b);
    if (off_a != off_b) return off_a < off_b;
    return a.columns() < b.columns();
  });
  if (limit >= 0 && found.size() > static_cast<std::size_t>(limit)) {
    found.erase(found.begin() + limit, found.end());
  }
  return found;
}

const std::vector<Table1Row>& table1() {
  static const std::vector<Table1Row> rows = {
      {1, 5, 5, 0.866, true},     {1, 24, 29, 1.046, true},   {1, 49, 57, 1.007, true},      {3, 12, 11, 0.794, true},
      {3, 24, 27, 0.974, true},   {3, 48, 55, 0.992, false},  {4, 52, 67, 1.116, true},      {4, 68, 83, 1.057, true},
      {4, 156, 179, 0.994, true}, {4, 212, 243, 0.993, true}, {10, 2564, 3075, 1.039, true},
  };
  return rows;
}

}  // namespace isohf
