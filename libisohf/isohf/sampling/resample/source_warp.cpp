#include "isohf/sampling/resample/source_warp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "isohf/base/assert.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// Lattice units: half column steps and rows.
constexpr std::int64_t kBlockX = 128;
constexpr std::int64_t kBlockZ = 64;
constexpr std::int64_t kLeastBlock = 8;

constexpr double kNodeGrain = 4096.0;
constexpr double kCheckedError = SourceWarp::kTolerance / 5.0;

/// cos((2k + 1) pi / 8): the zeros of T4.
constexpr std::array<double, 4> kChebyshevNodes = {0.92387953251128674, 0.38268343236508977, -0.38268343236508977,
                                                   -0.92387953251128674};
/// Where T4 is 1 or -1: all of a T4(s) + b T4(t) that is largest, whatever the signs of a and b.
constexpr double kRoot = 0.70710678118654752;
constexpr std::array<std::pair<double, double>, 13> kChecks = {{{-1.0, -1.0},
                                                                {0.0, -1.0},
                                                                {1.0, -1.0},
                                                                {-1.0, 0.0},
                                                                {0.0, 0.0},
                                                                {1.0, 0.0},
                                                                {-1.0, 1.0},
                                                                {0.0, 1.0},
                                                                {1.0, 1.0},
                                                                {kRoot, 0.0},
                                                                {-kRoot, 1.0},
                                                                {0.0, kRoot},
                                                                {1.0, -kRoot}}};

using Cubic = std::array<double, 4>;  ///< of 1, t, t^2, t^3

/// The cubic through values at kChebyshevNodes.
Cubic through(const Cubic& values) {
  Cubic chebyshev{};
  for (std::size_t k = 0; k < 4; ++k) {
    const double t = kChebyshevNodes[k];
    const double t2 = 2.0 * t * t - 1.0;
    const double t3 = t * (2.0 * t2 - 1.0);
    chebyshev[0] += 0.25 * values[k];
    chebyshev[1] += 0.5 * values[k] * t;
    chebyshev[2] += 0.5 * values[k] * t2;
    chebyshev[3] += 0.5 * values[k] * t3;
  }
  return {chebyshev[0] - chebyshev[2], chebyshev[1] - 3.0 * chebyshev[3], 2.0 * chebyshev[2], 4.0 * chebyshev[3]};
}

double value_of(const Cubic& cubic, double t) {
  return ((cubic[3] * t + cubic[2]) * t + cubic[1]) * t + cubic[0];
}

/// Coefficients of a bicubic polynomial: [power of s][power of t].
class Bicubic {
 public:
  /// values [row][column] at kChebyshevNodes x kChebyshevNodes.
  explicit Bicubic(const std::array<Cubic, 4>& values) {
    std::array<Cubic, 4> along_s{};
    for (std::size_t row = 0; row < 4; ++row) along_s[row] = through(values[row]);
    for (std::size_t i = 0; i < 4; ++i) {
      coefficients_[i] = through({along_s[0][i], along_s[1][i], along_s[2][i], along_s[3][i]});
    }
  }
  /// The cubic in s at a t.
  [[nodiscard]] Cubic at(double t) const {
    return {value_of(coefficients_[0], t), value_of(coefficients_[1], t), value_of(coefficients_[2], t),
            value_of(coefficients_[3], t)};
  }

 private:
  std::array<Cubic, 4> coefficients_;
};

ISOHF_KERNEL void evaluate(const double* __restrict s, std::int64_t count, const double* __restrict cubic,
                           double* __restrict out) {
  const double c0 = cubic[0];
  const double c1 = cubic[1];
  const double c2 = cubic[2];
  const double c3 = cubic[3];
  for (std::int64_t i = 0; i < count; ++i) out[i] = ((c3 * s[i] + c2) * s[i] + c1) * s[i] + c0;
}

std::int64_t block_start(std::int64_t at, std::int64_t size) {
  const std::int64_t inside = ((at % size) + size) % size;
  return at - inside;
}

}  // namespace

