#include "isohf/sampling/resample/tile_resampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/sampling/resample/row_sampler.h"
#include "isohf/sampling/resample/void_rule.h"

namespace isohf {
namespace {

/// Beyond this many samples no slope goes on: next to a pole a lattice step crosses any number of columns.
constexpr double kMostContinued = 256.0;

/// Samples that kContinuedSteps lattice steps cross at most, along u and v, anywhere on the source's border.
SourcePosition continued_samples(const TileGrid& grid, const WarpPlace& place) {
  const ExactWarp warp(place);
  constexpr int kPlaces = 64;
  const auto last_u = static_cast<double>(place.width - 1);
  const auto last_v = static_cast<double>(place.height - 1);
  const double steps[2][2] = {{2.0 * grid.sigma_x(), 0.0}, {0.0, grid.sigma_z()}};
  SourcePosition most;
  const auto look_at = [&](double u, double v) {
    const WorldPoint world = warp.world_from_source({u, v});
    for (const auto& step : steps) {
      const SourcePosition there = warp.source_from_world({world.x + step[0], world.z + step[1]});
      const double across = std::remainder(there.u - u, place.columns_round());
      most.u = std::max(most.u, std::abs(across));  // a NaN is passed over
      most.v = std::max(most.v, std::abs(there.v - v));
    }
  };
  for (int i = 0; i <= kPlaces; ++i) {
    const double share = static_cast<double>(i) / kPlaces;
    look_at(share * last_u, 0.0);
    look_at(share * last_u, last_v);
    look_at(0.0, share * last_v);
    look_at(last_u, share * last_v);
  }
  // Upwards to a sixteenth: last bits of the projection must not decide what is void.
  const auto rounded = [](double samples) {
    return std::min(std::ceil(kContinuedSteps * samples * 16.0 + 0.01) / 16.0, kMostContinued);
  };
  return {rounded(most.u), rounded(most.v)};
}

/// Taps of all columns of a tile's rows of one parity.
ColumnTaps taps_of_tile(const TileGrid& grid, const SourceAxis& axis, const Kernel& kernel, TileIndex tile,
                        int parity) {
  std::vector<double> world_x(static_cast<std::size_t>(grid.shape().columns()));
  const std::int64_t round = grid.tile_columns() * 2 * grid.shape().cell_columns();
  for (std::size_t c = 0; c < world_x.size(); ++c) {
    LatticeVertex vertex = grid.lattice_vertex(tile, {static_cast<int>(c), parity});
    // The same vertex has the same bits on both sides of the join.
    if (axis.wraps()) vertex.x = ((vertex.x % round) + round) % round;
    world_x[c] = grid.world_from_lattice(vertex).x;
  }
  return make_column_taps(axis, kernel, world_x);
}

/// coarser  as SourceGeometry has it
LatticeAround around_of(const TileGrid& grid, const SourceAxis& x, const SourceAxis& z, double coarser) {
  return {LatticeAround::reach_of(2.0 * grid.sigma_x() / coarser / x.spacing_world()),
          LatticeAround::reach_of(grid.sigma_z() / coarser / z.spacing_world()),
          grid.sigma_x() / coarser,
          grid.sigma_z() / coarser,
          x.spacing_world(),
          z.spacing_world(),
          nullptr};
}

Window window_of(const RowRange& columns, const RowRange& rows) {
  return {columns.first, rows.first, columns.last - columns.first + 1, rows.last - rows.first + 1};
}

/// The samples that the kernel reads between two positions on an axis, and the void rule around them.
RowRange needed_between(const SourceAxis& axis, const Kernel& kernel, std::int64_t reach, double least, double most) {
  const std::int64_t end = axis.samples() - 1;
  const std::int64_t beyond = reach > kernel.taps() / 2 ? reach : 0;
  RowRange range{kernel.at(least).first, kernel.at(most).first + kernel.taps() - 1};
  const bool is_across = range.first - beyond < 0 || range.last + beyond > end;
  if (axis.wraps() && is_across) return {0, end};
  // Taps beyond an end are made of those as far inside.
  range = {std::min(range.first, 2 * end - range.last), std::max(range.last, -range.first)};
  return {std::max<std::int64_t>(range.first - beyond, 0), std::min(range.last + beyond, end)};
}

constexpr float kVoidHeight = std::numeric_limits<float>::quiet_NaN();

/// Which vertices beyond the source's East and South edges have an elevation: those within three lattice steps, and of
/// each coarser level of detail, those of overviews too, its own vertices within one of its steps. So the surface ends
/// soon, and no triangle of any level that touches the source lacks a vertex.
///
///        source |
///   o   o   o   | o   o   o               three steps: triangles across the edge need one, the normals of their
///     o   o   o |   o   o   o             vertices another, and splines on the way back to samples a third
///   o   o   o   | o   o   o   o       o   a vertex of level 3 on every eighth row, eight steps beyond at most
class SurfaceEnd {
 public:
  SurfaceEnd(const TileGrid& grid, const SourceAxis& x, const SourceAxis& z)
      : end_x_(x.wraps() ? HUGE_VAL : x.end_world() / (2.0 * grid.sigma_x())),
        end_z_(z.end_world() / grid.sigma_z()),
        last_x_(grid.tile_columns() * 2 * grid.shape().cell_columns()),
        last_z_(grid.tile_rows() * grid.shape().cell_rows()) {}

