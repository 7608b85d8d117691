#include "isohf/light/shadow_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/lattice/shadow_path.h"

namespace isohf {
namespace {

constexpr float kVoidHeight = std::numeric_limits<float>::quiet_NaN();
/// Quotients this near to 0 or 1 are those of the lattice's own directions, rounded.
constexpr double kOnLattice = 1e-9;
/// Steps this near to the end of those that cast shadows count as on it.
constexpr double kAtEnd = 1e-6;
/// Columns that are turned into steps together: as many as share cache lines.
constexpr int kColumnsTogether = 16;
/// Tiles beside each other whose rows are read together.
constexpr std::int64_t kTilesTogether = 8;

/// Steps behind its caster from which on a penumbra is one step of light wide at least: borders then have no teeth as
/// large as cells, and the shade that a slope gives itself stays as sharp as it is.
constexpr double kStepsToFullWidth = 2.0;
/// Depths are cut off beyond what light falls on so many steps. Less makes teeth of borders on steep ground, whose
/// depth changes by more from vertex to vertex.
constexpr double kDeepestSteps = 4.0;
/// The same for ground above the shadow. A vertex that casts a shadow lies far above the one that it is in itself, and
/// its own begins at the vertex: more makes its shadow begin too far behind it, less makes lit ground dark.
constexpr double kHighestSteps = 1.25;

/// Between two heights; not above the middle, so that it casts no farther than both whatever the rounding.
float middle(float a, float b) {
  const float mean = 0.5F * (a + b);
  return mean - std::abs(mean) * 0x1p-23F;
}

/// A visible or padding row of a tile at every half step from its West edge to its East edge.
void spread(const TileShape& shape, const float* row, bool is_odd, float* out) {
  const int cells = shape.cell_columns();
  if (is_odd) {
    for (int i = 0; i < cells; ++i) {
      out[2 * i] = row[1 + i];
      out[2 * i + 1] = middle(row[1 + i], row[2 + i]);
    }
    out[2 * cells] = row[1 + cells];
    return;
  }
  out[0] = row[1];
  for (int i = 0; i + 1 < cells; ++i) {
    out[2 * i + 1] = row[2 + i];
    out[2 * i + 2] = middle(row[2 + i], row[3 + i]);
  }
  out[2 * cells - 1] = row[1 + cells];
  out[2 * cells] = row[2 + cells];
}

/// The half step of a visible vertex.
int half_step(const TileShape& shape, int column, int row) {
  return object_x(shape.columns(), column, row);
}

}  // namespace

TileRowValues::TileRowValues(const TileGrid& grid, const ScratchFolder& scratch)
    : vertex_rows_(grid.shape().rows()),
      columns_(static_cast<std::size_t>(grid.shape().columns())),
      rows_(static_cast<std::size_t>(grid.tile_columns()) * columns_, scratch) {
  for (int row = 0; row < vertex_rows_; ++row) rows_.add(row);
}

double TileRowValues::memory_bytes(const TileGrid& grid) {
  return static_cast<double>(grid.tile_columns() * grid.shape().stored_vertex_count()) * sizeof(float);
}

RowParts<float> TileRowValues::part(std::int64_t first_tile, std::int64_t tiles) const {
  return {rows_, 0, static_cast<std::size_t>(first_tile) * columns_, static_cast<std::size_t>(tiles) * columns_};
}

void TileRowValues::write_row(int row, std::int64_t first_tile, std::span<const float> values) {
  rows_.write(row, static_cast<std::size_t>(first_tile) * columns_, values);
}

void TileRowValues::write_tile(std::int64_t tile, std::span<const float> values) {
  for (int row = 0; row < vertex_rows_; ++row) {
    write_row(row, tile, values.subspan(static_cast<std::size_t>(row) * columns_, columns_));
  }
}

std::vector<float> TileRowValues::tile(std::int64_t tile) const {
  RowParts<float> rows = part(tile, 1);
  std::vector<float> values;
  for (int row = 0; row < vertex_rows_; ++row) values.insert(values.end(), rows.row(row).begin(), rows.row(row).end());
  return values;
}

double sun_radius_deg(const std::string& body) {
  constexpr double kAtOneAu_deg = 959.63 / 3600.0;  // IAU
  constexpr double kOfMars_au = 1.523679;
  return body == "Mars" ? kAtOneAu_deg / kOfMars_au : kAtOneAu_deg;
}

SweptSun swept_sun(double azimuth_deg, double elevation_deg, double radius_deg, double exaggeration,
                   double height_per_world) {
  const double radius = std::min({radius_deg, 0.5 * elevation_deg, 0.5 * (90.0 - elevation_deg)});
  const auto fall = [&](double degrees) {
    return std::tan(degrees * std::numbers::pi / 180.0) / exaggeration * height_per_world;
  };
  return {azimuth_deg, fall(elevation_deg), fall(elevation_deg + radius), fall(elevation_deg - radius)};
}

ShadowSweep::ShadowSweep(const TileGrid& grid, const WorldBounds& ground, const SweptSun& sun)
    : grid_(grid), ground_(ground), half_steps_(half_steps_across(grid.shape())) {
  const double azimuth = sun.azimuth_deg * std::numbers::pi / 180.0;
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
  const double step = std::hypot(along / larger * grid.sigma_x(), across / larger * grid.sigma_z());
  const double fall = step * sun.fall;
  if (sun.softness) {
    // Eq. 16 on the surface: all of the sun where it is its own shadow height, none from k/2 below.
    const double width = 0.5 * *sun.softness;
    edges_ = {{.fall = fall,
               .offset = -0.5 * width,
               .least = width,
               .most = width,
               .deepest = std::max(*sun.softness, 2.0 * fall),
               .highest = std::max(*sun.softness, 2.0 * fall)}};
    range_ = edges_.front().deepest / width;
    return;
  }
  const double widening = step * (sun.upper_fall - sun.lower_fall);
  const double steep = fall / (kStepsToFullWidth * widening);
  const SunEdge upper{.fall = step * sun.upper_fall,
                      .widening = widening,
                      .side = 0.5,
                      .steep = steep,
                      .most = fall,
                      .deepest = kDeepestSteps * fall,
                      .highest = kHighestSteps * fall};
  edges_ = {upper, upper};
  edges_[1].fall = step * sun.lower_fall;
  edges_[1].side = -0.5;
  range_ = kStepsToFullWidth * kDeepestSteps;
}

void ShadowSweep::begin_behind(std::int64_t tiles_west, std::int64_t tiles_east, std::int64_t rows_before) {
  columns_before_ = mirrored_ ? tiles_east : tiles_west;
  rows_before_ = rows_before;
}

std::optional<LightTravel> ShadowSweep::travel() const {
  if (!by_columns_ || shift_ > 0.0) return std::nullopt;
  return mirrored_ ? LightTravel::kWestward : LightTravel::kEastward;
}

ShadowSweep::State ShadowSweep::entering(std::int64_t tile_row, const CasterRows& casters,
                                         std::span<const float> tile) const {
  if (columns_before_ == 0) return {};  // padding there is beyond all tiles
  const TileShape& shape = grid_.shape();
  const auto lines = static_cast<std::size_t>(shape.rows()) + 1;
  const std::size_t carried = ShadowFront::carried_by(edges_.size());
  State state(carried * lines, kVoidHeight);
  const Casting columns = casting_columns();
  const Casting casting = casting_rows(tile_row);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    for (int row = 1; row <= visible_rows(shape); ++row) {
      const auto casts = [&](double distance, float height) {
        const bool is_covered = row >= casting.first - kAtEnd && row <= casting.last + kAtEnd &&
                                -distance >= columns.first - kAtEnd && -distance <= columns.last + kAtEnd;
        return is_covered ? height : kVoidHeight;
      };
      float highest = -std::numeric_limits<float>::infinity();
      std::int64_t ran = columns_before_ * half_steps_;
      std::int64_t place = 1;
      const auto meet = [&](float height, std::int64_t distance) {
        ran += place - distance;
        place = distance;
        const double dark = static_cast<double>(highest) - static_cast<double>(ran) * edges_[e].fall;
        if (!(static_cast<double>(height) > dark)) return;
        highest = height;
        ran = 0;
      };
      const auto listed = casters.row(row);
      for (auto caster = listed.rbegin(); caster != listed.rend(); ++caster) {
        meet(static_cast<float>(caster->height), caster->distance);
      }
      const float* const stored = tile.data() + row * shape.columns();
      const int last = last_visible_column(shape, row);
      const float before = casts(padding_distance(row), mirrored_ ? stored[last + 1] : stored[0]);
      meet(before, padding_distance(row));
      if (padding_distance(row) > 1) meet(middle(before, casts(0.0, mirrored_ ? stored[last] : stored[1])), 1);
      float* const line = state.data() + 3 * e * lines + static_cast<std::size_t>(row) + 1;
      line[0] = highest;
      line[lines] = static_cast<float>(ran);
      line[2 * lines] = 0.0F;  // along rows lines pass through the vertices
    }
  }
  return state;
}

