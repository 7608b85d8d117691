#include "isohf/restore/rows/spline_rows.h"

#include <algorithm>
#include <cmath>

#include "isohf/sampling/resample/kernels.h"

namespace isohf {
namespace {

/// Poles of the quintic B-spline's inverse: z + 1/z = -13 +- sqrt(105) (from z^2 + 26 z + 66 + 26/z + 1/z^2).
struct Poles {
  std::array<double, 2> z;
  Poles() : z{} {
    const double root = std::sqrt(105.0);
    const std::array<double, 2> sums = {-13.0 + root, -13.0 - root};
    for (std::size_t i = 0; i < 2; ++i) z[i] = (sums[i] + std::sqrt(sums[i] * sums[i] - 4.0)) / 2.0;
  }
};

const Poles& poles() {
  static const Poles found;
  return found;
}

/// Impulse response of the prefilter at 0, 1, ...: residues of 120 z^2 / ((z-z1)(z-1/z1)(z-z2)(z-1/z2)) z^(k-1).
std::array<double, QuinticResponse::kHalo + 1> make_inverse() {
  const auto& z = poles().z;
  std::array<double, QuinticResponse::kHalo + 1> taps{};
  for (std::size_t i = 0; i < 2; ++i) {
    const double a = z[i];
    const double b = z[1 - i];
    double term = 120.0 * a / ((a - 1.0 / a) * (a - b) * (a - 1.0 / b));
    for (double& tap : taps) {
      tap += term;
      term *= a;
    }
  }
  return taps;
}

double beta5(double x) {
  const double a = std::abs(x);
  if (a < 1.0) return 0.55 + a * a * (-0.5 + a * a * (0.25 - a / 12.0));
  if (a < 2.0) return 0.425 + a * (0.625 + a * (-1.75 + a * (1.25 + a * (-0.375 + a / 24.0))));
  const double rest = std::max(3.0 - a, 0.0);
  return rest * rest * rest * rest * rest / 120.0;
}

/// Vertices that a row which goes round, or whose slope goes on, is continued by: as far as the prefilter reaches
/// (QuinticResponse::kHalo), and the spline itself.
constexpr std::int64_t kRound = QuinticResponse::kHalo + 4;

/// Columns whose weights are read together.
constexpr std::size_t kBlock = 2048;

/// Whether the vertices of a tile's row lie half a column step further West.
bool is_shifted(int vertex_row) {
  return vertex_row % 2 == 0;
}

/// Fills voids between two valid samples along the straight line, beyond the outermost with its value. False where
/// there is no valid one.
bool fill_voids(std::span<double> line) {
  const auto count = static_cast<std::int64_t>(line.size());
  std::int64_t before = -1;
  for (std::int64_t i = 0; i <= count; ++i) {
    if (i < count && std::isnan(line[static_cast<std::size_t>(i)])) continue;
    if (i == count && before < 0) return false;
    for (std::int64_t k = before + 1; k < i; ++k) {
      double& hole = line[static_cast<std::size_t>(k)];
      if (before < 0) {
        hole = line[static_cast<std::size_t>(i)];
      } else if (i == count) {
        hole = line[static_cast<std::size_t>(before)];
      } else {
        const double share = static_cast<double>(k - before) / static_cast<double>(i - before);
        hole = line[static_cast<std::size_t>(before)] * (1.0 - share) + line[static_cast<std::size_t>(i)] * share;
      }
    }
    before = i;
  }
  return true;
}

}  // namespace

QuinticWeights quintic_weights(double u) {
  QuinticWeights at{static_cast<std::int64_t>(std::floor(u)) - 2, {}};
  for (std::size_t i = 0; i < at.weights.size(); ++i) {
    at.weights[i] = beta5(u - static_cast<double>(at.first + static_cast<std::int64_t>(i)));
  }
  return at;
}

QuinticResponse quintic_response(double u) {
  static const auto inverse = make_inverse();
  const QuinticWeights spline = quintic_weights(u);
  QuinticResponse response{spline.first - QuinticResponse::kHalo, {}};
  for (int t = 0; t < 6; ++t) {
    for (int k = -QuinticResponse::kHalo; k <= QuinticResponse::kHalo; ++k) {
      response.weights[static_cast<std::size_t>(t + k + QuinticResponse::kHalo)] +=
          spline.weights[static_cast<std::size_t>(t)] * inverse[static_cast<std::size_t>(std::abs(k))];
    }
  }
  return response;
}

void quintic_prefilter(std::span<double> line) {
  constexpr std::int64_t kStart = 40;  // 0.4306^40 < 1e-14
  const auto count = static_cast<std::int64_t>(line.size());
  if (count < 2) return;
  for (const double z : poles().z) {
    double start = 0.0;
    double power = 1.0;
    for (std::int64_t k = 0; k < kStart; ++k) {
      start += power * line[static_cast<std::size_t>(mirror_index(k, count))];
      power *= z;
    }
    line[0] = start;
    for (std::size_t i = 1; i < line.size(); ++i) line[i] += z * line[i - 1];
    const std::size_t last = line.size() - 1;
    line[last] = z / (z * z - 1.0) * (line[last] + z * line[last - 1]);
    for (std::size_t i = last; i-- > 0;) line[i] = z * (line[i + 1] - line[i]);
  }
  for (double& value : line) value *= 120.0;
}

StandIn stand_in(std::int64_t k, std::int64_t count) {
  if (k >= 0 && k < count) return {k};
  // Two ends further on the line is itself again, raised by twice what it rises.
  const std::int64_t end = count - 1;
  const std::int64_t in_turn = (k % (2 * end) + 2 * end) % (2 * end);
  const auto turns = static_cast<double>((k - in_turn) / (2 * end));
  if (in_turn <= end) return {in_turn, 1.0, -2.0 * turns, 2.0 * turns};
  return {2 * end - in_turn, -1.0, -2.0 * turns, 2.0 + 2.0 * turns};
}

SplineRows::SplineRows(const TileGrid& grid, const std::vector<double>& columns_x, bool wraps_x,
                       const ScratchFolder& scratch)
    : grid_(grid), wraps_x_(wraps_x), taps_(columns_x.size(), scratch) {
  // Even k are odd z, with vertices at object-space x = -1, 1, ...; odd k have them at -2, 0, ...
  for (const std::int64_t parity : {0, 1}) {
    taps_.add(parity);
    std::vector<QuinticWeights> block;
    for (std::size_t c = 0; c < columns_x.size(); ++c) {
      const double half_steps = columns_x[c] / grid.sigma_x();
      block.push_back(quintic_weights((half_steps + static_cast<double>(parity + 1)) / 2.0));
      block.back().first += wraps_x ? kRound - 1 : kRound;
      if (block.size() < kBlock && c + 1 < columns_x.size()) continue;
      taps_.write(parity, c + 1 - block.size(), block);
      block.clear();
    }
  }
}

std::int64_t SplineRows::tile_row_of(std::int64_t row) const {
  return std::clamp<std::int64_t>((row - 1) / grid_.shape().cell_rows(), 0, grid_.tile_rows() - 1);
}

/// The vertices of a lattice row, padding included, and kRound more on either side that continue its slope; of a row that
/// goes round kRound more instead of the padding.
std::vector<double> SplineRows::line_of(std::int64_t row, std::span<const double> vertices) const {
  const std::int64_t columns = grid_.shape().columns();
  const std::int64_t cells = grid_.shape().cell_columns();
  const bool shifted = is_shifted(vertex_row_of(row));
  std::vector<double> line(static_cast<std::size_t>(cells * grid_.tile_columns() + (shifted ? 2 : 3)));
  for (std::int64_t t = 0; t < grid_.tile_columns(); ++t) {
    const double* from = vertices.data() + t * columns;
    double* to = line.data() + t * cells;
    if (shifted) {
      to[0] = from[0];
      std::copy(from + 2, from + columns - 2, to + 1);
      to[cells + 1] = from[columns - 1];
    } else {
      std::copy(from, from + columns - 1, to);
    }
  }
  std::vector<double> round;
  if (!wraps_x_) {
    const auto count = static_cast<std::int64_t>(line.size());
    for (std::int64_t k = -kRound; k < count + kRound; ++k) {
      const StandIn from = stand_in(k, count);
      double height = from.sign * line[static_cast<std::size_t>(from.at)];
      // An end that is void says nothing of the other.
      if (from.first != 0.0) height += from.first * line.front();
      if (from.last != 0.0) height += from.last * line.back();
      round.push_back(height);
    }
    return round;
  }
  const std::int64_t period = cells * grid_.tile_columns();
  for (std::int64_t k = -kRound; k < period + kRound; ++k) {
    round.push_back(line[static_cast<std::size_t>(1 + (k % period + period) % period)]);
  }
  return round;
}

bool SplineRows::straighten(std::int64_t row, std::span<const double> vertices, std::span<double> heights,
                            std::span<char> near_void) const {
  const bool shifted = is_shifted(vertex_row_of(row));
  std::vector<double> line = line_of(row, vertices);
  std::vector<char> voids;
  if (std::any_of(line.begin(), line.end(), [](double h) { return std::isnan(h); })) {
    for (const double height : line) voids.push_back(std::isnan(height) ? 1 : 0);
    if (!fill_voids(line)) {
      std::fill(heights.begin(), heights.end(), 0.0);
      std::fill(near_void.begin(), near_void.end(), char{1});
      return true;
    }
  }
  quintic_prefilter(line);
  const auto count = static_cast<std::int64_t>(line.size());
  bool any = false;
  std::vector<QuinticWeights> buffer;
  for (std::size_t from = 0; from < heights.size(); from += kBlock) {
    const auto taps = taps_.read(shifted ? 0 : 1, from, std::min(kBlock, heights.size() - from), buffer);
    for (std::size_t c = 0; c < taps.size(); ++c) {
      const QuinticWeights& at = taps[c];
      const bool inside = at.first >= 0 && at.first + 6 <= count;
      double sum = 0.0;
      char near = 0;
      for (std::int64_t i = 0; i < 6; ++i) {
        const auto place = static_cast<std::size_t>(inside ? at.first + i : mirror_index(at.first + i, count));
        sum += at.weights[static_cast<std::size_t>(i)] * line[place];
        if (!voids.empty()) near = static_cast<char>(near | voids[place]);
      }
      heights[from + c] = sum;
      near_void[from + c] = near;
      any = any || near != 0;
    }
  }
  return any;
}

}  // namespace isohf
