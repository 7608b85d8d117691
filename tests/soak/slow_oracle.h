#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

/// What an archive must hold, worked out one vertex at a time from the page of conventions and the paper's Eqs. 1 and 2,
/// in double. Slow, plain, and without a line of the library: who mends one does not mend the other.

namespace isohf::soak {

/// A raster of elevations, NaN where void.
struct Ground {
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::vector<double> elevations;
  double first_x = 0.0;  ///< world place of sample (0, 0)
  double first_z = 0.0;
  double spacing_x = 1.0;
  double spacing_z = 1.0;
  bool has_voids = false;

  [[nodiscard]] double at(std::int64_t column, std::int64_t row) const {
    return elevations[static_cast<std::size_t>(row * width + column)];
  }
  /// Beyond an end the raster goes on as if turned about its last sample: s[-k] = 2 s[0] - s[k].
  [[nodiscard]] double beyond(std::int64_t column, std::int64_t row) const {
    if (column < 0 && width > 1) return 2.0 * beyond(0, row) - beyond(-column, row);
    if (column >= width && width > 1) return 2.0 * beyond(width - 1, row) - beyond(2 * (width - 1) - column, row);
    if (row < 0 && height > 1) return 2.0 * beyond(column, 0) - beyond(column, -row);
    if (row >= height && height > 1) return 2.0 * beyond(column, height - 1) - beyond(column, 2 * (height - 1) - row);
    return at(width > 1 ? column : 0, height > 1 ? row : 0);
  }
};

/// Tiles of C x R stored elevations.
struct Tiles {
  int columns = 0;  ///< C
  int rows = 0;     ///< R
  double extent_x = 0.0;
  double extent_z = 0.0;
};

struct Place {
  double x;
  double z;
};

/// The world place of a vertex (Eqs. 1 and 2 with errata E5 and E6): even rows are shifted by half a step, their second
/// and last but one vertices slid onto the edges, the first and last are the neighbours' nearest.
inline Place place_of(const Tiles& tiles, std::int64_t tile_column, std::int64_t tile_row, int column, int row) {
  const int across = 2 * (tiles.columns - 4);
  int x = 2 * (column - 1);
  if (row % 2 == 0) {
    x = column == 0                   ? -1
        : column == 1                 ? 0
        : column == tiles.columns - 2 ? across
        : column == tiles.columns - 1 ? across + 1
                                      : 2 * column - 3;
  }
  const double sigma_x = tiles.extent_x / across;
  const double sigma_z = tiles.extent_z / (tiles.rows - 3);
  return {static_cast<double>(tile_column) * tiles.extent_x + sigma_x * x,
          static_cast<double>(tile_row) * tiles.extent_z + sigma_z * (row - 1)};
}

enum class Kernel { kNearest, kBilinear, kLimitedCubic };

/// The least and the greatest elevation that the filter may give at a place; two where rounding may fall either way.
/// Voids are NaN on both sides; `is_known` false: this oracle has no answer.
struct Answer {
  bool is_known = true;
  double least = 0.0;
  double most = 0.0;
};

inline double weight_of(Kernel kernel, double distance) {
  const double d = std::abs(distance);
  const double tent = std::max(0.0, 1.0 - d);
  // Catmull-Rom: Keys 1981, a = -1/2. The limited cubic adds to a straight line 4/3 of what that adds (decision 27).
  const double cubic = d < 1.0 ? (1.5 * d - 2.5) * d * d + 1.0 : d < 2.0 ? ((-0.5 * d + 2.5) * d - 4.0) * d + 2.0 : 0.0;
  if (kernel == Kernel::kBilinear) return tent;
  return tent + (cubic - tent) * 4.0 / 3.0;
}

/// At a column and row of the raster, fractional, within half a sample of it.
inline Answer elevation_at(const Ground& ground, Kernel kernel, double u, double v) {
  constexpr double kClose = 1e-9;  // places are computed in another order than the library's
  const bool inside =
      u >= 0.0 && v >= 0.0 && u <= static_cast<double>(ground.width - 1) && v <= static_cast<double>(ground.height - 1);
  const auto near_whole = [](double at) { return std::abs(at - std::round(at)) < kClose; };
  if (kernel == Kernel::kNearest) {
    Answer answer{true, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    int voids = 0;
    for (const double x : {u - kClose, u + kClose}) {
      for (const double z : {v - kClose, v + kClose}) {
        const auto column =
            std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(x + 0.5)), 0, ground.width - 1);
        const auto row = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(z + 0.5)), 0, ground.height - 1);
        const double found = ground.at(column, row);
        if (std::isnan(found)) ++voids;
        answer.least = std::fmin(answer.least, found);
        answer.most = std::fmax(answer.most, found);
      }
    }
    answer.is_known = voids == 0;  // beside a void the lattice decides
    return answer;
  }
  const int reach = kernel == Kernel::kBilinear ? 1 : 2;
  if (ground.has_voids && (!inside || reach > 1 || near_whole(u) || near_whole(v))) return {false, 0.0, 0.0};
  if (kernel == Kernel::kLimitedCubic && (!inside || near_whole(u) || near_whole(v))) return {false, 0.0, 0.0};
  const auto west = static_cast<std::int64_t>(std::floor(u));
  const auto north = static_cast<std::int64_t>(std::floor(v));
  double sum = 0.0, weights = 0.0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool all_void = true;
  for (std::int64_t row = north - reach + 1; row <= north + reach; ++row) {
    for (std::int64_t column = west - reach + 1; column <= west + reach; ++column) {
      const double weight =
          weight_of(kernel, u - static_cast<double>(column)) * weight_of(kernel, v - static_cast<double>(row));
      const double sample = ground.beyond(column, row);
      if (std::isnan(sample)) continue;
      all_void = false;
      sum += weight * sample;
      weights += weight;
      if (column >= west && column <= west + 1 && row >= north && row <= north + 1) {
        low = std::min(low, sample);
        high = std::max(high, sample);
      }
    }
  }
  if (std::abs(weights - 0.5) < 1e-5) return {false, 0.0, 0.0};
  if (all_void || weights < 0.5) return {false, 0.0, 0.0};
  double value = sum / weights;
  if (kernel == Kernel::kLimitedCubic) value = std::clamp(value, low, high);
  return {true, value, value};
}

}  // namespace isohf::soak