ExactWarp::ExactWarp(const WarpPlace& place)
    : place_(place),
      projection_(place.projection),
      middle_longitude_(place.first_sample.easting + place.step_x * static_cast<double>(place.width - 1) / 2.0),
      middle_u_(static_cast<double>(place.width - 1) / 2.0) {
  if (!place.source_map) {
    turn_ = 360.0;
    return;
  }
  // Samples on the other side of the map's cut come back from degrees a turn away.
  const double middle_row = place.first_sample.northing - place.step_z * static_cast<double>(place.height - 1) / 2.0;
  const std::optional<double> turn = turn_of(*place.source_map, {middle_longitude_, middle_row});
  if (!turn) return;
  for (const double side : {-1.0, 1.0}) {
    const MapPoint end{middle_longitude_ + side * middle_u_ * place.step_x, middle_row};
    const MapPoint back = place.source_map->map_from_geo(place.source_map->geo_from_map(end));
    if (std::abs(back.easting - end.easting) > 0.5 * *turn) turn_ = *turn;
  }
}

SourcePosition ExactWarp::source_from_geo(GeoPoint geo) const {
  if (place_.source_map) {
    MapPoint at = place_.source_map->map_from_geo(geo);
    if (turn_ > 0.0) at.easting -= turn_ * std::nearbyint((at.easting - middle_longitude_) / turn_);
    return {(at.easting - place_.first_sample.easting) / place_.step_x,
            (place_.first_sample.northing - at.northing) / place_.step_z};
  }
  const double turn = std::remainder(geo.longitude - middle_longitude_, turn_);
  return {middle_u_ + turn / place_.step_x, (place_.first_sample.northing - geo.latitude) / place_.step_z};
}

GeoPoint ExactWarp::geo_from_world(WorldPoint world) const {
  return projection_.inverse({place_.origin.easting + world.x, place_.origin.northing - world.z});
}

SourcePosition ExactWarp::source_from_world(WorldPoint world) const {
  return source_from_geo(geo_from_world(world));
}

WorldPoint ExactWarp::world_from_source(SourcePosition source) const {
  const MapPoint there{place_.first_sample.easting + source.u * place_.step_x,
                       place_.first_sample.northing - source.v * place_.step_z};
  const MapPoint at = projection_.forward(place_.source_map ? place_.source_map->geo_from_map(there)
                                                            : GeoPoint{there.easting, there.northing});
  return {at.easting - place_.origin.easting, place_.origin.northing - at.northing};
}

/// A rectangle of the lattice, its West and North sides included.
struct SourceWarp::Block {
  std::int64_t x;
  std::int64_t z;
  std::int64_t width;
  std::int64_t height;

  /// Powers of two: s and t of a lattice place are exact.
  [[nodiscard]] double x_at(double s) const {
    return static_cast<double>(x) + 0.5 * (s + 1.0) * static_cast<double>(width);
  }
  [[nodiscard]] double z_at(double t) const {
    return static_cast<double>(z) + 0.5 * (t + 1.0) * static_cast<double>(height);
  }
  [[nodiscard]] double s_of(std::int64_t lattice_x) const {
    return 2.0 * static_cast<double>(lattice_x - x) / static_cast<double>(width) - 1.0;
  }
  [[nodiscard]] double t_of(std::int64_t lattice_z) const {
    return 2.0 * static_cast<double>(lattice_z - z) / static_cast<double>(height) - 1.0;
  }
};

/// A tile's vertices and where their positions go.
struct SourceWarp::Target {
  std::array<std::vector<std::int64_t>, 2> columns_x;  ///< lattice x by column, of even and odd rows
  std::int64_t first_z;                                ///< of row 0
  std::int64_t rows;
  std::span<double> u;
  std::span<double> v;