  [[nodiscard]] bool holds(LatticeVertex vertex) const {
    const double beyond =
        std::max(static_cast<double>(vertex.x) / 2.0 - end_x_, static_cast<double>(vertex.z) - end_z_);
    // The tiles' last vertices stand in for all those of coarser levels beyond.
    const int level = std::min(vertex.x == last_x_ ? kMostLevels : level_of(vertex.x),
                               vertex.z == last_z_ ? kMostLevels : level_of(vertex.z));
    return beyond <= std::max(kSteps, std::ldexp(1.0, level)) + kTolerance;
  }
  /// Whether a row has a vertex that has an elevation.
  [[nodiscard]] bool holds_row(std::int64_t z) const {
    const int level = z == last_z_ ? kMostLevels : level_of(z);
    return static_cast<double>(z) - end_z_ <= std::max(kSteps, std::ldexp(1.0, level)) + kTolerance;
  }
  /// Whether a vertex so far to the East and South, and all before it, have one.
  [[nodiscard]] bool holds_all(LatticeVertex last) const {
    return static_cast<double>(last.x) / 2.0 - end_x_ <= kSteps && static_cast<double>(last.z) - end_z_ <= kSteps;
  }

 private:
  static constexpr double kSteps = 3.0;
  static constexpr double kTolerance = 1e-6;  ///< of a step; ends are computed by products
  static constexpr int kMostLevels = 62;

  /// The coarsest level of which a vertex at such a coordinate, in half column steps or rows, may be one.
  [[nodiscard]] static int level_of(std::int64_t at) {
    return std::min(std::countr_zero(static_cast<std::uint64_t>(at)), kMostLevels);
  }

  double end_x_;  ///< of the source, in column steps
  double end_z_;  ///< in rows
  std::int64_t last_x_;
  std::int64_t last_z_;
};

class GridResampler final : public TileResampler {
 public:
  GridResampler(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
                const ElevationRange& limits, double coarser);

  [[nodiscard]] RowRange rows_needed(std::int64_t tile_row) const override {
    return rows_[static_cast<std::size_t>(tile_row)];
  }
  [[nodiscard]] std::optional<Window> window_about(TileIndex tile) const override;
  /// O(C*R*taps); no allocation proportional to anything but the tile.
  bool cut(TileIndex tile, const ReadBand& read, std::span<float> heights) const override;

