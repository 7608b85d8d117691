#pragma once

#include <array>
#include <complex>
#include <vector>

#include "test_mesh.h"

/// Plane sine waves, seen from the triangles of a mesh.

namespace isohf::experiment {

/// sin(x·kx + z·kz + phase): wave vector in radians per sample spacing, pointing `angle_rad` from x towards z.
struct SineWave {
  double angle_rad;
  double cycles_per_sample;

  [[nodiscard]] Place wave_vector() const;
};

/// A point of a triangle by the weights of its second and third vertices, and its share of the triangle's area.
struct RulePoint {
  double second;
  double third;
  double weight;
};

/// Radon's rule of 7 points (exact to degree 5; A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971,
/// T2:5-1) on each of parts² equal triangles. Weights add up to 1.
[[nodiscard]] std::vector<RulePoint> triangle_rule(int parts);

inline constexpr std::size_t kElevationPoints = 28;  ///< triangle_rule(2)
inline constexpr std::size_t kSlopePoints = 7;       ///< triangle_rule(1)
[[nodiscard]] const std::vector<RulePoint>& elevation_rule();
[[nodiscard]] const std::vector<RulePoint>& slope_rule();

/// exp(i k·o) for the points o of a triangle seen from its first vertex: what translates of the triangle share.
struct WaveOnShape {
  std::array<std::complex<double>, kElevationPoints> elevation;
  std::array<std::complex<double>, kSlopePoints> slope;
  /// Integral of exp(i k·o) times the hat function of each vertex, by 448 points: relative error below 1e-9 up to half
  /// a cycle per sample.
  std::array<std::complex<double>, 3> load;
};

[[nodiscard]] std::vector<WaveOnShape> wave_on_shapes(const SineWave& wave, const TestMesh& mesh);

/// exp(i k·p) at every vertex p. The imaginary part is the sine of phase 0, the real part that of phase π/2.
[[nodiscard]] std::vector<std::complex<double>> wave_at_vertices(const SineWave& wave, const TestMesh& mesh);

}  // namespace isohf::experiment
