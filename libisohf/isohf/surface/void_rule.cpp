#include "isohf/surface/void_rule.h"

#include <cmath>
#include <limits>

namespace isohf {

float VoidRule::at(double u, double v, const TapWeights& columns, const TapWeights& rows) const {
  constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
  if (all_nearest_void(u, v)) return kVoid;
  double sum = 0.0;
  double weight_sum = 0.0;
  double valid_weight = 0.0;
  bool whole = true;
  for (int j = 0; j < taps_; ++j) {
    for (int i = 0; i < taps_; ++i) {
      const double weight =
          double{columns.weights[static_cast<std::size_t>(i)]} * rows.weights[static_cast<std::size_t>(j)];
      if (!is_void(columns.first + i, rows.first + j)) valid_weight += weight;
      const float height = coefficient(columns.first + i, rows.first + j);
      if (std::isnan(height)) {
        whole = false;
        continue;
      }
      sum += weight * height;
      weight_sum += weight;
    }
  }
  if (valid_weight < 0.5) return kVoid;
  return static_cast<float>(whole ? sum : sum / weight_sum);
}

float VoidRule::coefficient(std::int64_t column, std::int64_t row) const {
  return band_.heights(axis_x_.index(column) - band_.first_column, axis_z_.index(row) - band_.first_row);
}

bool VoidRule::is_void(std::int64_t column, std::int64_t row) const {
  if (band_.voids.data() == nullptr) return std::isnan(coefficient(column, row));
  return band_.voids(axis_x_.index(column) - band_.first_column, axis_z_.index(row) - band_.first_row) != 0;
}

/// Rows that the kernel itself does not read may lie outside the band; the nearest kernel has but one.
bool VoidRule::all_nearest_void(double u, double v) const {
  if (taps_ == 1) return false;
  for (const double row : {std::floor(v), std::ceil(v)}) {
    for (const double column : {std::floor(u), std::ceil(u)}) {
      if (!is_void(static_cast<std::int64_t>(column), static_cast<std::int64_t>(row))) return false;
    }
  }
  return true;
}

}  // namespace isohf
