#include "isohf/sampling/source/source_axis.h"

#include <algorithm>
#include <cmath>

namespace isohf {
namespace {

/// Positions this close to the end of the covered ground count as on it: the end is computed from products of extents
/// and counts and may miss it by a few units in the last place.
constexpr double kEndTolerance = 1e-6;

}  // namespace

SourceAxis::SourceAxis(std::int64_t samples, double first_world, double spacing_world, Registration registration,
                       double continued_world)
    : samples_(samples),
      first_world_(first_world),
      spacing_world_(spacing_world),
      reach_(registration == Registration::kArea ? 0.5 : 0.0),
      continued_(std::min(std::max(continued_world / spacing_world, reach_), static_cast<double>(samples - 1))) {}

SourceAxis SourceAxis::wrapping(std::int64_t samples, double first_world, double spacing_world) {
  SourceAxis axis(samples, first_world, spacing_world, Registration::kPoint, 0.0);
  axis.wraps_ = true;
  return axis;
}

SourceAxis SourceAxis::of_positions(std::int64_t samples, Registration registration, double continued) {
  SourceAxis axis(samples, 0.0, 1.0, registration, continued);
  axis.ends_ = true;
  return axis;
}

std::int64_t SourceAxis::continued_samples() const {
  return static_cast<std::int64_t>(std::ceil(continued_));
}

SourceAxis::Place SourceAxis::place(double world) const {
  const double u = (world - first_world_) / spacing_world_;
  const auto last = static_cast<double>(samples_ - 1);
  if (wraps_) {
    const auto round = static_cast<double>(samples_);
    const double position = u - round * std::floor(u / round);
    return {position < round ? position : 0.0};
  }
  if (u >= 0.0 && u <= last) return {u};
  const double edge = u < 0.0 ? 0.0 : last;
  const double beyond = std::abs(u - edge);
  if (beyond <= kEndTolerance) return {edge};
  if (ends_ && beyond > continued_ + kEndTolerance) return {edge, edge, false, false};
  const double inside = std::min(beyond, continued_);
  return {u < 0.0 ? inside : last - inside, edge, true, true};
}

}  // namespace isohf