std::uint64_t ShadowSweep::state_bytes() const {
  const auto lanes = static_cast<double>(half_steps_ * grid_.tile_columns());
  const auto carried = static_cast<double>(ShadowFront::carried_by(edges_.size()));
  return static_cast<std::uint64_t>(lanes * (by_columns_ ? shift_ * (carried + 1.0) : carried) * sizeof(float)) + 64;
}

double ShadowSweep::passing_bytes() const {
  const TileShape& shape = grid_.shape();
  if (by_columns_) return 2.0 * sizeof(float) * static_cast<double>(kTilesTogether * shape.stored_vertex_count());
  // The lines, the ground of two steps, the hidden part; rows of vertices.
  const auto tiles = static_cast<double>(grid_.tile_columns());
  const auto carried = static_cast<double>(ShadowFront::carried_by(edges_.size()));
  return tiles * sizeof(float) * ((3.0 + carried) * half_steps_ + 2.0 * shape.columns());
}

ShadowSweep::Casting ShadowSweep::casting_columns() const {
  const double first = ground_.x0 / grid_.sigma_x();
  const double last = ground_.x1 / grid_.sigma_x();
  const auto end = static_cast<double>(half_steps_ * grid_.tile_columns());
  return mirrored_ ? Casting{end - last, end - first} : Casting{first, last};
}

