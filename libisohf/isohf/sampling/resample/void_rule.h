#pragma once

#include <array>
#include <cstdint>

#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/source/source_axis.h"
#include "isohf/sampling/source/source_band.h"

namespace isohf {

/// One vertex whose taps are voids or lie beyond the source's ends, by the rule in kernels.h.
class VoidRule {
 public:
  /// All four outlive the rule.
  VoidRule(const SourceBand& band, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel)
      : band_(band), axis_x_(axis_x), axis_z_(axis_z), kernel_(kernel) {}

  /// u, v: position in source samples; columns, rows: the kernel's weights there.
  [[nodiscard]] float at(double u, double v, const TapWeights& columns, const TapWeights& rows) const;

 private:
  using Taps = std::array<std::array<double, kMaxTaps>, kMaxTaps>;  ///< [row][column], NaN where missing
  [[nodiscard]] double coefficient(std::int64_t column, std::int64_t row) const;
  void complete(Taps& taps) const;
  [[nodiscard]] float held_near_samples(float height, const Taps& taps, const TapWeights& columns,
                                        const TapWeights& rows) const;
  [[nodiscard]] float at_index(std::int64_t column, std::int64_t row) const;
  [[nodiscard]] bool is_void(std::int64_t column, std::int64_t row) const;
  [[nodiscard]] bool all_nearest_void(double u, double v) const;

  const SourceBand& band_;
  const SourceAxis& axis_x_;
  const SourceAxis& axis_z_;
  const Kernel& kernel_;
};

/// `height` within [least, most]; NaN stays NaN.
[[nodiscard]] inline float held_within(float height, float least, float most) {
  return height < least ? least : (height > most ? most : height);
}

/// The elevation outside that the edge and its mirror place inside ask for; the edge's own where the latter is void.
[[nodiscard]] inline float continue_slope(float edge, float mirrored) {
  const float height = 2.0F * edge - mirrored;
  return height != height ? edge : height;
}

}  // namespace isohf