 private:
  TileGrid grid_;
  SourceAxis axis_x_;
  Kernel kernel_;
  LatticeAround around_;
  SurfaceEnd end_;
  RowSampler sampler_;
  std::vector<RowRange> rows_;     ///< that each row of tiles reads
  std::vector<RowRange> columns_;  ///< that each column of tiles reads
};

GridResampler::GridResampler(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z,
                             const Kernel& kernel, const ElevationRange& limits, double coarser)
    : grid_(grid),
      axis_x_(axis_x),
      kernel_(kernel),
      around_(around_of(grid, axis_x, axis_z, coarser)),
      end_(grid, axis_x, axis_z),
      sampler_(axis_x, axis_z, kernel, limits, around_),
      rows_(static_cast<std::size_t>(grid.tile_rows()), RowRange::none()),
      columns_(static_cast<std::size_t>(grid.tile_columns()), RowRange::none()) {
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    for (int r = 0; r < grid.shape().rows(); ++r) {
      sampler_.add_rows_needed(grid.world_from_lattice(grid.lattice_vertex({0, row}, {0, r})).z,
                               rows_[static_cast<std::size_t>(row)]);
    }
  }
  for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
    for (const int parity : {0, 1}) {
      add_columns_needed(axis_x_, taps_of_tile(grid_, axis_x_, kernel_, {column, 0}, parity),
                         around_.reach_x > kernel_.taps() / 2 ? around_.reach_x : 0,
                         columns_[static_cast<std::size_t>(column)]);
    }
  }
}

std::optional<Window> GridResampler::window_about(TileIndex tile) const {
  return window_of(columns_[static_cast<std::size_t>(tile.column)], rows_[static_cast<std::size_t>(tile.row)]);
}

bool GridResampler::cut(TileIndex tile, const ReadBand& read, std::span<float> heights) const {
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  ISOHF_ASSERT(heights.size() == static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  const std::optional<SourceBand> band = read(*window_about(tile));
  if (!band) return false;
  const std::array<ColumnTaps, 2> taps = {taps_of_tile(grid_, axis_x_, kernel_, tile, 0),
                                          taps_of_tile(grid_, axis_x_, kernel_, tile, 1)};
  const GridVertex last{grid_.shape().columns() - 1, grid_.shape().rows() - 1};
  const bool is_whole = end_.holds_all(grid_.lattice_vertex(tile, {last.column, last.row - 1})) &&
                        end_.holds_all(grid_.lattice_vertex(tile, last));
  RowSampler::Scratch scratch;
  for (int r = 0; r <= last.row; ++r) {
    const LatticeVertex first = grid_.lattice_vertex(tile, {0, r});
    const std::span<float> row = heights.subspan(static_cast<std::size_t>(r) * columns, columns);
    if (!end_.holds_row(first.z)) {
      std::ranges::fill(row, kVoidHeight);
      continue;
    }
    sampler_.sample(*band, grid_.world_from_lattice(first).z, taps[static_cast<std::size_t>(r & 1)], scratch, row);
    for (int c = 0; c <= last.column && !is_whole; ++c) {
      if (!end_.holds(grid_.lattice_vertex(tile, {c, r}))) row[static_cast<std::size_t>(c)] = kVoidHeight;
    }
  }
  return true;
}

double reach_beyond(const SourceAxis& x, const SourceAxis& z) {
  return static_cast<double>(std::max(x.continued_samples(), z.continued_samples())) + 1.0;
}

/// Sum over taps x taps coefficients, the first of which is `from`.
template <int kTaps>
float blend(const float* from, std::int64_t stride, const TapWeights& columns, const TapWeights& rows) {
  float sum = 0.0F;
  for (int j = 0; j < kTaps; ++j) {
    const float* line = from + j * stride;
    float along = columns.weights[0] * line[0];
    for (int i = 1; i < kTaps; ++i) along += columns.weights[static_cast<std::size_t>(i)] * line[i];
    sum += rows.weights[static_cast<std::size_t>(j)] * along;
  }
  return sum;
}

float blend(int taps, const float* from, std::int64_t stride, const TapWeights& columns, const TapWeights& rows) {
  switch (taps) {
    case 1:
      return *from;
    case 2:
      return blend<2>(from, stride, columns, rows);
    default:
      ISOHF_ASSERT(taps == 4);
      return blend<4>(from, stride, columns, rows);
  }
}

/// Rule 5 of kernels.h: `from` as in blend, of four taps.
float held_within_cell(float height, const float* from, std::int64_t stride) {
  const float* above = from + stride + 1;
  const float* below = above + stride;
  const auto [least, most] = std::minmax({above[0], above[1], below[0], below[1]});
  return held_within(height, least, most);
}

bool any_void(const char* from, std::int64_t stride, int taps) {
  char any = 0;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) any = static_cast<char>(any | from[j * stride + i]);
  }
  return any != 0;
}

