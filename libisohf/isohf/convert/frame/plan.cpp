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

/// Columns, rows and levels of a tile that others are compared with: the best true aspect in Table 1
/// (docs/decisions/0011).
constexpr int kUsualColumns = 212;
constexpr int kUsualRows = 243;
constexpr int kUsualLevels = 4;

/// What may be chosen where nobody asks otherwise (docs/decisions/0025): densities, compared with the one that is wanted;
/// how much larger than the usual tile another one may be, on a side; and how far triangles may be from equilateral.
constexpr double kLeastDensity = 0.97;
constexpr double kMostDensity = 1.05;
constexpr double kLargestSide = 1.5;
constexpr double kWorstAspect = 0.02;
constexpr double kWorstFittedAspect = 0.03;
/// What costs are multiplied by for any other density.
constexpr double kFarDensity = 10.0;
/// How far a tile of equilateral triangles may be from square, and how far one of a given shape may be stretched: textures
/// are square, and lie on it without visible distortion.
constexpr double kMostStretch = 0.125;
/// What one tile costs beyond its samples (header, index, directory, a draw call), in samples.
constexpr double kTileOverhead = 4000.0;
/// In one direction, of shapes that are compared; of more the usual shape is taken.
constexpr double kMostTilesTried = 1 << 16;
/// What a level given up must save.
constexpr double kLevelWorth = 1.15;
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

/// The nearest number of tiles.
std::int64_t tiles_along(double length, double extent) {
  return tiles_to_cover(std::max(length - extent / 2.0, 0.0), extent);
}

/// Side of a square tile of the density or spacing that is wanted.
double wanted_extent(int cell_columns, int cell_rows, const SourceFrame& frame, const PlanRequest& request) {
  if (request.spacing) return *request.spacing * cell_columns;
  return std::sqrt(static_cast<double>(cell_columns) * cell_rows * frame.spacing_x * frame.spacing_z /
                   request.density.value_or(1.0));
}

