#include "isohf/sampling/resample/void_rule.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace isohf {

float VoidRule::at(double u, double v, const TapWeights& columns, const TapWeights& rows) const {
  if (all_nearest_void(u, v)) return beside_samples(u, v);
  Taps taps;
  double valid_weight = 0.0;
  bool whole = true;
  bool any_void = false;
  const auto weight = [&](std::size_t j, std::size_t i) { return double{columns.weights[i]} * rows.weights[j]; };
  const auto count = static_cast<std::size_t>(kernel_.taps());
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t column = columns.first + static_cast<std::int64_t>(i);
      const std::int64_t row = rows.first + static_cast<std::int64_t>(j);
      taps[j][i] = coefficient(column, row);
      whole = whole && !std::isnan(taps[j][i]);
      const bool here = is_void(column, row);
      any_void = any_void || here;
      if (!here) valid_weight += weight(j, i);
    }
  }
  if (valid_weight < 0.5) return beside_samples(u, v);
  if (!whole) complete(taps);
  double sum = 0.0;
  double missing_weight = 0.0;
  double weight_sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = 0; i < count; ++i) {
      if (std::isnan(taps[j][i])) {
        missing_weight += std::abs(weight(j, i));
        continue;
      }
      sum += weight(j, i) * taps[j][i];
      weight_sum += weight(j, i);
    }
  }
  const auto height = static_cast<float>(missing_weight == 0.0 ? sum : sum / weight_sum);
  if (any_void && kernel_.edges() == Edges::kHeld) return held_near_samples(height, taps, columns, rows);
  if (!kernel_.is_limited()) return height;
  float least = std::numeric_limits<float>::infinity();
  float most = -least;
  for (const std::int64_t row : {rows.first + 1, rows.first + 2}) {
    for (const std::int64_t column : {columns.first + 1, columns.first + 2}) {
      if (is_void(column, row)) continue;
      const float corner = at_index(column, row);
      least = std::min(least, corner);
      most = std::max(most, corner);
    }
  }
  return held_within(height, least, most);
}

/// Rule 7. The plane is the one of least squares, by the inverse fourth power of the distance. Its slope is shrunk where
/// samples lie almost on one line, and its height is held near theirs.
float VoidRule::beside_samples(double u, double v) const {
  constexpr double kLeastWeight = 1e-9;  // of the vertex in the triangle; with less a sample lies on its side
  constexpr double kRowLength = 0.8660254037844386;  // of column steps
  constexpr double kSoftening = 0.05;
  constexpr double kNoSlope = 1e-3;
  constexpr double kHeldWithin = 0.5;  // of the samples' range, beyond it
  std::optional<WorldPoint> here;
  double least_weight = kLeastWeight;
  if (around_.warp != nullptr) least_weight = -0.02;  // places of vertices are right to a hundredth of a sample
  double nearest_weight = least_weight;
  float nearest = std::numeric_limits<float>::quiet_NaN();
  float least = std::numeric_limits<float>::infinity();
  float most = -least;
  std::array<double, 9> sums{};  // of weights, x, z, h, xx, xz, zz, xh, zh
  const auto first_column = static_cast<std::int64_t>(std::floor(u)) - around_.reach_x + 1;
  const auto first_row = static_cast<std::int64_t>(std::floor(v)) - around_.reach_z + 1;
  for (std::int64_t row = first_row; row < first_row + 2 * around_.reach_z; ++row) {
    if (row < 0 || row >= axis_z_.samples()) continue;
    for (std::int64_t column = first_column; column < first_column + 2 * around_.reach_x; ++column) {
      if (!axis_x_.wraps() && (column < 0 || column >= axis_x_.samples())) continue;
      if (is_void(column, row)) continue;
      double x = (static_cast<double>(column) - u) * around_.sample_x;
      double z = (static_cast<double>(row) - v) * around_.sample_z;
      if (around_.warp != nullptr) {
        const WorldPoint there =
            around_.warp->world_from_source({static_cast<double>(column), static_cast<double>(row)});
        if (!here) here = around_.warp->world_from_source({u, v});
        x = there.x - here->x;
        z = there.z - here->z;
      }
      x /= 2.0 * around_.sigma_x;
      z /= around_.sigma_z;
      const float height = at_index(column, row);
      const double weight = 1.0 - std::max(std::abs(z), std::abs(x) + 0.5 * std::abs(z));
      if (weight > nearest_weight) {
        nearest_weight = weight;
        nearest = height;
      }
      least = std::min(least, height);
      most = std::max(most, height);
      z *= kRowLength;
      const double square = x * x + z * z + kSoftening;
      const double share = 1.0 / (square * square);
      const double h = double{height};
      const std::array<double, 9> terms{1.0, x, z, h, x * x, x * z, z * z, x * h, z * h};
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += share * terms[i];
    }
  }
  if (!(nearest_weight > least_weight) || kernel_.taps() == 1) return nearest;
  const auto mean = [&](std::size_t i) { return sums[i] / sums[0]; };
  const double xx = mean(4) - mean(1) * mean(1) + kNoSlope;
  const double xz = mean(5) - mean(1) * mean(2);
  const double zz = mean(6) - mean(2) * mean(2) + kNoSlope;
  const double xh = mean(7) - mean(1) * mean(3);
  const double zh = mean(8) - mean(2) * mean(3);
  const double determinant = xx * zz - xz * xz;
  const double slope_x = (xh * zz - zh * xz) / determinant;
  const double slope_z = (zh * xx - xh * xz) / determinant;
  const float more = static_cast<float>(kHeldWithin) * (most - least);
  const auto plane = static_cast<float>(mean(3) - slope_x * mean(1) - slope_z * mean(2));
  return held_within(plane, std::max(least - more, around_.lowest), std::min(most + more, around_.highest));
}