LatticeAround around_of(const TileGrid& grid, const ExactWarp& warp, double coarser) {
  const SourcePosition steps = continued_samples(grid, warp.place());
  return {LatticeAround::reach_of(steps.u / kContinuedSteps / coarser),
          LatticeAround::reach_of(steps.v / kContinuedSteps / coarser),
          grid.sigma_x() / coarser,
          grid.sigma_z() / coarser,
          1.0,
          1.0,
          &warp};
}

/// The positions on an axis that places from one to another read; least above most: none, since all of them lie further
/// than `reach` beyond an end.
SourceWarp::RowBounds read_between(const SourceAxis& axis, const SourceWarp::RowBounds& places, double reach) {
  const auto last = static_cast<double>(axis.samples() - 1);
  const auto inside = std::min(static_cast<double>(axis.continued_samples()), last);
  if (places.most < -reach || places.least > last + reach) return {HUGE_VAL, -HUGE_VAL};
  SourceWarp::RowBounds read{std::clamp(places.least, 0.0, last), std::clamp(places.most, 0.0, last)};
  // What is continued reads the edge and as far inside as it lies outside.
  if (places.least < 0.0) read.most = std::max(read.most, inside);
  if (places.most > last) read.least = std::min(read.least, last - inside);
  return read;
}

class WarpedResampler final : public TileResampler {
 public:
  /// The axes are those of positions (SourceAxis::of_positions, or one that wraps with spacing 1 for x). `limits` as in
  /// GridResampler.
  WarpedResampler(const TileGrid& grid, const WarpPlace& place, const SourceAxis& axis_x, const SourceAxis& axis_z,
                  const Kernel& kernel, const ElevationRange& limits, double coarser);
  WarpedResampler(const WarpedResampler&) = delete;
  WarpedResampler& operator=(const WarpedResampler&) = delete;

  [[nodiscard]] RowRange rows_needed(std::int64_t tile_row) const override;
  [[nodiscard]] std::optional<Window> window_about(TileIndex tile) const override;
  /// O(C*R*taps^2).
  bool cut(TileIndex tile, const ReadBand& read, std::span<float> heights) const override;

 private:
  /// Positions along both axes.
  struct Extent {
    SourceWarp::RowBounds u{HUGE_VAL, -HUGE_VAL};
    SourceWarp::RowBounds v{HUGE_VAL, -HUGE_VAL};

    void add(double at_u, double at_v) {
      u = {std::min(u.least, at_u), std::max(u.most, at_u)};
      v = {std::min(v.least, at_v), std::max(v.most, at_v)};
    }
  };
  /// u on the turn nearest to the source's middle; any number on an axis that wraps.
  [[nodiscard]] double nearest_turn(double u) const;
  /// Adds what a vertex at that position reads.
  void add_read(double u, double v, Extent& read) const;
  [[nodiscard]] Window window_of_positions(std::span<const double> u, std::span<const double> v) const;
  [[nodiscard]] Window window_of_read(const Extent& read) const;
  void sample_row(const SourceBand& band, const double* u, const double* v, float* heights) const;
  /// Any position: continued, held, void or not.
  [[nodiscard]] float sample(const SourceBand& band, double u, double v) const;
  [[nodiscard]] float sample_inside(const SourceBand& band, double u, double v) const;

  TileGrid grid_;
  SourceAxis axis_x_;
  SourceAxis axis_z_;
  Kernel kernel_;
  double reach_;  ///< samples beyond the source's ends that have an elevation, at most
  SourceWarp warp_;
  LatticeAround around_;
  std::vector<SourceWarp::RowBounds> bounds_;  ///< by tile row
  float lowest_;
  float highest_;
};

