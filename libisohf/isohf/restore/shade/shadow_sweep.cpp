#include "isohf/restore/shade/shadow_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/lattice/shadow_path.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
/// Quotients this near to 0 or 1 are those of the lattice's own directions, rounded.
constexpr double kOnLattice = 1e-9;
/// Columns that are turned into steps together: as many as share cache lines.
constexpr int kColumnsTogether = 16;

/// A visible or padding row of a tile at every half step from its West edge to its East edge.
void spread(const TileShape& shape, const float* row, bool is_odd, float* out) {
  const int cells = shape.cell_columns();
  if (is_odd) {
    for (int i = 0; i < cells; ++i) {
      out[2 * i] = row[1 + i];
      out[2 * i + 1] = 0.5F * (row[1 + i] + row[2 + i]);
    }
    out[2 * cells] = row[1 + cells];
    return;
  }
  out[0] = row[1];
  for (int i = 0; i + 1 < cells; ++i) {
    out[2 * i + 1] = row[2 + i];
    out[2 * i + 2] = 0.5F * (row[2 + i] + row[3 + i]);
  }
  out[2 * cells - 1] = row[1 + cells];
  out[2 * cells] = row[2 + cells];
}

/// The half step of a visible vertex.
int half_step(const TileShape& shape, int column, int row) {
  return object_x(shape.columns(), column, row);
}

}  // namespace

ShadowSweep::ShadowSweep(const TileGrid& grid, const WorldBounds& ground, double azimuth_deg, double fall,
                         double softness)
    : grid_(grid), ground_(ground), half_steps_(half_steps_across(grid.shape())) {
  const double azimuth = azimuth_deg * std::numbers::pi / 180.0;
  // The way of the light in half steps and rows.
  const double along = -std::sin(azimuth) / grid.sigma_x();
  const double across = std::cos(azimuth) / grid.sigma_z();
  const double larger = std::max(std::abs(along), std::abs(across));
  by_columns_ = std::abs(along) > std::abs(across) * (1.0 + kOnLattice);
  shift_ = std::min(std::abs(along), std::abs(across)) / larger;
  if (shift_ < kOnLattice) shift_ = 0.0;
  if (shift_ > 1.0 - kOnLattice) shift_ = 1.0;
  from_south_ = across < 0.0 && (!by_columns_ || shift_ > 0.0);
  mirrored_ = along < 0.0;
  fall_ = fall * std::hypot(along / larger * grid.sigma_x(), across / larger * grid.sigma_z());
  // Deep enough for half a softness, and for a border's place between two lines.
  most_depth_ = std::max(softness, 2.0 * fall_);
}

void ShadowSweep::begin_behind(std::int64_t tiles_west, std::int64_t tiles_east, std::int64_t rows_before) {
  columns_before_ = mirrored_ ? tiles_east : tiles_west;
  rows_before_ = rows_before;
}

std::uint64_t ShadowSweep::state_bytes() const {
  const auto lanes = static_cast<double>(half_steps_ * grid_.tile_columns());
  return static_cast<std::uint64_t>(lanes * (by_columns_ ? shift_ : 1.0) * sizeof(float)) + 64;
}

ShadowFront::Casting ShadowSweep::casting_columns() const {
  const double first = ground_.x0 / grid_.sigma_x();
  const double last = ground_.x1 / grid_.sigma_x();
  const auto end = static_cast<double>(half_steps_ * grid_.tile_columns());
  return mirrored_ ? ShadowFront::Casting{end - last, end - first} : ShadowFront::Casting{first, last};
}

/// In stored rows of a tile of that row, turned over where light comes from the South.
ShadowFront::Casting ShadowSweep::casting_rows(std::int64_t tile_row) const {
  const double north = static_cast<double>(tile_row) * grid_.shape().cell_rows() - 1.0;
  const double first = ground_.z0 / grid_.sigma_z() - north;
  const double last = ground_.z1 / grid_.sigma_z() - north;
  const double end = grid_.shape().rows() - 1.0;
  return from_south_ ? ShadowFront::Casting{end - last, end - first} : ShadowFront::Casting{first, last};
}

