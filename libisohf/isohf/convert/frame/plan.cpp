#include "isohf/convert/frame/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kSin60 = std::numbers::sqrt3 / 2.0;

/// Columns, rows and levels of a tile where neither the user nor a small source asks otherwise: the best true aspect in
/// Table 1 (docs/decisions/0011).
constexpr int kDefaultColumns = 212;
constexpr int kDefaultRows = 243;
constexpr int kDefaultLevels = 4;

/// A source of this many default tiles or more gets them; below, the shape is looked for that wastes least.
constexpr double kManyTiles = 12.0;
/// How far a shape that is chosen for a small source may be from equilateral.
constexpr double kWorstAspect = 0.02;
/// What one tile costs beyond its samples (header, index, directory, a draw call), in samples.
constexpr double kTileOverhead = 4000.0;
/// What a level given up must save.
constexpr double kLevelWorth = 1.1;

/// Where tiles are to end on the source's edge (docs/decisions/0025): the densities and the aspects of triangles that
/// may come out, and how much larger than the usual one a tile may be, on a side.
constexpr double kLeastDensity = 0.97;
constexpr double kMostDensity = 1.05;
constexpr double kWorstFittedAspect = 0.03;
/// How far a tile may be from square: textures are square, and lie on it without visible distortion.
constexpr double kWorstTileAspect = 0.125;
constexpr double kLargestSide = 1.5;

/// Densities that nobody means unless they ask for them.
constexpr double kThinDensity = 0.5;
constexpr double kThickDensity = 2.0;
/// The most that is done for those who ask: a tile then holds a small part of the ground between four samples.
constexpr double kMostDensityAsked = 1 << 20;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

std::int64_t tiles_to_cover(double length, double extent) {
  const double tiles = std::ceil(length / extent - 1e-9);
  if (!(tiles <= static_cast<double>(kMaxTilesPerAxis))) {
    refuse(
        fmt::format("the lattice needs {:.3g} tiles in one direction, at most {} are possible; use a larger `spacing` "
                    "or a smaller `density`",
                    tiles, kMaxTilesPerAxis));
  }
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(tiles));
}

/// Side of a square tile whose cells hold `density` lattice samples for one source sample.
double extent_for_density(const TileShape& shape, const SourceFrame& frame, double density) {
  return std::sqrt(static_cast<double>(shape.cell_columns()) * shape.cell_rows() * frame.spacing_x * frame.spacing_z /
                   density);
}

double extent_for(const TileShape& shape, const SourceFrame& frame, const PlanRequest& request) {
  const WorldBounds bounds = frame.bounds();
  if (request.tiles) {
    return std::max(bounds.x1 / static_cast<double>(request.tiles->first),
                    bounds.z1 / static_cast<double>(request.tiles->second));
  }
  if (request.spacing) return *request.spacing * shape.cell_columns();
  return extent_for_density(shape, frame, request.density.value_or(1.0));
}

/// Whether one tile of the usual size covers the source, at the density or spacing asked for; globes are cut into tiles
/// of their own.
bool fits_one_tile(const SourceFrame& frame, const PlanRequest& request) {
  if (request.tiles || frame.wraps_x) return false;
  const TileShape usual = TileShape::nearest(kDefaultColumns, kDefaultRows, request.levels.value_or(kDefaultLevels));
  const WorldBounds bounds = frame.bounds();
  return std::max(bounds.x1, bounds.z1) <= extent_for(usual, frame, request);
}

/// Shape and grid of the tiles.
struct Lattice {
  TileShape shape;
  std::int64_t columns;
  std::int64_t rows;
  double extent_x;
  double extent_z;
};

/// Times larger or smaller, less 1.
double off(double ratio) {
  return std::max(ratio, 1.0 / ratio) - 1.0;
}

/// The least extent of which so many reach the source's edge.
double extent_reaching(double length, std::int64_t tiles) {
  const auto count = static_cast<double>(tiles);
  double extent = length / count;
  while (extent * count < length) extent = std::nextafter(extent, kMaxExtent);
  return extent;
}

