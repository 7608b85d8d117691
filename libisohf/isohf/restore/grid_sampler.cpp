#include "isohf/restore/grid_sampler.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "isohf/archive/codec/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/surface/resample/kernels.h"

namespace isohf {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();
/// Samples this far beyond the surface's end, in their spacing, count as on it: ends are computed by products.
constexpr double kEndTolerance = 1e-6;

std::vector<double> columns_of(const SampleGrid& samples) {
  std::vector<double> columns;
  columns.reserve(static_cast<std::size_t>(samples.width));
  for (std::int64_t c = 0; c < samples.width; ++c) {
    columns.push_back(samples.first_x + static_cast<double>(c) * samples.spacing_x);
  }
  return columns;
}

bool is_inside(double place, double spacing, double end) {
  return place >= -kEndTolerance * spacing && place <= end + kEndTolerance * spacing;
}

}  // namespace

const SampleGrid& require_samples_near(const SampleGrid& samples, const TileGrid& grid) {
  require_samples(samples);
  const auto check_axis = [](double first, double spacing, std::int64_t count, double world) {
    const double last = first + spacing * static_cast<double>(count - 1);
    if (std::abs(first) <= 1000.0 * world && std::abs(last) <= 1000.0 * world) return;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} samples {} apart reach from {} to {}, far beyond the "
                                                         "surface, which ends at {}; use a smaller spacing",
                                                         count, spacing, first, last, world));
  };
  check_axis(samples.first_x, samples.spacing_x, samples.width, grid.world_width());
  check_axis(samples.first_z, samples.spacing_z, samples.height, grid.world_height());
  return samples;
}

void require_samples(const SampleGrid& grid) {
  if (grid.width < 1 || grid.height < 1 || !(grid.spacing_x > 0.0) || !(grid.spacing_z > 0.0)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("a grid of {}x{} samples {} x {} apart, must have at least one and positive spacing",
                            grid.width, grid.height, grid.spacing_x, grid.spacing_z));
  }
}

GridSampler::GridSampler(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTiles read_tiles,
                         const SampleGrid& samples, RestoreMethod method, bool snaps,
                         const std::optional<TileGrid>& world)
    : grid_(grid),
      quantisation_(quantisation),
      read_tiles_(std::move(read_tiles)),
      samples_(require_samples_near(samples, world.value_or(grid))),
      method_(method),
      end_z_(world.value_or(grid).world_height()),
      snaps_(snaps),
      spline_(grid, method == RestoreMethod::kHex ? columns_of(samples) : std::vector<double>{}, wraps_x) {
  for (const double x : columns_of(samples)) {
    const TilePoint at = grid_.locate({x, 0.0});
    columns_.push_back(
        {is_inside(x, samples.spacing_x, world.value_or(grid).world_width()), at.tile.column, at.point.x});
  }
}

const GridSampler::TileRow& GridSampler::tile_row(std::int64_t row) {
  for (const TileRow& kept : tile_rows_) {
    if (kept.row == row) return kept;
  }
  TileRow made{row, false, {}};
  made.elevations.resize(static_cast<std::size_t>(grid_.tile_columns()));
  std::atomic<bool> any = false;
  // Splines run along whole rows, triangles need what is under them.
  const bool needs_all = method_ == RestoreMethod::kHex;
  const std::int64_t first = needs_all ? 0 : columns_.front().tile;
  const std::int64_t last = needs_all ? grid_.tile_columns() - 1 : columns_.back().tile;
  std::vector<TileIndex> tiles;
  for (std::int64_t column = first; column <= last; ++column) tiles.push_back({column, row});
  for_each_tile(read_tiles_, tiles, [&](std::size_t i, const TileCodes& codes) {
    std::vector<double>& elevations = made.elevations[static_cast<std::size_t>(first) + i];
    elevations = elevations_of(codes, quantisation_);
    if (std::any_of(elevations.begin(), elevations.end(), [](double h) { return std::isnan(h); })) any = true;
  });
  made.has_voids = any;
  tile_rows_.push_back(std::move(made));
  return tile_rows_.back();
}

const GridSampler::TileRow& GridSampler::kept_tile_row(std::int64_t row) const {
  const auto found =
      std::find_if(tile_rows_.begin(), tile_rows_.end(), [&](const TileRow& kept) { return kept.row == row; });
  ISOHF_ASSERT(found != tile_rows_.end());
  return *found;
}

/// Drops the lattice rows before `first` and makes those up to `last`.
void GridSampler::keep_lattice_rows(std::int64_t first, std::int64_t last) {
  while (!lattice_rows_.empty() && first_lattice_row_ < first) {
    lattice_rows_.pop_front();
    ++first_lattice_row_;
  }
  if (lattice_rows_.empty()) first_lattice_row_ = first;
  for (;;) {
    const std::int64_t next = first_lattice_row_ + static_cast<std::int64_t>(lattice_rows_.size());
    if (next > last) return;
    const TileRow& tiles = tile_row(spline_.tile_row_of(next));
    std::int64_t end = next;
    while (end <= last && spline_.tile_row_of(end) == tiles.row) ++end;
    const std::size_t have = lattice_rows_.size();
    lattice_rows_.resize(have + static_cast<std::size_t>(end - next));
    oneapi::tbb::parallel_for(next, end, [&](std::int64_t row) {
      LatticeRow& made = lattice_rows_[have + static_cast<std::size_t>(row - next)];
      made.heights.resize(columns_.size());
      made.near_void.resize(columns_.size());
      made.any_near_void = spline_.straighten(row, tiles.elevations, made.heights, made.near_void);
    });
  }
}