WarpedResampler::WarpedResampler(const TileGrid& grid, const WarpPlace& place, const SourceAxis& axis_x,
                                 const SourceAxis& axis_z, const Kernel& kernel, const ElevationRange& limits,
                                 double coarser)
    : grid_(grid),
      axis_x_(axis_x),
      axis_z_(axis_z),
      kernel_(kernel),
      reach_(reach_beyond(axis_x, axis_z)),
      warp_(grid, place, reach_),
      around_(around_of(grid, warp_.exact(), coarser)),
      bounds_(warp_.reading_bounds()),
      lowest_(static_cast<float>(limits.min)),
      highest_(static_cast<float>(limits.max)) {
  around_.lowest = lowest_;
  around_.highest = highest_;
}

RowRange WarpedResampler::rows_needed(std::int64_t tile_row) const {
  const SourceWarp::RowBounds read = read_between(axis_z_, bounds_[static_cast<std::size_t>(tile_row)], HUGE_VAL);
  return needed_between(axis_z_, kernel_, around_.reach_z, read.least, read.most);
}

double WarpedResampler::nearest_turn(double u) const {
  if (axis_x_.wraps()) return u;
  const double middle = static_cast<double>(axis_x_.samples() - 1) / 2.0;
  return middle + std::remainder(u - middle, warp_.exact().place().columns_round());
}

void WarpedResampler::add_read(double u, double v, Extent& read) const {
  if (std::isnan(u) || std::isnan(v)) return;
  const SourceAxis::Place x = axis_x_.place(nearest_turn(u));
  const SourceAxis::Place z = axis_z_.place(v);
  if (!x.has_elevation || !z.has_elevation) return;
  read.add(x.position, z.position);
  if (x.continued || z.continued) read.add(x.continued ? x.edge : x.position, z.continued ? z.edge : z.position);
}

Window WarpedResampler::window_of_read(const Extent& read) const {
  if (read.u.least > read.u.most || read.v.least > read.v.most) return {};
  return window_of(needed_between(axis_x_, kernel_, around_.reach_x, read.u.least, read.u.most),
                   needed_between(axis_z_, kernel_, around_.reach_z, read.v.least, read.v.most));
}

Window WarpedResampler::window_of_positions(std::span<const double> u, std::span<const double> v) const {
  // Most tiles lie within the source: extremes of four vertices at a time, which a NaN does not change.
  constexpr std::size_t kLanes = 4;
  std::array<Extent, kLanes> lanes;
  Extent all;
  std::size_t i = 0;
  for (; i + kLanes <= u.size(); i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k].add(u[i + k], v[i + k]);
  }
  for (; i < u.size(); ++i) all.add(u[i], v[i]);
  for (const Extent& lane : lanes) {
    all.add(lane.u.least, lane.v.least);
    all.add(lane.u.most, lane.v.most);
  }
  const bool is_inside = all.u.least >= 0.0 && all.u.most <= static_cast<double>(axis_x_.samples() - 1) &&
                         all.v.least >= 0.0 && all.v.most <= static_cast<double>(axis_z_.samples() - 1);
  if (!is_inside) {
    all = {};
    for (i = 0; i < u.size(); ++i) add_read(u[i], v[i], all);
  }
  return window_of_read(all);
}