  struct Columns {
    std::size_t first;
    std::size_t end;
  };
  [[nodiscard]] Columns columns_in(const Block& block, std::size_t parity) const {
    const std::vector<std::int64_t>& xs = columns_x[parity];
    const auto first = std::lower_bound(xs.begin(), xs.end(), block.x) - xs.begin();
    const auto end = std::lower_bound(xs.begin() + first, xs.end(), block.x + block.width) - xs.begin();
    return {static_cast<std::size_t>(first), static_cast<std::size_t>(end)};
  }
  [[nodiscard]] std::int64_t first_row_in(const Block& block) const {
    return std::max<std::int64_t>(block.z - first_z, 0);
  }
  [[nodiscard]] std::int64_t end_row_in(const Block& block) const {
    return std::min(block.z + block.height - first_z, rows);
  }
  [[nodiscard]] bool meets(const Block& block) const {
    if (first_row_in(block) >= end_row_in(block)) return false;
    const auto meets_columns = [&](std::size_t parity) {
      const Columns columns = columns_in(block, parity);
      return columns.first < columns.end;
    };
    return meets_columns(0) || meets_columns(1);
  }
};

SourceWarp::SourceWarp(const TileGrid& grid, const WarpPlace& place, double reach)
    : grid_(grid), exact_(place), reach_(reach) {}

SourcePosition SourceWarp::at(double x, double z) const {
  return exact_.source_from_world({x * grid_.sigma_x(), z * grid_.sigma_z()});
}

SourcePosition SourceWarp::at(double x, double z, double near_u) const {
  SourcePosition position = at(x, z);
  position.u = near_u + std::remainder(position.u - near_u, exact_.place().columns_round());
  return position;
}

/// True where all of these places of a block, and by that all between them, lie far beyond one side of the source.
bool SourceWarp::is_beyond_reach(std::span<const SourcePosition> positions) const {
  if (std::isinf(reach_)) return false;
  double least_u = HUGE_VAL;
  double most_u = -HUGE_VAL;
  double least_v = HUGE_VAL;
  double most_v = -HUGE_VAL;
  for (const SourcePosition& position : positions) {
    if (std::isnan(position.u) || std::isnan(position.v)) return false;
    least_u = std::min(least_u, position.u);
    most_u = std::max(most_u, position.u);
    least_v = std::min(least_v, position.v);
    most_v = std::max(most_v, position.v);
  }
  const WarpPlace& place = exact_.place();
  const auto is_beyond = [&](double least, double most, std::int64_t samples) {
    const double margin = reach_ + 1.0 + (most - least);
    return most < -margin || least > static_cast<double>(samples - 1) + margin;
  };
  if (is_beyond(least_v, most_v, place.height)) return true;
  // On the far side of the body West is East as well: only where the whole block keeps off it.
  const double round = place.columns_round();
  const double middle = static_cast<double>(place.width - 1) / 2.0;
  const bool keeps_off =
      least_u > middle - 0.5 * round + (most_u - least_u) && most_u < middle + 0.5 * round - (most_u - least_u);
  return keeps_off && is_beyond(least_u, most_u, place.width);
}

