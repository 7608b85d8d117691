#include "isohf/restore/grid_sampler.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/base/handed_in.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/sampling/resample/kernels.h"

namespace isohf {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();
/// Samples this far beyond the surface's end, in their spacing, count as on it: ends are computed by products, and
/// georeferences are rounded.
constexpr double kRounding = 1e-6;
constexpr double kRoundedPlace = 0.01;

std::vector<double> columns_of(const SampleGrid& samples, const std::optional<Turn>& turn, double tolerance) {
  std::vector<double> columns;
  columns.reserve(static_cast<std::size_t>(samples.width));
  for (std::int64_t c = 0; c < samples.width; ++c) {
    const double x = samples.first_x + static_cast<double>(c) * samples.spacing_x;
    columns.push_back(turn ? turn->onto_ground(x, tolerance * samples.spacing_x) : x);
  }
  return columns;
}

/// Columns that are blended at once, of several rows where each must be read from a file.
constexpr std::int64_t kBlock = 2048;
/// Lattice rows that are straightened at once where memory is short: each takes a few copies of itself.
constexpr std::int64_t kLinesInScratch = 2;

bool is_inside(double place, double tolerance, double end) {
  return place >= -tolerance && place <= end + tolerance;
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
  require_size("a grid", grid.width, grid.height);
  const auto is_length = [](double value) { return value > 0.0 && std::isfinite(value); };
  if (is_length(grid.spacing_x) && is_length(grid.spacing_z) && std::isfinite(grid.first_x) &&
      std::isfinite(grid.first_z))
    return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("a grid of samples {} x {} apart from ({}, {}) on, must have spacings above 0 and a place",
                          grid.spacing_x, grid.spacing_z, grid.first_x, grid.first_z));
}

/// Some columns of the samples, and of the lattice rows that they are made of.
struct GridSampler::Block {
  std::int64_t first;  ///< column
  std::int64_t columns;
  RowParts<double> heights;
  RowParts<char> near_void;
};

GridSampler::GridSampler(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTile read_tile,
                         const SampleGrid& samples, RestoreMethod method, const std::optional<WorldBounds>& ground,
                         const ScratchFolder& scratch, const std::optional<Turn>& turn)
    : grid_(grid),
      quantisation_(quantisation),
      samples_(require_samples_near(samples, grid)),
      method_(method),
      end_z_(ground ? ground->z1 : grid.world_height()),
      tolerance_(ground ? kRoundedPlace : kRounding),
      spline_(grid, method == RestoreMethod::kHex ? columns_of(samples, turn, tolerance_) : std::vector<double>{},
              wraps_x, scratch),
      in_scratch_(scratch.has_value()),
      heights_(static_cast<std::size_t>(samples.width), scratch),
      near_void_(static_cast<std::size_t>(samples.width), scratch) {
  const double end_x = ground ? ground->x1 : grid.world_width();
  for (const double x : columns_of(samples, turn, tolerance_)) {
    const TilePoint at = grid_.locate({x, 0.0});
    columns_.push_back({is_inside(x, tolerance_ * samples.spacing_x, end_x), at.tile.column, at.point.x});
  }
  // Splines run along whole rows, triangles need what is under them.
  const bool needs_all = method_ == RestoreMethod::kHex;
  const Tiles under = needs_all ? Tiles{0, grid.tile_columns()} : tiles_under(0, samples.width);
  tiles_.emplace(grid, quantisation, std::move(read_tile), under.first, under.first + under.count - 1, scratch);
}

GridSampler::Tiles GridSampler::tiles_under(std::int64_t first, std::int64_t columns) const {
  const auto [least, most] = std::minmax_element(columns_.begin() + first, columns_.begin() + first + columns,
                                                 [](const Column& a, const Column& b) { return a.tile < b.tile; });
  return {least->tile, most->tile - least->tile + 1};
}

double GridSampler::memory_bytes(const TileGrid& grid, const SampleGrid& samples, RestoreMethod method,
                                 std::int64_t rows, int threads, bool in_scratch) {
  const auto width = static_cast<double>(samples.width);
  const auto vertices = static_cast<double>(grid.tile_columns() * grid.shape().columns());
  const bool by_splines = method == RestoreMethod::kHex;
  const double lattice_rows = static_cast<double>(rows) * samples.spacing_z / grid.sigma_z() +
                              (by_splines ? QuinticResponse::kTaps + 2.0 : 2.0);
  double bytes =
      width * (sizeof(Column) + sizeof(double)) + (in_scratch ? 0.0 : VertexRows::memory_bytes(grid, lattice_rows));
  if (!by_splines) return bytes;
  const auto lines = static_cast<double>(in_scratch ? std::min<std::int64_t>(threads, kLinesInScratch) : threads);
  bytes += lines * (28.0 * vertices + 9.0 * width);
  return bytes + (in_scratch ? threads * static_cast<double>(kBlock) * 9.0 * lattice_rows
                             : width * (9.0 * lattice_rows + 2.0 * sizeof(QuinticWeights)));
}

