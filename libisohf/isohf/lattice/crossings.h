#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "isohf/lattice.h"

/// What a straight line from + t * along, t >= 0, crosses on its way over the lattice, one crossing after the other. The
/// surface over the line is a chain of straight pieces that meet where the line crosses a side of a triangle.

namespace isohf {

/// Where a coordinate of the line passes the multiples of a step.
class Crossings {
 public:
  /// The coordinate is `at` + t * `rate`; passes from t = `begin` on.
  Crossings(double at, double rate, double step, double begin) : at_(at), rate_(rate), step_(step) {
    if (rate == 0.0) return;
    const double place = (at + begin * rate) / step;
    multiple_ = rate > 0.0 ? std::floor(place) + 1.0 : std::ceil(place) - 1.0;
  }
  [[nodiscard]] double next() const {
    return rate_ == 0.0 ? std::numeric_limits<double>::infinity() : (multiple_ * step_ - at_) / rate_;
  }
  void pass() { multiple_ += rate_ > 0.0 ? 1.0 : -1.0; }

 private:
  double at_;
  double rate_;
  double step_;
  double multiple_ = 0.0;
};

/// t of the first crossing of several families of lines, which is passed; infinity where there is none.
template <std::size_t N>
double pass_first(std::array<Crossings, N>& families) {
  auto first = std::min_element(families.begin(), families.end(),
                                [](const Crossings& a, const Crossings& b) { return a.next() < b.next(); });
  const double t = first->next();
  first->pass();
  return t;
}

/// Crossings of the borders of tiles.
[[nodiscard]] inline std::array<Crossings, 2> tile_crossings(const TileGrid& grid, WorldPoint from, WorldPoint along,
                                                             double begin) {
  return {Crossings(from.x, along.x, grid.extent_x(), begin), Crossings(from.z, along.z, grid.extent_z(), begin)};
}

/// The line in a tile's object space.
struct ObjectLine {
  ObjectPoint from;
  ObjectPoint along;
  [[nodiscard]] ObjectPoint at(double t) const { return {from.x + t * along.x, from.z + t * along.z}; }
};
[[nodiscard]] inline ObjectLine object_line(const TileGrid& grid, TileIndex tile, WorldPoint from, WorldPoint along) {
  return {{(from.x - static_cast<double>(tile.column) * grid.extent_x()) / grid.sigma_x(),
           (from.z - static_cast<double>(tile.row) * grid.extent_z()) / grid.sigma_z()},
          {along.x / grid.sigma_x(), along.z / grid.sigma_z()}};
}

/// Crossings of the sides of triangles: in object space these lie on z = k, x + z = 2k and x - z = 2k, whole k, the half
/// triangles' among them.
[[nodiscard]] inline std::array<Crossings, 3> side_crossings(const ObjectLine& line, double begin) {
  const auto& [from, along] = line;
  return {Crossings(from.z, along.z, 1.0, begin), Crossings(from.x + from.z, along.x + along.z, 2.0, begin),
          Crossings(from.x - from.z, along.x - along.z, 2.0, begin)};
}

/// Shortens begin <= t <= end to where one coordinate, from + t * along, lies in low to high.
inline void cut_line(double from, double along, double low, double high, double& begin, double& end) {
  if (along == 0.0) {
    if (from < low || from > high) end = -std::numeric_limits<double>::infinity();
    return;
  }
  const double first = (low - from) / along;
  const double second = (high - from) / along;
  begin = std::max(begin, std::min(first, second));
  end = std::min(end, std::max(first, second));
}

}  // namespace isohf