/// Whether one tile of the usual size covers the source; globes are cut into tiles of their own.
bool fits_one_tile(const SourceFrame& frame, const PlanRequest& request) {
  if (frame.wraps_x) return false;
  const TileShape usual = TileShape::nearest(kUsualColumns, kUsualRows, request.levels.value_or(kUsualLevels));
  const WorldBounds bounds = frame.bounds();
  return std::max(bounds.x1, bounds.z1) <= wanted_extent(usual.cell_columns(), usual.cell_rows(), frame, request);
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

/// Levels from those wanted down to one, or those asked for; unit: cells along a tile are multiples of it, rows of twice
/// it; cost: what the levels that are given up count for.
template <typename Use>
void for_each_level(const PlanRequest& request, Use use) {
  const int most = request.levels.value_or(kUsualLevels);
  double cost = 1.0;
  for (int levels = most; levels >= request.levels.value_or(1); --levels, cost *= kLevelWorth) {
    use(levels, 1 << (levels - 1), cost);
  }
}

bool is_near(double density) {
  return density >= kLeastDensity && density <= kMostDensity;
}

/// What one sample costs in tiles of so many cells, by the samples that are stored for it, and by how far a tile's size
/// is from the usual one.
double cost_of_size(double cell_columns, double cell_rows) {
  const double cells = cell_columns * cell_rows;
  const double stored = (cell_columns + 4.0) * (cell_rows + 3.0) + kTileOverhead;
  const double side = std::sqrt(cells / ((kUsualColumns - 4.0) * (kUsualRows - 3.0)));
  return stored / cells * (1.0 + 0.2 * off(side));
}

/// What it costs that the density is not the one that is wanted, and triangles are not equilateral.
double cost_of_misfit(double density, double aspect) {
  return (1.0 + 0.5 * off(density)) * (1.0 + 0.5 * off(aspect));
}

/// Steps of one tile along one axis, and how many such tiles there are.
struct AxisTiles {
  int cells;
  std::int64_t tiles;
  double ratio;  ///< of all steps to those wanted
};

/// Tiles that divide an axis into about `wanted` steps: one, or as many as are not much larger than `usual_cells`.
std::vector<AxisTiles> axis_tiles(double wanted, int unit, int usual_cells, bool is_one) {
  std::vector<AxisTiles> found;
  const auto add = [&](double cells, double count) {
    if (cells < unit || count < 1.0 || count > static_cast<double>(kMaxTilesPerAxis)) return;
    found.push_back({static_cast<int>(cells), static_cast<std::int64_t>(count), cells * count / wanted});
  };
  if (is_one) {
    const double units = std::floor(wanted / unit);
    add(std::max(units, 1.0) * unit, 1.0);
    add((units + 1.0) * unit, 1.0);
    return found;
  }
  for (int cells = unit; cells <= static_cast<int>(kLargestSide * usual_cells); cells += unit) {
    const double count = std::floor(wanted / cells);
    for (const double candidate : {count, count + 1.0}) {
      if (off(candidate * cells / wanted) < 2.0 * kWorstFittedAspect) add(cells, candidate);
    }
  }
  return found;
}

/// Tiles, or one, that end on the source's edges and are only nearly square, so that triangles are equilateral; nullopt
/// where none are near enough.
std::optional<Lattice> fitted_lattice(const SourceFrame& frame, const PlanRequest& request, bool is_one) {
  const WorldBounds bounds = frame.bounds();
  const double step = request.spacing
                          ? *request.spacing
                          : std::sqrt(frame.spacing_x * frame.spacing_z / (request.density.value_or(1.0) * kSin60));
  std::optional<Lattice> best;
  double best_cost = 0.0;
  for_each_level(request, [&](int levels, int unit, double level_cost) {
    const std::vector<AxisTiles> all_columns = axis_tiles(bounds.x1 / step, unit, kUsualColumns - 4, is_one);
    const std::vector<AxisTiles> all_rows = axis_tiles(bounds.z1 / (step * kSin60), 2 * unit, kUsualRows - 3, is_one);
    for (const AxisTiles& columns : all_columns) {
      for (const AxisTiles& rows : all_rows) {
        const double density = columns.ratio * rows.ratio;
        const double aspect = columns.ratio / rows.ratio;
        if (!is_near(density) || off(aspect) > kWorstFittedAspect) continue;
        const double square = columns.cells / (rows.cells * kSin60);  // of equilateral triangles
        if (off(square) > kMostStretch) continue;
        const double cost = level_cost * cost_of_size(columns.cells, rows.cells) * cost_of_misfit(density, aspect) *
                            (1.0 + 0.05 * off(square));
        if (best && cost >= best_cost) continue;
        best = Lattice{TileShape::make(columns.cells + 4, rows.cells + 3, levels), columns.tiles, rows.tiles,
                       extent_reaching(bounds.x1, columns.tiles), extent_reaching(bounds.z1, rows.tiles)};
        best_cost = cost;
      }
    }
  });
  return best;
}

/// Square tiles of one shape and about one extent that cover the source; all the way round a globe goes a whole number.
Lattice square_tiles(const TileShape& shape, double extent, const SourceFrame& frame) {
  const WorldBounds bounds = frame.bounds();
  std::int64_t columns = tiles_to_cover(bounds.x1, extent);
  if (frame.wraps_x) {
    columns = tiles_along(bounds.x1, extent);
    extent = bounds.x1 / static_cast<double>(columns);
  }
  return {shape, columns, tiles_to_cover(bounds.z1, extent), extent, extent};
}

/// Extents of about `wanted`: that one, and those of which a whole number ends on one of the source's edges.
std::vector<double> extents_near(double wanted, const SourceFrame& frame) {
  std::vector<double> found = {wanted};
  const WorldBounds bounds = frame.bounds();
  for (const double length : {bounds.x1, bounds.z1}) {
    const double count = std::max(std::floor(length / wanted), 1.0);
    for (const double tiles : {count, count + 1.0}) {
      const double extent = extent_reaching(length, static_cast<std::int64_t>(tiles));
      if (is_near((wanted / extent) * (wanted / extent))) found.push_back(extent);
    }
  }
  return found;
}

/// Square tiles of the shape that wastes least, of the density or spacing asked for, or about a vertex for a sample.
Lattice square_lattice(const SourceFrame& frame, const PlanRequest& request) {
  const bool is_one = fits_one_tile(frame, request);
  const bool is_free = !request.density && !request.spacing && !frame.wraps_x;
  const WorldBounds bounds = frame.bounds();
  std::optional<Lattice> best;
  double best_cost = 0.0;
  for_each_level(request, [&](int levels, int unit, double level_cost) {
    for (int cells = unit; cells <= static_cast<int>(kLargestSide * (kUsualColumns - 4)); cells += unit) {
      const int cell_rows = static_cast<int>(std::lround(cells / kSin60 / (2 * unit))) * 2 * unit;
      const double aspect = cell_rows * kSin60 / cells;
      if (!(off(aspect) <= kWorstAspect)) continue;
      const double wanted = wanted_extent(cells, cell_rows, frame, request);
      for (const double extent : is_free ? extents_near(wanted, frame) : std::vector<double>{wanted}) {
        if (bounds.x1 / extent > kMostTilesTried || bounds.z1 / extent > kMostTilesTried) continue;
        const Lattice lattice = square_tiles(TileShape::make(cells + 4, cell_rows + 3, levels), extent, frame);
        const auto tiles = static_cast<double>(lattice.columns * lattice.rows);
        if (is_one && tiles > 1.0) continue;
        const double area = lattice.extent_x * lattice.extent_z;
        const double density = wanted * wanted / area;
        // One tile is as large as it must be, and has no other beside it.
        const double size = is_one ? static_cast<double>(lattice.shape.stored_vertex_count())
                                   : tiles * area * cost_of_size(cells, cell_rows);
        // Few tiles that go round a globe may be far from the density that is wanted.
        const double round = is_near(density) ? 1.0 : kFarDensity;
        const double cost = level_cost * size * cost_of_misfit(density, aspect) * round;
        if (best && cost >= best_cost) continue;
        best = lattice;
        best_cost = cost;
      }
    }
  });
  if (best) return *best;
  const TileShape shape = TileShape::nearest(kUsualColumns, kUsualRows, request.levels.value_or(kUsualLevels));
  return square_tiles(shape, wanted_extent(shape.cell_columns(), shape.cell_rows(), frame, request), frame);
}

/// Tiles of whole samples, each with two rows of triangles for a row of them: the size that wastes least.
Lattice lattice_through_samples(const SourceFrame& frame, int levels) {
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
  const double extent_x = best->cell_columns() * frame.spacing_x;
  const double extent_z = best->cell_columns() * frame.spacing_z;
  const std::int64_t rows = tiles_to_cover(bounds.z1, extent_z);
  if (!frame.wraps_x) return {*best, tiles_to_cover(bounds.x1, extent_x), rows, extent_x, extent_z};
  const std::int64_t columns = frame.width / best->cell_columns();
  return {*best, columns, rows, bounds.x1 / static_cast<double>(columns), extent_z};
}

/// Tiles of the shape asked for; to fit, as many as end on the source's edges when they are stretched a little.
Lattice lattice_of_shape(const TileShape& shape, const SourceFrame& frame, const PlanRequest& request) {
  const double extent = wanted_extent(shape.cell_columns(), shape.cell_rows(), frame, request);
  const Lattice square = square_tiles(shape, extent, frame);
  if (!request.fit) return square;
  const WorldBounds bounds = frame.bounds();
  const std::int64_t columns = tiles_along(bounds.x1, square.extent_x);
  const std::int64_t rows = tiles_along(bounds.z1, square.extent_z);
  const Lattice fitted{shape, columns, rows, bounds.x1 / static_cast<double>(columns),
                       bounds.z1 / static_cast<double>(rows)};
  const double stretch = std::max(off(fitted.extent_x / extent), off(fitted.extent_z / extent));
  return stretch <= kMostStretch ? fitted : square;
}

TileShape shape_of_budget(const PlanRequest& request) {
  const std::vector<TileShape> found = candidate_shapes(request, 1);
  if (!found.empty()) return found.front();
  refuse(fmt::format("no tile shape of {} levels lies near the budget of {}; use fewer `levels` or a larger budget",
                     request.levels.value_or(kUsualLevels), request.budget->count));
}

Lattice choose_lattice(const SourceFrame& frame, const PlanRequest& request) {
  const int levels = request.levels.value_or(kUsualLevels);
  if (request.shape) {
    return lattice_of_shape(TileShape::make(request.shape->first, request.shape->second, levels), frame, request);
  }
  if (request.budget) return lattice_of_shape(shape_of_budget(request), frame, request);
  if (request.through_samples) return lattice_through_samples(frame, levels);
  if (!request.fit) return square_lattice(frame, request);
  std::optional<Lattice> fitted;
  if (fits_one_tile(frame, request)) fitted = fitted_lattice(frame, request, true);
  if (!fitted) fitted = fitted_lattice(frame, request, false);
  return fitted ? *fitted : square_lattice(frame, request);
}

void check(const PlanRequest& request) {
  require_known("`wrap_x`", request.ground.wrap, Wrap::kAlways);
  require_known("`projection`", request.ground.projection.kind, ProjectionKind::kSystem);
  if (request.levels && (*request.levels < 1 || *request.levels > kMaxTileLevels)) {
    refuse(fmt::format("`levels` is {}, must be 1 to {}", *request.levels, kMaxTileLevels));
  }
  if (request.density && request.spacing) refuse("both `density` and `spacing` are given; give one");
  if (request.shape && request.budget) refuse("both a tile shape and a tile budget are given; give one");
  const auto check_positive = [](const std::optional<double>& value, const char* option) {
    if (value && !(std::isfinite(*value) && *value > 0.0))
      refuse(fmt::format("{} is {}, must be positive", option, *value));
  };
  check_positive(request.density, "`density`");
  check_positive(request.spacing, "`spacing`");
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
  if (request.through_samples && (!is_through || request.density || request.spacing)) {
    refuse(info.path +
           ": a lattice through the samples goes with none of `fit`, `wrap_x`, `density` and `spacing`, nor with a "
           "source that is projected; leave these out, or it");
  }
  const Lattice lattice = choose_lattice(frame, request);
  Plan plan{.frame = frame,
            .grid = TileGrid::make(lattice.shape, lattice.columns, lattice.rows, lattice.extent_x, lattice.extent_z)};
  const TileShape& shape = plan.grid.shape();
  plan.density = frame.spacing_x * frame.spacing_z / (2.0 * plan.grid.sigma_x() * plan.grid.sigma_z());
  if (plan.density > kMostDensityAsked) {
    refuse(
        fmt::format("the lattice has {:.3g} vertices for one of the input's samples, at most {} are possible; use a "
                    "larger `spacing` or a smaller `density`",
                    plan.density, kMostDensityAsked));
  }
  plan.lattice_samples = shape.stored_vertex_count() * plan.grid.tile_count();
  constexpr double kTypicalBits = 5.0;
  plan.estimated_bytes = static_cast<std::uint64_t>(static_cast<double>(plan.lattice_samples) * kTypicalBits / 8.0 +
                                                    150.0 * static_cast<double>(plan.grid.tile_count()) + 20e3);
  return plan;
}

bool can_go_through_samples(const SourceFrame& frame, const PlanRequest& request) {
  const int unit = 1 << (request.levels.value_or(kUsualLevels) - 1);
  return !frame.warp && !request.fit && (!frame.wraps_x || frame.width % unit == 0);
}

std::vector<Warning> plan_warnings(const SourceInfo& info, const Plan& plan, const PlanRequest& request) {
  constexpr double kOnTheEdge = 1e-9;
  const WorldBounds bounds = plan.frame.bounds();
  const bool ends_on_edge = plan.grid.world_width() <= bounds.x1 * (1.0 + kOnTheEdge) &&
                            plan.grid.world_height() <= bounds.z1 * (1.0 + kOnTheEdge);
  if (!request.fit || ends_on_edge) return {};
  return {
      fmt::format("{}: its tiles are square and reach beyond its edge; to end there they would be stretched by "
                  "more than an eighth, in spite of `fit`{}",
                  info.path, request.shape || request.budget ? "; ask for smaller tiles" : "")};
}

std::vector<TileShape> candidate_shapes(const PlanRequest& request, int limit) {
  const ShapeBudget budget = request.budget.value_or(ShapeBudget{ShapeBudget::Kind::kTriangles, 100000});
  for (const double tolerance : {0.1, 0.25, 0.5, 1.0}) {
    std::vector<TileShape> found = find_shapes(request.levels.value_or(kUsualLevels), budget, tolerance, limit);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace isohf
