#pragma once

#include <cstdint>

#include "isohf/surface/kernels.h"
#include "isohf/surface/source_axis.h"
#include "isohf/surface/source_band.h"

namespace isohf {

/// One vertex with a void among its taps, by the rule in kernels.h.
class VoidRule {
 public:
  /// All three outlive the rule.
  VoidRule(const SourceBand& band, const SourceAxis& axis_x, const SourceAxis& axis_z, int taps)
      : band_(band), axis_x_(axis_x), axis_z_(axis_z), taps_(taps) {}

  /// u, v: position in source samples; columns, rows: the kernel's weights there.
  [[nodiscard]] float at(double u, double v, const TapWeights& columns, const TapWeights& rows) const;

 private:
  [[nodiscard]] float coefficient(std::int64_t column, std::int64_t row) const;
  [[nodiscard]] bool is_void(std::int64_t column, std::int64_t row) const;
  [[nodiscard]] bool all_nearest_void(double u, double v) const;

  const SourceBand& band_;
  const SourceAxis& axis_x_;
  const SourceAxis& axis_z_;
  int taps_;
};

/// The elevation outside that the edge and its mirror place inside ask for; the edge's own where the latter is void.
[[nodiscard]] inline float continue_slope(float edge, float mirrored) {
  const float height = 2.0F * edge - mirrored;
  return height != height ? edge : height;
}

}  // namespace isohf