ShadowSweep::State ShadowSweep::pass(std::int64_t tile_row, const State& entering, const TileRowValues& heights,
                                     TileRowValues* depths) {
  if (depths != nullptr) {
    depths->resize(heights.size());
    for (std::vector<float>& tile : *depths) tile.resize(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  }
  return by_columns_ ? pass_along_columns(tile_row, entering, heights, depths)
                     : pass_along_rows(tile_row, entering, heights, depths);
}

/// Steps are the lattice's rows, lanes are half steps over the whole width. The row that two rows of tiles share is a
/// step of both: the first one's last is taken back.
ShadowSweep::State ShadowSweep::pass_along_rows(std::int64_t tile_row, const State& entering,
                                                const TileRowValues& heights, TileRowValues* depths) {
  const TileShape& shape = grid_.shape();
  const auto lanes = static_cast<int>(half_steps_ * grid_.tile_columns()) + 1;
  const std::int64_t row_of_light = rows_before_ + (from_south_ ? grid_.tile_rows() - 1 - tile_row : tile_row);
  ShadowFront front(lanes, shift_, fall_, most_depth_);
  front.resume(row_of_light * shape.cell_rows(), entering.empty() ? front.lines() : entering);
  State leaving;
  const ShadowFront::Casting columns = casting_columns();
  const ShadowFront::Casting rows = casting_rows(tile_row);
  std::vector<float> profile(static_cast<std::size_t>(lanes) + 2, kVoid);
  std::vector<float> found(static_cast<std::size_t>(lanes));
  for (int step = 1; step <= shape.cell_rows() + 1; ++step) {
    const int row = from_south_ ? shape.rows() - 1 - step : step;
    for (std::size_t tile = 0; tile < heights.size(); ++tile) {
      spread(shape, heights[tile].data() + static_cast<std::ptrdiff_t>(row) * shape.columns(), row % 2 != 0,
             profile.data() + 1 + static_cast<std::ptrdiff_t>(tile) * half_steps_);
    }
    if (mirrored_) std::reverse(profile.begin(), profile.end());
    if (step == shape.cell_rows() + 1) leaving = front.lines();
    const bool casts = step >= rows.first - 1e-6 && step <= rows.last + 1e-6;
    front.advance(profile.data() + 1, casts ? columns : ShadowFront::Casting{1.0, 0.0},
                  depths != nullptr ? found.data() : nullptr);
    if (depths == nullptr) continue;
    if (mirrored_) std::reverse(found.begin(), found.end());
    for (std::size_t tile = 0; tile < heights.size(); ++tile) {
      float* const out = (*depths)[tile].data() + static_cast<std::ptrdiff_t>(row) * shape.columns();
      const float* const from = found.data() + static_cast<std::ptrdiff_t>(tile) * half_steps_;
      for (int c = 1; c <= last_visible_column(shape, row); ++c) out[c] = from[half_step(shape, c, row)];
    }
  }
  return leaving;
}

/// Steps are columns half a lattice step apart, lanes are the stored rows of the tiles, padding included: one row of
/// tiles sees the ground a row beyond its edge, so that the same lines lie beside vertices that two of them share.
ShadowSweep::State ShadowSweep::pass_along_columns(std::int64_t tile_row, const State& entering,
                                                   const TileRowValues& heights, TileRowValues* depths) {
  const TileShape& shape = grid_.shape();
  const int lanes = shape.rows();
  ShadowFront front(lanes, shift_, fall_, most_depth_);
  front.resume(columns_before_ * half_steps_, front.lines());
  State leaving;
  std::size_t entered = 0;
  const ShadowFront::Casting columns = casting_columns();
  const ShadowFront::Casting rows = casting_rows(tile_row);
  const std::size_t across = static_cast<std::size_t>(half_steps_) + 1;
  const std::size_t lane_stride = static_cast<std::size_t>(lanes) + 2;
  std::vector<float> spread_rows(across * static_cast<std::size_t>(lanes));
  std::vector<float> profiles(lane_stride * across, kVoid);
  std::vector<float> found(static_cast<std::size_t>(lanes) * across);
  std::int64_t steps = 0;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    const std::size_t tile = mirrored_ ? heights.size() - 1 - k : k;
    for (int row = 0; row < lanes; ++row) {
      const int lane = from_south_ ? lanes - 1 - row : row;
      float* const out = spread_rows.data() + static_cast<std::size_t>(lane) * across;
      spread(shape, heights[tile].data() + static_cast<std::ptrdiff_t>(row) * shape.columns(), row % 2 != 0, out);
      if (mirrored_) std::reverse(out, out + across);
    }
    for (std::size_t first = 0; first < across; first += kColumnsTogether) {
      const std::size_t last = std::min(first + kColumnsTogether, across);
      for (int lane = 0; lane < lanes; ++lane) {
        const float* const from = spread_rows.data() + static_cast<std::size_t>(lane) * across;
        for (std::size_t x = first; x < last; ++x) {
          profiles[x * lane_stride + 1 + static_cast<std::size_t>(lane)] = from[x];
        }
      }
    }
    // The first column is the last one of the tile before.
    if (k > 0) {
      std::copy_n(found.begin() + static_cast<std::ptrdiff_t>(half_steps_) * lanes, lanes, found.begin());
    }
    for (std::size_t x = k > 0 ? 1 : 0; x < across; ++x, ++steps) {
      if (front.is_shifting()) {
        leaving.push_back(front.line_arriving(lanes - 3));
        front.let_in(entered < entering.size() ? entering[entered++] : -std::numeric_limits<float>::infinity());
      }
      const auto at = static_cast<double>(steps);
      const bool casts = at >= columns.first - 1e-6 && at <= columns.last + 1e-6;
      front.advance(profiles.data() + x * lane_stride + 1, casts ? rows : ShadowFront::Casting{1.0, 0.0},
                    found.data() + x * static_cast<std::size_t>(lanes));
    }
    if (depths == nullptr) continue;
    for (int row = 1; row <= lanes - 2; ++row) {
      const auto lane = static_cast<std::size_t>(from_south_ ? lanes - 1 - row : row);
      float* const out = (*depths)[tile].data() + static_cast<std::ptrdiff_t>(row) * shape.columns();
      for (int c = 1; c <= last_visible_column(shape, row); ++c) {
        const int x = half_step(shape, c, row);
        out[c] =
            found[static_cast<std::size_t>(mirrored_ ? half_steps_ - x : x) * static_cast<std::size_t>(lanes) + lane];
      }
    }
  }
  return leaving;
}

}  // namespace isohf