/// Steps of one tile along one axis, and how many such tiles there are.
struct AxisTiles {
  int cells;
  std::int64_t tiles;
  double ratio;  ///< of all steps to those wanted
};

/// Tiles that divide an axis into about `wanted` steps: `tiles` of them, or as many as are not much larger than
/// `usual_cells`.
std::vector<AxisTiles> axis_tiles(double wanted, int unit, int most_cells, int usual_cells,
                                  const std::optional<std::int64_t>& tiles) {
  std::vector<AxisTiles> found;
  const auto add = [&](double cells, double count) {
    if (cells < unit || cells > most_cells || count < 1.0 || count > static_cast<double>(kMaxTilesPerAxis)) return;
    found.push_back({static_cast<int>(cells), static_cast<std::int64_t>(count), cells * count / wanted});
  };
  if (tiles) {
    const double units = std::floor(wanted / static_cast<double>(*tiles) / unit);
    add(std::max(units, 1.0) * unit, static_cast<double>(*tiles));
    add((units + 1.0) * unit, static_cast<double>(*tiles));
    return found;
  }
  for (int cells = unit; cells <= std::min(most_cells, static_cast<int>(kLargestSide * usual_cells)); cells += unit) {
    const double count = std::floor(wanted / cells);
    for (const double candidate : {count, count + 1.0}) {
      if (off(candidate * cells / wanted) < 2.0 * kWorstFittedAspect) add(cells, candidate);
    }
  }
  return found;
}

/// A lattice that ends on the source's edges, of tiles that are only nearly square so that triangles are equilateral.
/// With a number of tiles given, the one whose density lies nearest 1; else nullopt where none is near enough.
std::optional<Lattice> fitted_lattice(const SourceFrame& frame, const PlanRequest& request) {
  const WorldBounds bounds = frame.bounds();
  // Equilateral triangles, one vertex for a sample.
  const double step = std::sqrt(frame.spacing_x * frame.spacing_z / kSin60);
  double wanted_columns = bounds.x1 / step;
  double wanted_rows = bounds.z1 / (step * kSin60);
  std::optional<std::int64_t> tile_columns;
  std::optional<std::int64_t> tile_rows;
  if (request.tiles) {
    tile_columns = request.tiles->first;
    tile_rows = request.tiles->second;
    // Tiles can only be so large: fewer vertices then, in both directions.
    const double held = std::min({1.0, (kMaxTileColumns - 4) * static_cast<double>(*tile_columns) / wanted_columns,
                                  (kMaxTileRows - 3) * static_cast<double>(*tile_rows) / wanted_rows});
    wanted_columns *= held;
    wanted_rows *= held;
  } else if (fits_one_tile(frame, request)) {
    tile_columns = tile_rows = 1;
  }
  const int most_levels = request.levels.value_or(kDefaultLevels);
  const int fewest_levels = request.levels.value_or(1);
  std::optional<Lattice> best;
  double best_cost = 0.0;
  double level_cost = 1.0;
  for (int levels = most_levels; levels >= fewest_levels; --levels, level_cost *= request.tiles ? 1.05 : 1.15) {
    const int unit = 1 << (levels - 1);
    const std::vector<AxisTiles> all_columns =
        axis_tiles(wanted_columns, unit, kMaxTileColumns - 4, kDefaultColumns - 4, tile_columns);
    const std::vector<AxisTiles> all_rows =
        axis_tiles(wanted_rows, 2 * unit, kMaxTileRows - 3, kDefaultRows - 3, tile_rows);
    for (const AxisTiles& columns : all_columns) {
      for (const AxisTiles& rows : all_rows) {
        const double density = columns.ratio * rows.ratio;
        const double aspect = columns.ratio / rows.ratio;
        double cost = level_cost * (1.0 + off(density)) * (1.0 + off(aspect));
        if (!request.tiles) {
          if (density < kLeastDensity || density > kMostDensity || off(aspect) > kWorstFittedAspect) continue;
          const double cells = static_cast<double>(columns.cells) * rows.cells;
          const double stored = (columns.cells + 4.0) * (rows.cells + 3.0) + kTileOverhead;
          const double side = std::sqrt(cells / ((kDefaultColumns - 4.0) * (kDefaultRows - 3.0)));
          const double square = columns.cells / (rows.cells * kSin60);
          if (off(square) > kWorstTileAspect) continue;
          cost = level_cost * stored / cells * (1.0 + 0.5 * off(density)) * (1.0 + 0.5 * off(aspect)) *
                 (1.0 + 0.2 * off(side)) * (1.0 + 0.05 * off(square));
        }
        if (best && cost >= best_cost) continue;
        best = Lattice{TileShape::make(columns.cells + 4, rows.cells + 3, levels), columns.tiles, rows.tiles,
                       extent_reaching(bounds.x1, columns.tiles), extent_reaching(bounds.z1, rows.tiles)};
        best_cost = cost;
      }
    }
  }
  return best;
}

