#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/source_warp.h"
#include "isohf/sampling/source/source_axis.h"
#include "isohf/sampling/source/source_band.h"

namespace isohf {

/// The triangles around any vertex of a lattice, as the source's samples see them: a hexagon, one column step to either
/// side and one row up and down. By default there are none, and nothing is beside a void.
struct LatticeAround {
  std::int64_t reach_x = 0;  ///< in samples: the hexagon reaches less far, but where it is cut off
  std::int64_t reach_z = 0;
  double sigma_x = 1.0;   ///< half a column step, in units of the axes, or of the world where there is a warp
  double sigma_z = 1.0;   ///< a row
  double sample_x = 1.0;  ///< between samples, in the same units
  double sample_z = 1.0;
  const ExactWarp* warp = nullptr;                         ///< where the source was projected
  float lowest = -std::numeric_limits<float>::infinity();  ///< heights of vertices beside samples are held within
  float highest = std::numeric_limits<float>::infinity();

  /// `samples`: those that a step of the lattice crosses at most, along u and v.
  [[nodiscard]] static std::int64_t reach_of(double samples);
};

/// One vertex whose taps are voids or lie beyond the source's ends, by the rule in kernels.h.
class VoidRule {
 public:
  /// All five outlive the rule.
  VoidRule(const SourceBand& band, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
           const LatticeAround& around)
      : band_(band), axis_x_(axis_x), axis_z_(axis_z), kernel_(kernel), around_(around) {}

  /// u, v: position in source samples; columns, rows: the kernel's weights there.
  [[nodiscard]] float at(double u, double v, const TapWeights& columns, const TapWeights& rows) const;

 private:
  using Taps = std::array<std::array<double, kMaxTaps>, kMaxTaps>;  ///< [row][column], NaN where missing
  [[nodiscard]] float beside_samples(double u, double v) const;
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
  const LatticeAround& around_;
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