std::optional<Window> WarpedResampler::window_about(TileIndex tile) const {
  // The map at 3 x 3 places of the tile. Between these, u and v leave the range there by an eighth of their second
  // differences; eight times as much is allowed for.
  constexpr double kBeyond = 4.0;  // padding, in lattice units
  const TileShape& shape = grid_.shape();
  const double width = 2.0 * shape.cell_columns();
  const double height = shape.cell_rows();
  std::array<std::array<SourcePosition, 3>, 3> at;
  const SourcePosition centre =
      warp_.at((static_cast<double>(tile.column) + 0.5) * width, (static_cast<double>(tile.row) + 0.5) * height);
  if (std::isnan(centre.u) || std::isnan(centre.v)) return std::nullopt;
  const double near_u = nearest_turn(centre.u);
  Extent seen;
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double x =
          (static_cast<double>(tile.column) + 0.5) * width + (static_cast<double>(i) - 1.0) * (0.5 * width + kBeyond);
      const double z =
          (static_cast<double>(tile.row) + 0.5) * height + (static_cast<double>(j) - 1.0) * (0.5 * height + kBeyond);
      at[j][i] = warp_.at(x, z, near_u);
      if (std::isnan(at[j][i].u) || std::isnan(at[j][i].v)) return std::nullopt;
      seen.add(at[j][i].u, at[j][i].v);
    }
  }
  SourcePosition bend;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto second = [](double a, double b, double c) { return std::abs(a - 2.0 * b + c); };
    bend.u = std::max({bend.u, second(at[k][0].u, at[k][1].u, at[k][2].u), second(at[0][k].u, at[1][k].u, at[2][k].u)});
    bend.v = std::max({bend.v, second(at[k][0].v, at[k][1].v, at[k][2].v), second(at[0][k].v, at[1][k].v, at[2][k].v)});
  }
  // Next to a pole rows turn round, and a tile may lie on either side of the far side of the body.
  const double span_u = seen.u.most - seen.u.least;
  const double span_v = seen.v.most - seen.v.least;
  if (bend.u > 0.25 * span_u + 1.0 || bend.v > 0.25 * (span_u + span_v) + 1.0) return std::nullopt;
  const SourcePosition margin{2.0 * bend.u + 1.0, 2.0 * bend.v + 1.0};
  const SourceWarp::RowBounds u{seen.u.least - margin.u, seen.u.most + margin.u};
  const SourceWarp::RowBounds v{seen.v.least - margin.v, seen.v.most + margin.v};
  const auto last_u = static_cast<double>(axis_x_.samples() - 1);
  const double round = warp_.exact().place().columns_round();
  const bool keeps_off = u.least > 0.5 * last_u - 0.5 * round && u.most < 0.5 * last_u + 0.5 * round;
  const bool is_within = u.least >= 0.0 && u.most <= last_u;
  if (!is_within && (axis_x_.wraps() || !keeps_off)) return std::nullopt;
  return window_of_read({read_between(axis_x_, u, reach_), read_between(axis_z_, v, reach_)});
}

float WarpedResampler::sample_inside(const SourceBand& band, double u, double v) const {
  return VoidRule(band, axis_x_, axis_z_, kernel_, around_).at(u, v, kernel_.at(u), kernel_.at(v));
}

float WarpedResampler::sample(const SourceBand& band, double u, double v) const {
  if (std::isnan(u) || std::isnan(v)) return kVoidHeight;
  u = nearest_turn(u);
  const SourceAxis::Place x = axis_x_.place(u);
  const SourceAxis::Place z = axis_z_.place(v);
  if (!x.has_elevation || !z.has_elevation) return kVoidHeight;
  const auto along_row = [&](double row) {
    const float height = sample_inside(band, x.position, row);
    return x.continued ? continue_slope(sample_inside(band, x.edge, row), height) : height;
  };
  float height = along_row(z.position);
  if (z.continued) height = continue_slope(along_row(z.edge), height);
  if (x.continued || z.continued) height = held_within(height, lowest_, highest_);
  return height;
}