/// How many tiles of this shape cover the source.
double tiles_of(const TileShape& shape, const SourceFrame& frame, const PlanRequest& request) {
  const double extent = extent_for(shape, frame, request);
  const WorldBounds bounds = frame.bounds();
  return std::max(std::ceil(bounds.x1 / extent - 1e-9) * std::ceil(bounds.z1 / extent - 1e-9), 1.0);
}

/// Stored samples of the whole dataset with this shape, tile overhead included.
double cost_of(const TileShape& shape, const SourceFrame& frame, const PlanRequest& request) {
  return tiles_of(shape, frame, request) * (static_cast<double>(shape.stored_vertex_count()) + kTileOverhead);
}

TileShape shape_for_small_source(const SourceFrame& frame, const PlanRequest& request) {
  const bool is_one_tile = fits_one_tile(frame, request);
  const int most_levels = request.levels.value_or(kDefaultLevels);
  const int fewest_levels = request.levels.value_or(1);
  std::optional<TileShape> best;
  double best_cost = 0.0;
  for (int levels = most_levels; levels >= fewest_levels; --levels) {
    for (int cells = 1 << (levels - 1); cells <= kDefaultColumns + 48; cells += 1 << (levels - 1)) {
      const int step = 1 << levels;
      const int rows = static_cast<int>(std::lround(cells / kSin60 / step)) * step + 3;
      if (!TileShape::why_invalid(cells + 4, rows, levels).empty()) continue;
      const TileShape shape = TileShape::make(cells + 4, rows, levels);
      if (std::abs(shape.aspect() - 1.0) > kWorstAspect) continue;
      if (is_one_tile && tiles_of(shape, frame, request) > 1.0) continue;
      // Every level given up must save a tenth.
      const double cost = cost_of(shape, frame, request) * std::pow(kLevelWorth, most_levels - levels);
      if (!best || cost < best_cost) {
        best = shape;
        best_cost = cost;
      }
    }
  }
  return best.value_or(TileShape::nearest(kDefaultColumns, kDefaultRows, most_levels));
}

/// Square tiles of whole samples, each with two rows of triangles for a row of them: the size that wastes least.
TileShape shape_through_samples(const SourceFrame& frame, int levels) {
  const WorldBounds bounds = frame.bounds();
  std::optional<TileShape> best;
  double best_cost = 0.0;
  for (int cells = 1 << (levels - 1); cells <= std::max(128, 1 << (levels - 1)); cells *= 2) {
    if (frame.wraps_x && frame.width % cells != 0) continue;
    const TileShape shape = TileShape::make(cells + 4, 2 * cells + 3, levels);
    const double cost = std::ceil(bounds.x1 / frame.spacing_x / cells) *
                        std::ceil(bounds.z1 / frame.spacing_z / cells) *
                        (static_cast<double>(shape.stored_vertex_count()) + kTileOverhead);
    if (best && cost > best_cost) continue;
    best = shape;
    best_cost = cost;
  }
  return *best;
}