/// Drops the lattice rows before `first` and makes those up to `last`.
void GridSampler::keep_lattice_rows(std::int64_t first, std::int64_t last) {
  while (!is_any_near_void_.empty() && first_lattice_row_ < first) {
    heights_.drop(first_lattice_row_);
    near_void_.drop(first_lattice_row_);
    is_any_near_void_.pop_front();
    ++first_lattice_row_;
  }
  if (is_any_near_void_.empty()) first_lattice_row_ = first;
  for (;;) {
    const std::int64_t next = first_lattice_row_ + static_cast<std::int64_t>(is_any_near_void_.size());
    if (next > last) return;
    const std::int64_t tile_row = spline_.tile_row_of(next);
    tiles_->have(tile_row);
    std::int64_t end = next;
    for (; end <= last && spline_.tile_row_of(end) == tile_row; ++end) {
      heights_.add(end);
      near_void_.add(end);
      is_any_near_void_.push_back(0);
    }
    const std::int64_t strands = in_scratch_ ? std::min(kLinesInScratch, end - next) : end - next;
    oneapi::tbb::parallel_for(std::int64_t{0}, strands, [&](std::int64_t strand) {
      std::vector<double> heights(columns_.size());
      std::vector<char> near(columns_.size());
      for (std::int64_t row = next + strand; row < end; row += strands) {
        const std::vector<double> vertices =
            elevations_of(tiles_->read(tile_row, spline_.vertex_row_of(row)), quantisation_);
        const bool any = spline_.straighten(row, vertices, heights, near);
        heights_.write(row, 0, heights);
        if (any) near_void_.write(row, 0, near);
        is_any_near_void_[static_cast<std::size_t>(row - first_lattice_row_)] = any ? 1 : 0;
      }
    });
  }
}

/// The lattice rows that a row of samples is made of.
RowRange GridSampler::lattice_rows_of(std::int64_t row) const {
  const double z = std::clamp(world_z(row), 0.0, grid_.world_height());
  const std::int64_t start = quintic_weights(spline_.row_at(z)).first - QuinticResponse::kHalo;
  RowRange rows{spline_.rows() - 1, 0};
  for (std::int64_t k = start; k < start + QuinticResponse::kTaps; ++k) {
    const StandIn from = stand_in(k, spline_.rows());
    rows.first = std::min(rows.first, from.first != 0.0 ? 0 : from.at);
    rows.last = std::max(rows.last, from.last != 0.0 ? spline_.rows() - 1 : from.at);
  }
  return rows;
}

void GridSampler::read(std::int64_t first, std::int64_t rows, std::span<double> elevations) {
  ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(rows * samples_.width));
  const auto tile_row_at = [&](std::int64_t row) { return grid_.locate({0.0, world_z(row)}).tile.row; };
  for (std::int64_t row = first; row < first + rows; ++row) tiles_->have(tile_row_at(row));
  if (method_ == RestoreMethod::kHex) {
    const RowRange north = lattice_rows_of(first);
    const RowRange south = lattice_rows_of(first + rows - 1);
    keep_lattice_rows(std::min(north.first, south.first), std::max(north.last, south.last));
  }
  const std::int64_t blocks = (samples_.width + kBlock - 1) / kBlock;
  const std::int64_t together = in_scratch_ ? rows : 1;
  oneapi::tbb::parallel_for(std::int64_t{0}, blocks * (rows / together), [&](std::int64_t part) {
    const std::int64_t column = part % blocks * kBlock;
    const std::int64_t columns = std::min(kBlock, samples_.width - column);
    const auto from = static_cast<std::size_t>(column);
    const auto count = static_cast<std::size_t>(columns);
    Block block{
        column, columns, {heights_, first_lattice_row_, from, count}, {near_void_, first_lattice_row_, from, count}};
    const std::int64_t start = part / blocks * together;
    for (std::int64_t i = start; i < start + together; ++i) {
      read_row(first + i, block, elevations.subspan(static_cast<std::size_t>(i * samples_.width) + from, count));
    }
  });
  // What lies North of the next row's tiles is done with.
  tiles_->drop_before(tile_row_at(first + rows));
}

void GridSampler::read_on_triangles(const TilePoint& at, const Block& block, std::span<double> out) const {
  const Column* const columns = columns_.data() + block.first;
  const Tiles under = tiles_under(block.first, block.columns);
  const TriangleRows vertices(*tiles_, grid_.shape(), at.tile.row, at.point.z, under.first, under.count);
  for (std::size_t c = 0; c < out.size(); ++c) {
    const Column& column = columns[c];
    const Barycentric where = snapped(barycentric(grid_.shape(), {column.x, at.point.z}));
    out[c] = column.inside ? vertices.elevation(quantisation_, column.tile, where) : kVoid;
  }
}