/// In stored rows of a tile of that row, turned over where light comes from the South.
ShadowSweep::Casting ShadowSweep::casting_rows(std::int64_t tile_row) const {
  const double north = static_cast<double>(tile_row) * grid_.shape().cell_rows() - 1.0;
  const double first = ground_.z0 / grid_.sigma_z() - north;
  const double last = ground_.z1 / grid_.sigma_z() - north;
  const double end = grid_.shape().rows() - 1.0;
  return from_south_ ? Casting{end - last, end - first} : Casting{first, last};
}

ShadowSweep::State ShadowSweep::pass(std::int64_t tile_row, const State& entering, const TileRowValues& heights,
                                     TileRowValues* hidden) {
  return by_columns_ ? pass_along_columns(tile_row, entering, heights, hidden)
                     : pass_along_rows(tile_row, entering, heights, hidden);
}

/// Steps are the lattice's rows, lanes are half steps over the whole width. The row that two rows of tiles share is a
/// step of both: the first one's last is taken back.
ShadowSweep::State ShadowSweep::pass_along_rows(std::int64_t tile_row, const State& entering,
                                                const TileRowValues& heights, TileRowValues* hidden) {
  const TileShape& shape = grid_.shape();
  const auto lanes = static_cast<int>(half_steps_ * grid_.tile_columns()) + 1;
  const std::int64_t row_of_light = rows_before_ + (from_south_ ? grid_.tile_rows() - 1 - tile_row : tile_row);
  ShadowFront front(lanes, ShadowFront::Lanes::kAreNone, shift_, edges_, range_);
  front.resume(row_of_light * shape.cell_rows(), entering);
  State leaving;
  const Casting columns = casting_columns();
  const Casting rows = casting_rows(tile_row);
  const std::size_t held = static_cast<std::size_t>(lanes) + 2;
  std::vector<float> profile(held + ShadowFront::kOverrun, kVoidHeight);
  std::vector<float> profile_before = profile;
  ShadowFront::Step before;
  std::vector<float> found(static_cast<std::size_t>(lanes) + 1 + ShadowFront::kOverrun);
  std::vector<float> values;
  std::vector<float> made(hidden != nullptr ? static_cast<std::size_t>(grid_.tile_columns() * shape.columns()) : 0);
  // Step 0 is the padding.
  for (int step = 0; step <= shape.cell_rows() + 1; ++step) {
    const int row = from_south_ ? shape.rows() - 1 - step : step;
    const std::span<const float> vertices = heights.row(row, 0, grid_.tile_columns(), values);
    for (std::int64_t tile = 0; tile < grid_.tile_columns(); ++tile) {
      spread(shape, vertices.data() + tile * shape.columns(), row % 2 != 0, profile.data() + 1 + tile * half_steps_);
    }
    if (mirrored_) std::reverse(profile.begin(), profile.begin() + static_cast<std::ptrdiff_t>(held));
    if (step == shape.cell_rows() + 1) leaving = front.lines();
    const Casting casting = step >= rows.first - kAtEnd && step <= rows.last + kAtEnd ? columns : Casting{1.0, 0.0};
    const ShadowFront::Step here{profile.data() + 1, casting.first, casting.last, row % 2 != 0 ? 0 : 1,
                                 row % 2 != 0 ? 0 : half_steps_};
    if (step > 0) front.advance(before, here, hidden != nullptr ? found.data() : nullptr);
    before = here;
    std::swap(profile, profile_before);
    if (hidden == nullptr || step == 0) continue;
    const auto more = found.begin() + ShadowFront::first_of_more(lanes);
    const bool is_odd = row % 2 != 0;
    if (mirrored_) {
      std::reverse(found.begin(), found.begin() + (is_odd ? lanes + 1 : lanes - 1) / 2);
      std::reverse(more, more + grid_.tile_columns() + 1);
    }
    for (std::int64_t tile = 0; tile < grid_.tile_columns(); ++tile) {
      float* const out = made.data() + tile * shape.columns();
      const float* const from = found.data() + tile * shape.cell_columns();
      if (is_odd) {
        std::copy_n(from, shape.cell_columns() + 1, out + 1);
        continue;
      }
      out[1] = more[tile];
      std::copy_n(from, shape.cell_columns(), out + 2);
      out[2 + shape.cell_columns()] = more[tile + 1];
    }
    hidden->write_row(row, 0, made);
  }
  return leaving;
}

