#include "isohf/lattice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

int coarsest_stride(int levels) {
  return 1 << (levels - 1);
}

void require_level(const TileShape& shape, int level) {
  if (level >= 0 && level < shape.levels()) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("level {} of a tile is asked for, it has 0 to {}", level, shape.levels() - 1));
}

/// The multiple of `step` that is nearest to `value` and lies in [step, limit]; ties upwards.
int nearest_multiple(std::int64_t value, int step, int limit) {
  const std::int64_t last = limit / step;
  return static_cast<int>(std::clamp((std::max<std::int64_t>(value, 0) + step / 2) / step, std::int64_t{1}, last)) *
         step;
}

}  // namespace

std::string TileShape::why_invalid(int columns, int rows, int levels) {
  if (levels < 1 || levels > kMaxTileLevels)
    return fmt::format("levels is {}, must lie in 1..{}", levels, kMaxTileLevels);
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
  const int kept_levels = std::clamp(levels, 1, kMaxTileLevels);
  const int stride = coarsest_stride(kept_levels);
  const int cells = nearest_multiple(std::int64_t{columns} - 4, stride, kMaxTileColumns - 4);
  const int cell_rows = nearest_multiple(std::int64_t{rows} - 3, 2 * stride, kMaxTileRows - 3);
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
  require_level(*this, level);
  // Eq. 3 as the appendix evaluates it: pairs of rows times (indices a pair), less the three that the last row omits.
  const std::int64_t stride = std::int64_t{1} << level;
  return (rows_ - 3) / (2 * stride) * ((columns_ - 4) * 4 / stride + 10) - 3;
}

std::int64_t TileShape::strip_triangle_count(int level) const {
  require_level(*this, level);
  const std::int64_t stride = std::int64_t{1} << level;
  return ((columns_ - 4) * 2 / stride + 1) * ((rows_ - 3) / stride);
}

std::int64_t TileShape::stitch_triangle_count(int level) const {
  require_level(*this, level);
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

namespace {

std::int64_t budgeted_count(const TileShape& shape, ShapeBudget::Kind kind) {
  return kind == ShapeBudget::Kind::kTriangles ? shape.triangle_count() : shape.stored_vertex_count();
}

/// Appends the shapes of this many columns whose count lies in [least, most] and that are nearest to equilateral: at
/// most two, since the aspect grows with the rows and so does the count.
void append_best_rows(int columns, int levels, ShapeBudget::Kind kind, double least, double most,
                      std::vector<TileShape>& found) {
  const int step = 2 * coarsest_stride(levels);
  const int most_steps = (kMaxTileRows - 3) / step;
  // R = step·k + 3 rows (errata E2). Triangles (2C-7)·step·k, or vertices C·(step·k + 3), bound k.
  const bool by_triangles = kind == ShapeBudget::Kind::kTriangles;
  const double per_row = by_triangles ? 2.0 * columns - 7.0 : columns;
  const double fixed_rows = by_triangles ? 0.0 : 3.0;
  const double lower = std::ceil((least / per_row - fixed_rows) / step);
  const double upper = std::floor((most / per_row - fixed_rows) / step);
  if (upper < 1.0 || lower > most_steps) return;
  // One step wider, so that the rounding of the division loses nothing; the exact test follows.
  const auto in_budget = [&](int k) {
    const auto count = static_cast<double>(budgeted_count(TileShape::make(columns, step * k + 3, levels), kind));
    return count >= least && count <= most;
  };
  int first = static_cast<int>(std::max(lower - 1.0, 1.0));
  int last = static_cast<int>(std::min(upper + 1.0, static_cast<double>(most_steps)));
  while (first <= last && !in_budget(first)) ++first;
  while (last >= first && !in_budget(last)) --last;
  if (first > last) return;
  const auto ideal = static_cast<int>((columns - 4) / kSin60 / step);  // equilateral between this and the next
  const int below = std::clamp(ideal, first, std::max(first, last - 1));
  for (int k = below; k <= std::min(below + 1, last); ++k) {
    found.push_back(TileShape::make(columns, step * k + 3, levels));
  }
}

}  // namespace

std::vector<TileShape> find_shapes(int levels, const ShapeBudget& budget, double tolerance, int limit) {
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, why); };
  if (levels < 1 || levels > kMaxTileLevels) {
    refuse(fmt::format("levels is {}, must lie in 1..{}", levels, kMaxTileLevels));
  }
  require_known("tile budget: its kind", budget.kind, ShapeBudget::Kind::kVertices);
  if (budget.count < 1) refuse(fmt::format("tile budget is {}, must be at least 1", budget.count));
  if (!(tolerance >= 0.0)) refuse(fmt::format("tile budget tolerance is {}, must be at least 0", tolerance));
  const auto wanted = static_cast<double>(budget.count);
  const int stride = coarsest_stride(levels);
  std::vector<TileShape> found;
  for (int columns = 4 + stride; columns <= kMaxTileColumns; columns += stride) {
    append_best_rows(columns, levels, budget.kind, wanted * (1.0 - tolerance), wanted * (1.0 + tolerance), found);
  }
  const auto off_budget = [&](const TileShape& shape) {
    return std::abs(static_cast<double>(budgeted_count(shape, budget.kind) - budget.count));
  };
  std::sort(found.begin(), found.end(), [&](const TileShape& a, const TileShape& b) {
    const auto key = [&](const TileShape& shape) {
      return std::tuple(std::abs(shape.aspect() - 1.0), off_budget(shape), shape.columns());
    };
    return key(a) < key(b);
  });
  if (limit >= 0 && found.size() > static_cast<std::size_t>(limit)) found.erase(found.begin() + limit, found.end());
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