std::int64_t LatticeAround::reach_of(double samples) {
  constexpr double kMost = 16.0;  // lattices much coarser than the source leave samples without a surface
  return static_cast<std::int64_t>(std::clamp(std::ceil(samples), 2.0, kMost));
}

float VoidRule::held_near_samples(float height, const Taps& taps, const TapWeights& columns,
                                  const TapWeights& rows) const {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const int z : {1, 2}) {
    for (const int x : {1, 2}) {
      if (is_void(columns.first + x, rows.first + z)) continue;
      double corner = 0.0;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          corner += kernel_.value(j) * kernel_.value(i) *
                    taps[static_cast<std::size_t>(z + j)][static_cast<std::size_t>(x + i)];
        }
      }
      if (std::isnan(corner)) continue;
      least = std::min(least, corner);
      most = std::max(most, corner);
    }
  }
  if (least > most) return height;
  const double more = 0.25 * (most - least);
  return held_within(height, static_cast<float>(least - more), static_cast<float>(most + more));
}

/// Missing taps go on along each row whose middle two are there, then along each column.
void VoidRule::complete(Taps& taps) const {
  if (kernel_.taps() != kMaxTaps) return;
  const auto go_on = [](auto tap) {
    if (std::isnan(tap(1)) || std::isnan(tap(2))) return;
    if (std::isnan(tap(0))) tap(0) = 2.0 * tap(1) - tap(2);
    if (std::isnan(tap(3))) tap(3) = 2.0 * tap(2) - tap(1);
  };
  for (std::size_t j = 0; j < kMaxTaps; ++j) go_on([&](std::size_t i) -> double& { return taps[j][i]; });
  for (std::size_t i = 0; i < kMaxTaps; ++i) go_on([&](std::size_t j) -> double& { return taps[j][i]; });
}

double VoidRule::coefficient(std::int64_t column, std::int64_t row) const {
  double sum = 0.0;
  axis_z_.stand_ins(row, [&](std::int64_t r, int row_weight) {
    axis_x_.stand_ins(column, [&](std::int64_t c, int column_weight) {
      sum += row_weight * column_weight * double{band_.heights(c - band_.first_column, r - band_.first_row)};
    });
  });
  return sum;
}

float VoidRule::at_index(std::int64_t column, std::int64_t row) const {
  return band_.heights(axis_x_.index(column) - band_.first_column, axis_z_.index(row) - band_.first_row);
}

bool VoidRule::is_void(std::int64_t column, std::int64_t row) const {
  if (band_.voids.data() == nullptr) return std::isnan(at_index(column, row));
  return band_.voids(axis_x_.index(column) - band_.first_column, axis_z_.index(row) - band_.first_row) != 0;
}

/// Rows that the kernel itself does not read may lie outside the band; the nearest kernel has but one.
bool VoidRule::all_nearest_void(double u, double v) const {
  if (kernel_.taps() == 1) return false;
  for (const double row : {std::floor(v), std::ceil(v)}) {
    for (const double column : {std::floor(u), std::ceil(u)}) {
      if (!is_void(static_cast<std::int64_t>(column), static_cast<std::int64_t>(row))) return false;
    }
  }
  return true;
}

}  // namespace isohf