void GridSampler::read(std::int64_t first, std::int64_t rows, std::span<double> elevations) {
  ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(rows * samples_.width));
  const auto tile_row_at = [&](std::int64_t row) { return grid_.locate({0.0, world_z(row)}).tile.row; };
  for (std::int64_t row = first; row < first + rows; ++row) (void)tile_row(tile_row_at(row));
  if (method_ == RestoreMethod::kHex) {
    std::int64_t low = spline_.rows() - 1;
    std::int64_t high = 0;
    for (const std::int64_t row : {first, first + rows - 1}) {
      const double z = std::clamp(world_z(row), 0.0, grid_.world_height());
      const std::int64_t start = quintic_weights(spline_.row_at(z)).first - QuinticResponse::kHalo;
      for (std::int64_t k = start; k < start + QuinticResponse::kTaps; ++k) {
        low = std::min(low, mirror_index(k, spline_.rows()));
        high = std::max(high, mirror_index(k, spline_.rows()));
      }
    }
    keep_lattice_rows(low, high);
  }
  oneapi::tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t i) {
    read_row(first + i, elevations.subspan(static_cast<std::size_t>(i * samples_.width), columns_.size()));
  });
  // What lies North of the next row's tiles is done with.
  const std::int64_t next = tile_row_at(first + rows);
  std::erase_if(tile_rows_, [next](const TileRow& kept) { return kept.row < next; });
}

void GridSampler::read_on_triangles(const TilePoint& at, std::span<double> out) const {
  const TileRow& tiles = kept_tile_row(at.tile.row);
  const TileShape& shape = grid_.shape();
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const Column& column = columns_[c];
    const View2D<const double> heights(tiles.elevations[static_cast<std::size_t>(column.tile)].data(), shape.columns(),
                                       shape.rows());
    const Barycentric where = barycentric(shape, {column.x, at.point.z});
    out[c] = column.inside ? interpolate(snaps_ ? snapped(where) : where, heights) : kVoid;
  }
}

void GridSampler::read_row(std::int64_t row, std::span<double> out) const {
  const double z = world_z(row);
  if (!is_inside(z, samples_.spacing_z, end_z_)) {
    std::fill(out.begin(), out.end(), kVoid);
    return;
  }
  const TilePoint at = grid_.locate({0.0, z});
  if (method_ != RestoreMethod::kHex) return read_on_triangles(at, out);
  const QuinticResponse response = quintic_response(spline_.row_at(std::clamp(z, 0.0, grid_.world_height())));
  bool beside_voids = kept_tile_row(at.tile.row).has_voids;
  for (std::int64_t t = 0; t < QuinticResponse::kTaps; ++t) {
    const std::int64_t k = mirror_index(response.first + t, spline_.rows());
    beside_voids = beside_voids || lattice_rows_[static_cast<std::size_t>(k - first_lattice_row_)].any_near_void;
  }
  if (beside_voids) read_on_triangles(at, out);
  blend_lattice_rows(response, beside_voids, out);
}

/// Replaces the elevations of a row by the spline's; those that are void, or have voids around, stay.
void GridSampler::blend_lattice_rows(const QuinticResponse& response, bool beside_voids, std::span<double> out) const {
  std::array<const LatticeRow*, QuinticResponse::kTaps> rows{};
  for (std::size_t t = 0; t < rows.size(); ++t) {
    const std::int64_t k = mirror_index(response.first + static_cast<std::int64_t>(t), spline_.rows());
    rows[t] = &lattice_rows_[static_cast<std::size_t>(k - first_lattice_row_)];
  }
  std::vector<double> sums(out.size(), 0.0);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    const double weight = response.weights[t];
    const double* heights = rows[t]->heights.data();
    for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += weight * heights[c];
  }
  if (!beside_voids) {
    for (std::size_t c = 0; c < out.size(); ++c) out[c] = columns_[c].inside ? sums[c] : kVoid;
    return;
  }
  std::vector<char> near(out.size(), 0);
  for (const LatticeRow* row : rows) {
    for (std::size_t c = 0; c < near.size(); ++c) near[c] = static_cast<char>(near[c] | row->near_void[c]);
  }
  const auto is_core = [](std::size_t t) {
    return t >= QuinticResponse::kHalo && t < QuinticResponse::kTaps - QuinticResponse::kHalo;
  };
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (std::isnan(out[c])) continue;
    if (near[c] == 0) {
      out[c] = sums[c];
      continue;
    }
    // Beside voids the column goes on, level, from the last row that has a height.
    bool whole = true;
    for (std::size_t t = 0; t < rows.size(); ++t) whole = whole && !(is_core(t) && rows[t]->near_void[c] != 0);
    if (!whole) continue;
    double sum = 0.0;
    const auto go = [&](std::size_t t, double& last, bool& ended) {
      ended = ended || rows[t]->near_void[c] != 0;
      if (!ended) last = rows[t]->heights[c];
      sum += response.weights[t] * last;
    };
    const std::size_t middle = rows.size() / 2;
    double last = rows[middle]->heights[c];
    bool ended = false;
    for (std::size_t t = middle; t < rows.size(); ++t) go(t, last, ended);
    last = rows[middle]->heights[c];
    ended = false;
    for (std::size_t t = middle; t-- > 0;) go(t, last, ended);
    out[c] = sum;
  }
}

}  // namespace isohf