/// Steps are columns half a lattice step apart, lanes are the stored rows of the tiles, padding included: one row of
/// tiles sees the ground a row beyond its edge, so that the same lines lie beside vertices that two of them share.
ShadowSweep::State ShadowSweep::pass_along_columns(std::int64_t tile_row, const State& entering,
                                                   const TileRowValues& heights, TileRowValues* hidden) {
  const TileShape& shape = grid_.shape();
  const int lanes = shape.rows();
  ShadowFront front(lanes, ShadowFront::Lanes::kAreSides, shift_, edges_, range_);
  front.resume(columns_before_ * half_steps_, travel() ? entering : State());
  State leaving;
  std::size_t entered = 0;
  const Casting columns = casting_columns();
  const Casting rows = casting_rows(tile_row);
  const std::size_t across = static_cast<std::size_t>(half_steps_) + 1;
  const std::size_t lane_stride = static_cast<std::size_t>(lanes) + 2;
  std::vector<float> spread_rows(across * static_cast<std::size_t>(lanes));
  std::vector<float> profiles(lane_stride * across + ShadowFront::kOverrun, kVoidHeight);
  const std::size_t found_stride = static_cast<std::size_t>(lanes) + 1;
  std::vector<float> found(found_stride * across + ShadowFront::kOverrun);
  std::int64_t steps = 0;
  for (std::int64_t k = 0; k < grid_.tile_columns(); k += kTilesTogether) {
    const std::int64_t tiles = std::min(kTilesTogether, grid_.tile_columns() - k);
    const std::int64_t first_tile = mirrored_ ? grid_.tile_columns() - k - tiles : k;
    RowParts<float> vertices = heights.part(first_tile, tiles);
    const std::int64_t stride = tiles * shape.columns();
    std::vector<float> made(hidden != nullptr ? static_cast<std::size_t>(stride * lanes) : 0);
    for (std::int64_t i = 0; i < tiles; ++i) {
      const std::int64_t tile = mirrored_ ? tiles - 1 - i : i;
      const std::ptrdiff_t column = tile * shape.columns();
      const std::int64_t end = last_casting_step(ground_.x1, grid_.sigma_x()) - (first_tile + tile) * half_steps_;
      for (int row = 0; row < lanes; ++row) {
        const int lane = from_south_ ? lanes - 1 - row : row;
        float* const out = spread_rows.data() + static_cast<std::size_t>(lane) * across;
        spread(shape, vertices.row(row).data() + column, row % 2 != 0, out);
        // Light along the rows meets vertices alone: the middle between the last covered one and the next casts
        // nothing.
        if (travel() && end > 0 && end < half_steps_ && (end % 2 != 0) == (row % 2 != 0)) out[end] = kVoidHeight;
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
      const bool is_first = k + i == 0;
      if (!is_first) {
        std::copy_n(found.data() + found_stride * (across - 1), found_stride, found.data());
      }
      for (std::size_t x = is_first ? 0 : 1; x < across; ++x, ++steps) {
        if (front.is_shifting()) {
          // With the line goes the ground beyond the padding, where it crosses a side on this step.
          float* const profile = profiles.data() + x * lane_stride + 1;
          front.append_arriving(lanes - 3, leaving);
          leaving.push_back(profile[lanes - 4]);
          const bool arrives = entered < entering.size();
          front.let_in(arrives ? entering.data() + entered : nullptr);
          entered += front.carried();
          profile[-1] = arrives ? entering[entered] : kVoidHeight;
          ++entered;
        }
        const auto step = [&](std::size_t at) {
          const double behind = static_cast<double>(steps) - static_cast<double>(x - at);
          const bool casts = behind >= columns.first - kAtEnd && behind <= columns.last + kAtEnd;
          const Casting casting = casts ? rows : Casting{1.0, 0.0};
          return ShadowFront::Step{profiles.data() + at * lane_stride + 1, casting.first, casting.last,
                                   at % 2 == 0 ? 1 : 0, at == 0 || at + 1 == across ? 1 : 0};
        };
        front.advance(x > 0 ? step(x - 1) : ShadowFront::Step{}, step(x),
                      hidden != nullptr ? found.data() + x * found_stride : nullptr);
      }
      if (hidden == nullptr) continue;
      for (int row = 1; row <= lanes - 2; ++row) {
        // Odd rows have vertices in even columns, where lanes from 1 on come first.
        const auto place = static_cast<std::size_t>(from_south_ ? lanes - 1 - row : row) / 2;
        const auto at = [&](int c, std::size_t to) {
          const int x = half_step(shape, c, row);
          return found[static_cast<std::size_t>(mirrored_ ? half_steps_ - x : x) * found_stride + to];
        };
        float* const out = made.data() + row * stride + column;
        const int last = last_visible_column(shape, row);
        for (int c = 1; c <= last; ++c) out[c] = at(c, place);
        if (row % 2 != 0) continue;
        const std::size_t slid = place + static_cast<std::size_t>(ShadowFront::first_of_more(lanes));
        out[1] = at(1, slid);
        out[last] = at(last, slid);
      }
    }
    for (int row = 1; hidden != nullptr && row <= lanes - 2; ++row) {
      hidden->write_row(
          row, first_tile,
          std::span(made).subspan(static_cast<std::size_t>(row * stride), static_cast<std::size_t>(stride)));
    }
  }
  return leaving;
}

}  // namespace isohf