TileShape choose_shape(const SourceFrame& frame, const PlanRequest& request) {
  const int levels = request.levels.value_or(kDefaultLevels);
  if (request.through_samples && !request.shape && !request.budget) return shape_through_samples(frame, levels);
  if (request.shape) return TileShape::make(request.shape->first, request.shape->second, levels);
  if (request.budget) {
    const std::vector<TileShape> found = candidate_shapes(request, 1);
    if (found.empty()) {
      refuse(fmt::format("no tile shape of {} levels lies near the budget of {}; use fewer `levels` or a larger budget",
                         levels, request.budget->count));
    }
    return found.front();
  }
  if (!request.levels || *request.levels == kDefaultLevels) {
    const TileShape usual = TileShape::make(kDefaultColumns, kDefaultRows, kDefaultLevels);
    const double extent = extent_for(usual, frame, request);
    const WorldBounds bounds = frame.bounds();
    if (bounds.x1 / extent * (bounds.z1 / extent) >= kManyTiles) return usual;
  }
  return shape_for_small_source(frame, request);
}

/// Square tiles of the density, spacing or number asked for, which may reach beyond the source's edge.
Lattice square_lattice(const SourceFrame& frame, const PlanRequest& request) {
  const WorldBounds bounds = frame.bounds();
  const TileShape shape = choose_shape(frame, request);
  double extent_x = extent_for(shape, frame, request);
  double extent_z = extent_x;
  if (request.through_samples) {
    extent_x = shape.cell_columns() * frame.spacing_x;
    extent_z = shape.cell_rows() * frame.spacing_z / 2.0;
  }
  std::int64_t columns = request.tiles ? request.tiles->first : 0;
  std::int64_t rows = request.tiles ? request.tiles->second : 0;
  if (frame.wraps_x && request.through_samples) {
    columns = frame.width / shape.cell_columns();
    rows = tiles_to_cover(bounds.z1, extent_z);
    extent_x = bounds.x1 / static_cast<double>(columns);
  } else if (frame.wraps_x) {
    // A whole number of tiles goes round.
    if (!request.tiles) columns = tiles_to_cover(std::max(bounds.x1 - extent_x / 2.0, 0.0), extent_x);
    extent_x = bounds.x1 / static_cast<double>(columns);
    if (!request.tiles)
      rows = tiles_to_cover(request.fit ? std::max(bounds.z1 - extent_x / 2.0, 0.0) : bounds.z1, extent_x);
    extent_z = request.fit ? bounds.z1 / static_cast<double>(rows) : std::max(extent_x, request.tiles ? extent_z : 0.0);
  } else if (request.fit) {
    if (!request.tiles) {
      columns = tiles_to_cover(std::max(bounds.x1 - extent_x / 2.0, 0.0), extent_x);  // the nearest whole number
      rows = tiles_to_cover(std::max(bounds.z1 - extent_z / 2.0, 0.0), extent_z);
    }
    extent_x = bounds.x1 / static_cast<double>(columns);
    extent_z = bounds.z1 / static_cast<double>(rows);
  } else if (!request.tiles) {
    columns = tiles_to_cover(bounds.x1, extent_x);
    rows = tiles_to_cover(bounds.z1, extent_z);
  }
  return {shape, columns, rows, extent_x, extent_z};
}

/// Fewer or more vertices than anybody asked for, and what would mend it.
std::string density_warning(const SourceInfo& info, const Plan& plan, const PlanRequest& request) {
  const char* const remedy = request.tiles && request.shape    ? "leave out `shape` or `tiles`"
                             : request.tiles && request.budget ? "leave out the budget of a tile or `tiles`"
                             : request.tiles                   ? "ask for other `tiles`"
                             : request.fit                     ? "leave out `fit`, or ask for smaller tiles"
                                                               : "ask for smaller tiles";
  const char* const unit = plan.frame.in_metres ? " m" : "";
  return fmt::format(
      "{}: the lattice has {:.3g} vertices for one of the input's samples, with columns {:.4g}{} apart "
      "where the input's are {:.4g}{}; {}",
      info.path, plan.density, 2.0 * plan.grid.sigma_x(), unit, plan.frame.spacing_x, unit, remedy);
}