void SourceWarp::fill(const Block& block, const Target& target) const {
  if (!target.meets(block)) return;
  const std::size_t columns = target.columns_x[0].size();
  const auto at_row = [&](std::span<double> all, std::int64_t row) {
    return all.data() + static_cast<std::size_t>(row) * columns;
  };

  // Positions at the nodes, then at the checks.
  std::array<SourcePosition, 16 + kChecks.size()> probes;
  const double near_u = at(block.x_at(0.0), block.z_at(0.0)).u;
  bool is_somewhere = !std::isnan(near_u);
  for (std::size_t i = 0; is_somewhere && i < probes.size(); ++i) {
    const auto [s, t] = i < 16 ? std::pair{kChebyshevNodes[i % 4], kChebyshevNodes[i / 4]} : kChecks[i - 16];
    probes[i] = at(block.x_at(s), block.z_at(t), near_u);
    is_somewhere = !std::isnan(probes[i].u) && !std::isnan(probes[i].v);
  }
  if (is_somewhere) {
    if (is_beyond_reach(probes)) {
      for (std::int64_t row = target.first_row_in(block); row < target.end_row_in(block); ++row) {
        const auto [first, end] = target.columns_in(block, static_cast<std::size_t>(row & 1));
        std::fill(at_row(target.u, row) + first, at_row(target.u, row) + end, kNowhere);
        std::fill(at_row(target.v, row) + first, at_row(target.v, row) + end, kNowhere);
      }
      return;
    }
    std::array<Cubic, 4> node_u{};
    std::array<Cubic, 4> node_v{};
    for (std::size_t i = 0; i < 16; ++i) {
      node_u[i / 4][i % 4] = std::round(probes[i].u * kNodeGrain) / kNodeGrain;
      node_v[i / 4][i % 4] = std::round(probes[i].v * kNodeGrain) / kNodeGrain;
    }
    const Bicubic u(node_u);
    const Bicubic v(node_v);
    const bool is_close = [&] {
      for (std::size_t i = 0; i < kChecks.size(); ++i) {
        const auto [s, t] = kChecks[i];
        if (!(std::abs(value_of(u.at(t), s) - probes[16 + i].u) <= kCheckedError)) return false;
        if (!(std::abs(value_of(v.at(t), s) - probes[16 + i].v) <= kCheckedError)) return false;
      }
      return true;
    }();
    if (is_close) {
      std::vector<double> s;
      for (std::int64_t row = target.first_row_in(block); row < target.end_row_in(block); ++row) {
        const auto parity = static_cast<std::size_t>(row & 1);
        const auto [first, end] = target.columns_in(block, parity);
        s.resize(end - first);
        for (std::size_t c = first; c < end; ++c) s[c - first] = block.s_of(target.columns_x[parity][c]);
        const double t = block.t_of(target.first_z + row);
        const auto count = static_cast<std::int64_t>(s.size());
        vectorised<evaluate>(s.data(), count, u.at(t).data(), at_row(target.u, row) + first);
        vectorised<evaluate>(s.data(), count, v.at(t).data(), at_row(target.v, row) + first);
      }
      return;
    }
  }
  if (block.width > kLeastBlock && block.height > kLeastBlock) {
    const std::int64_t width = block.width / 2;
    const std::int64_t height = block.height / 2;
    for (const std::int64_t z : {block.z, block.z + height}) {
      for (const std::int64_t x : {block.x, block.x + width}) fill({x, z, width, height}, target);
    }
    return;
  }
  for (std::int64_t row = target.first_row_in(block); row < target.end_row_in(block); ++row) {
    const auto parity = static_cast<std::size_t>(row & 1);
    const auto [first, end] = target.columns_in(block, parity);
    for (std::size_t c = first; c < end; ++c) {
      const SourcePosition position =
          at(static_cast<double>(target.columns_x[parity][c]), static_cast<double>(target.first_z + row));
      at_row(target.u, row)[c] = std::round(position.u * kNodeGrain) / kNodeGrain;
      at_row(target.v, row)[c] = std::round(position.v * kNodeGrain) / kNodeGrain;
    }
  }
}

void SourceWarp::positions(TileIndex tile, std::span<double> u, std::span<double> v) const {
  const TileShape& shape = grid_.shape();
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  ISOHF_ASSERT(u.size() == samples && v.size() == samples);
  Target target{{}, grid_.lattice_vertex(tile, {0, 0}).z, shape.rows(), u, v};
  for (int parity = 0; parity < 2; ++parity) {
    for (int c = 0; c < shape.columns(); ++c) {
      target.columns_x[static_cast<std::size_t>(parity)].push_back(grid_.lattice_vertex(tile, {c, parity}).x);
    }
  }
  // Column C-1 of odd rows lies beyond that of even ones; both begin within two units of each other.
  const std::int64_t first_x = std::min(target.columns_x[0].front(), target.columns_x[1].front());
  const std::int64_t last_x = std::max(target.columns_x[0].back(), target.columns_x[1].back());
  const std::int64_t last_z = target.first_z + target.rows - 1;
  for (std::int64_t z = block_start(target.first_z, kBlockZ); z <= last_z; z += kBlockZ) {
    for (std::int64_t x = block_start(first_x, kBlockX); x <= last_x; x += kBlockX) {
      fill({x, z, kBlockX, kBlockZ}, target);
    }
  }
}