void WarpedResampler::sample_row(const SourceBand& band, const double* u, const double* v, float* heights) const {
  const int taps = kernel_.taps();
  const auto last_u = static_cast<double>(axis_x_.samples() - 1);
  const auto last_v = static_cast<double>(axis_z_.samples() - 1);
  const std::int64_t end_column = axis_x_.samples() - taps;
  const std::int64_t first_row = band.first_row;
  const std::int64_t end_row = band.first_row + band.heights.rows() - taps;
  const std::int64_t stride = band.heights.stride();
  for (int c = 0; c < grid_.shape().columns(); ++c) {
    heights[c] = kVoidHeight;
    if (u[c] >= 0.0 && u[c] <= last_u && v[c] >= 0.0 && v[c] <= last_v) {
      const TapWeights columns = kernel_.at(u[c]);
      const TapWeights rows = kernel_.at(v[c]);
      // Away from the source's ends: no tap is another one's mirror image.
      if (columns.first >= 0 && columns.first <= end_column && rows.first >= 0 &&
          rows.first + taps <= axis_z_.samples()) {
        ISOHF_ASSERT(rows.first >= first_row && rows.first <= end_row);
        const std::int64_t at = (rows.first - first_row) * stride + columns.first - band.first_column;
        const bool near_void = band.voids.data() != nullptr && any_void(band.voids.data() + at, stride, taps);
        const float* from = band.heights.data() + at;
        heights[c] = near_void ? kVoidHeight : blend(taps, from, stride, columns, rows);
        if (std::isnan(heights[c])) {
          heights[c] = VoidRule(band, axis_x_, axis_z_, kernel_, around_).at(u[c], v[c], columns, rows);
        } else if (kernel_.is_limited()) {
          heights[c] = held_within_cell(heights[c], from, stride);
        }
        continue;
      }
    }
    heights[c] = sample(band, u[c], v[c]);
  }
}

bool WarpedResampler::cut(TileIndex tile, const ReadBand& read, std::span<float> heights) const {
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  ISOHF_ASSERT(heights.size() == static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  std::vector<double> u(heights.size());
  std::vector<double> v(heights.size());
  warp_.positions(tile, u, v);
  const Window window = window_of_positions(u, v);
  if (window.columns == 0) return false;
  const std::optional<SourceBand> band = read(window);
  if (!band) return false;
  for (std::size_t at = 0; at < heights.size(); at += columns) {
    sample_row(*band, u.data() + at, v.data() + at, heights.data() + at);
  }
  return true;
}

}  // namespace

SourceAxes make_axes(const TileGrid& grid, const SourceGeometry& geometry) {
  if (geometry.warp) {
    const SourcePosition continued = continued_samples(grid, *geometry.warp);
    const auto along = [&](std::int64_t samples, double steps) {
      return SourceAxis::of_positions(samples, geometry.registration, steps);
    };
    return {geometry.wraps_x ? SourceAxis::wrapping(geometry.width, 0.0, 1.0) : along(geometry.width, continued.u),
            along(geometry.height, continued.v)};
  }
  const SourceAxis z(geometry.height, geometry.first_sample_z, geometry.spacing_z, geometry.registration,
                     kContinuedSteps * grid.sigma_z());
  if (geometry.wraps_x) {
    return {SourceAxis::wrapping(geometry.width, geometry.first_sample_x, geometry.spacing_x), z};
  }
  return {SourceAxis(geometry.width, geometry.first_sample_x, geometry.spacing_x, geometry.registration,
                     kContinuedSteps * 2.0 * grid.sigma_x()),
          z};
}

void TileResampler::cut_from(const SourceBand& band, TileIndex tile, std::span<float> heights) const {
  const bool has_any = cut(
      tile, [&](const Window&) { return band; }, heights);
  if (!has_any) std::ranges::fill(heights, kVoidHeight);
}

std::unique_ptr<TileResampler> make_grid_resampler(const TileGrid& grid, const SourceAxes& axes, const Kernel& kernel,
                                                   const ElevationRange& limits, double coarser) {
  return std::make_unique<GridResampler>(grid, axes.x, axes.z, kernel, limits, coarser);
}

std::unique_ptr<TileResampler> make_tile_resampler(const TileGrid& grid, const SourceGeometry& geometry,
                                                   const Kernel& kernel, const ElevationRange& limits) {
  const SourceAxes axes = make_axes(grid, geometry);
  if (!geometry.warp) return make_grid_resampler(grid, axes, kernel, limits, geometry.coarser);
  return std::make_unique<WarpedResampler>(grid, *geometry.warp, axes.x, axes.z, kernel, limits, geometry.coarser);
}

}  // namespace isohf