void check(const PlanRequest& request) {
  require_known("outside", request.outside, Outside::kVoid);
  require_known("`wrap_x`", request.ground.wrap, Wrap::kAlways);
  require_known("`projection`", request.ground.projection.kind, ProjectionKind::kSystem);
  if (request.levels && (*request.levels < 1 || *request.levels > kMaxTileLevels)) {
    refuse(fmt::format("`levels` is {}, must be 1 to {}", *request.levels, kMaxTileLevels));
  }
  if ((request.density ? 1 : 0) + (request.spacing ? 1 : 0) + (request.tiles ? 1 : 0) > 1) {
    refuse("more than one of `density`, `spacing` and `tiles` is given; give one");
  }
  if (request.shape && request.budget) refuse("both a tile shape and a tile budget are given; give one");
  const auto check_positive = [](const std::optional<double>& value, const char* option) {
    if (value && !(std::isfinite(*value) && *value > 0.0))
      refuse(fmt::format("{} is {}, must be positive", option, *value));
  };
  check_positive(request.density, "`density`");
  check_positive(request.spacing, "`spacing`");
  if (request.tiles && (request.tiles->first < 1 || request.tiles->second < 1)) {
    refuse(fmt::format("`tiles` is {}x{}, must be at least 1x1", request.tiles->first, request.tiles->second));
  }
}

}  // namespace

Plan make_plan(const SourceInfo& info, const PlanRequest& request) {
  check(request);
  require_source(info);
  if (info.width < 2 || info.height < 2) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: {}x{} samples, a surface needs at least 2x2", info.path, info.width, info.height));
  }
  const SourceFrame frame = make_source_frame(info, request.ground);
  const bool is_through = can_go_through_samples(frame, request);
  if (request.through_samples && (!is_through || request.tiles || request.density || request.spacing)) {
    refuse(info.path +
           ": a lattice through the samples goes with none of `fit`, `wrap_x`, `density`, `spacing` and `tiles`, nor "
           "with a source "
           "that is projected; leave these out, or it");
  }
  const bool may_fit =
      !request.shape && !request.budget && !request.density && !request.spacing && !request.through_samples;
  std::optional<Lattice> lattice = may_fit ? fitted_lattice(frame, request) : std::nullopt;
  if (!lattice) lattice = square_lattice(frame, request);
  Plan plan{
      .frame = frame,
      .grid = TileGrid::make(lattice->shape, lattice->columns, lattice->rows, lattice->extent_x, lattice->extent_z),
      .outside = request.outside};
  const TileShape& shape = plan.grid.shape();
  plan.density = frame.spacing_x * frame.spacing_z / (2.0 * plan.grid.sigma_x() * plan.grid.sigma_z());
  if (plan.density > kMostDensityAsked) {
    refuse(
        fmt::format("the lattice has {:.3g} vertices for one of the input's samples, at most {} are possible; use a "
                    "larger `spacing`, a smaller `density` or fewer `tiles`",
                    plan.density, kMostDensityAsked));
  }
  plan.lattice_samples = shape.stored_vertex_count() * plan.grid.tile_count();
  constexpr double kTypicalBits = 5.0;
  plan.estimated_bytes = static_cast<std::uint64_t>(static_cast<double>(plan.lattice_samples) * kTypicalBits / 8.0 +
                                                    150.0 * static_cast<double>(plan.grid.tile_count()) + 20e3);
  return plan;
}

bool can_go_through_samples(const SourceFrame& frame, const PlanRequest& request) {
  const int unit = 1 << (request.levels.value_or(kDefaultLevels) - 1);
  return !frame.warp && !request.fit && (!frame.wraps_x || frame.width % unit == 0);
}

std::vector<Warning> plan_warnings(const SourceInfo& info, const Plan& plan, const PlanRequest& request) {
  const bool is_odd = plan.density < kThinDensity || plan.density > kThickDensity;
  if (request.density || request.spacing || !is_odd) return {};
  return {density_warning(info, plan, request)};
}

std::vector<TileShape> candidate_shapes(const PlanRequest& request, int limit) {
  const ShapeBudget budget = request.budget.value_or(ShapeBudget{ShapeBudget::Kind::kTriangles, 100000});
  for (const double tolerance : {0.1, 0.25, 0.5, 1.0}) {
    std::vector<TileShape> found = find_shapes(request.levels.value_or(kDefaultLevels), budget, tolerance, limit);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace isohf