SourceWarp::RowBounds SourceWarp::row_bounds(std::int64_t tile_row) const {
  // A latitude, and the northing of another map, have their extremes over a rectangle of the map on its sides, but for
  // a pole inside.
  const TileShape& shape = grid_.shape();
  constexpr std::int64_t kBeyond = 4;  // padding, in lattice units
  const std::int64_t first_z = tile_row * shape.cell_rows() - kBeyond;
  const std::int64_t last_z = first_z + shape.cell_rows() + 2 * kBeyond;
  const std::int64_t first_x = -kBeyond;
  const std::int64_t last_x = grid_.tile_columns() * 2 * shape.cell_columns() + kBeyond;
  RowBounds bounds{HUGE_VAL, -HUGE_VAL};
  double bend = 0.0;
  bool is_whole = true;
  const auto walk = [&](std::int64_t count, const auto& place) {
    double before = 0.0;
    double last = 0.0;
    for (std::int64_t i = 0; i <= count; ++i) {
      const auto [x, z] = place(static_cast<double>(i) / static_cast<double>(count));
      const double v = at(x, z).v;
      is_whole = is_whole && !std::isnan(v);
      bounds.least = std::min(bounds.least, v);
      bounds.most = std::max(bounds.most, v);
      if (i >= 2) bend = std::max(bend, std::abs(v - 2.0 * last + before));
      before = last;
      last = v;
    }
  };
  constexpr std::int64_t kStep = 32;
  constexpr std::int64_t kMostSteps = 256;
  const auto between = [](std::int64_t a, std::int64_t b, double share) {
    return static_cast<double>(a) + share * static_cast<double>(b - a);
  };
  for (const std::int64_t z : {first_z, last_z}) {
    walk(std::min((last_x - first_x) / kStep + 4, kMostSteps), [&](double share) {
      return std::pair{between(first_x, last_x, share), static_cast<double>(z)};
    });
  }
  for (const std::int64_t x : {first_x, last_x}) {
    walk((last_z - first_z) / kStep + 4, [&](double share) {
      return std::pair{static_cast<double>(x), between(first_z, last_z, share)};
    });
  }
  const WarpPlace& place = exact_.place();
  for (const double latitude : {90.0, -90.0}) {
    const MapPoint pole = exact_.map_from_geo({place.projection.longitude_0, latitude});
    const double x = pole.easting - place.origin.easting;
    const double z = place.origin.northing - pole.northing;
    const bool inside =
        x >= static_cast<double>(first_x) * grid_.sigma_x() && x <= static_cast<double>(last_x) * grid_.sigma_x() &&
        z >= static_cast<double>(first_z) * grid_.sigma_z() && z <= static_cast<double>(last_z) * grid_.sigma_z();
    if (!inside) continue;
    const double v = exact_.source_from_geo({place.projection.longitude_0, latitude}).v;
    is_whole = is_whole && !std::isnan(v);
    bounds.least = std::min(bounds.least, v);
    bounds.most = std::max(bounds.most, v);
  }
  if (!is_whole) return {-HUGE_VAL, HUGE_VAL};
  // Between two places of the walk an extreme rises by an eighth of the second difference; twice that is allowed for.
  const double margin = bend / 4.0 + 2.0 * kTolerance;
  return {bounds.least - margin, bounds.most + margin};
}

std::vector<SourceWarp::RowBounds> SourceWarp::reading_bounds() const {
  std::vector<RowBounds> bounds;
  for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) bounds.push_back(row_bounds(row));
  for (std::size_t row = 1; row < bounds.size(); ++row) {
    bounds[row].most = std::max(bounds[row].most, bounds[row - 1].most);
    const std::size_t back = bounds.size() - 1 - row;
    bounds[back].least = std::min(bounds[back].least, bounds[back + 1].least);
  }
  return bounds;
}

}  // namespace isohf