void GridSampler::read_row(std::int64_t row, Block& block, std::span<double> out) const {
  const double z = world_z(row);
  if (!is_inside(z, tolerance_ * samples_.spacing_z, end_z_)) {
    std::fill(out.begin(), out.end(), kVoid);
    return;
  }
  const TilePoint at = grid_.locate({0.0, z});
  if (method_ != RestoreMethod::kHex) return read_on_triangles(at, block, out);
  const QuinticResponse response = quintic_response(spline_.row_at(std::clamp(z, 0.0, grid_.world_height())));
  bool beside_voids = tiles_->has_voids(at.tile.row);
  for (std::int64_t t = 0; t < QuinticResponse::kTaps; ++t) {
    const std::int64_t k = stand_in(response.first + t, spline_.rows()).at;
    beside_voids = beside_voids || is_any_near_void_[static_cast<std::size_t>(k - first_lattice_row_)] != 0;
  }
  if (beside_voids) read_on_triangles(at, block, out);
  blend_lattice_rows(response, beside_voids, block, out);
}

/// Replaces the elevations of a row by the spline's; those that are void, or have voids around, stay.
void GridSampler::blend_lattice_rows(const QuinticResponse& response, bool beside_voids, Block& block,
                                     std::span<double> out) const {
  struct LatticeRow {
    std::span<const double> heights;
    std::span<const char> near_void;  ///< empty: nowhere
  };
  struct Tap {
    StandIn share;
    LatticeRow row;
    LatticeRow first;  ///< the ends' rows, where they count
    LatticeRow last;

    [[nodiscard]] double height(std::size_t c) const {
      double sum = share.sign * row.heights[c];
      if (!first.heights.empty()) sum += share.first * first.heights[c];
      if (!last.heights.empty()) sum += share.last * last.heights[c];
      return sum;
    }
    [[nodiscard]] bool is_near_void(std::size_t c) const {
      for (const LatticeRow* each : {&row, &first, &last}) {
        if (!each->near_void.empty() && each->near_void[c] != 0) return true;
      }
      return false;
    }
  };
  const auto lattice_row = [&](std::int64_t k) {
    LatticeRow row{block.heights.row(k), {}};
    if (is_any_near_void_[static_cast<std::size_t>(k - first_lattice_row_)] != 0)
      row.near_void = block.near_void.row(k);
    return row;
  };
  std::array<Tap, QuinticResponse::kTaps> rows{};
  for (std::size_t t = 0; t < rows.size(); ++t) {
    const StandIn from = stand_in(response.first + static_cast<std::int64_t>(t), spline_.rows());
    rows[t] = {from, lattice_row(from.at), {}, {}};
    if (from.first != 0.0) rows[t].first = lattice_row(0);
    if (from.last != 0.0) rows[t].last = lattice_row(spline_.rows() - 1);
  }
  std::vector<double> sums(out.size(), 0.0);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    const double weight = response.weights[t];
    if (!rows[t].first.heights.empty() || !rows[t].last.heights.empty()) {
      for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += weight * rows[t].height(c);
      continue;
    }
    const double* heights = rows[t].row.heights.data();
    for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += weight * heights[c];
  }
  if (!beside_voids) {
    const Column* const columns = columns_.data() + block.first;
    for (std::size_t c = 0; c < out.size(); ++c) out[c] = columns[c].inside ? sums[c] : kVoid;
    return;
  }
  std::vector<char> near(out.size(), 0);
  for (const Tap& tap : rows) {
    for (const LatticeRow* row : {&tap.row, &tap.first, &tap.last}) {
      for (std::size_t c = 0; c < row->near_void.size(); ++c) near[c] = static_cast<char>(near[c] | row->near_void[c]);
    }
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
    for (std::size_t t = 0; t < rows.size(); ++t) whole = whole && !(is_core(t) && rows[t].is_near_void(c));
    if (!whole) continue;
    double sum = 0.0;
    const auto go = [&](std::size_t t, double& last, bool& ended) {
      ended = ended || rows[t].is_near_void(c);
      if (!ended) last = rows[t].height(c);
      sum += response.weights[t] * last;
    };
    const std::size_t middle = rows.size() / 2;
    double last = rows[middle].height(c);
    bool ended = false;
    for (std::size_t t = middle; t < rows.size(); ++t) go(t, last, ended);
    last = rows[middle].height(c);
    ended = false;
    for (std::size_t t = middle; t-- > 0;) go(t, last, ended);
    out[c] = sum;
  }
}

}  // namespace isohf
