#pragma once

#include <array>
#include <complex>
#include <span>

#include "sine_wave.h"
#include "test_mesh.h"

/// How far a mesh is from the wave that it stands for.

namespace isohf::experiment {

/// Height of the light over the ground plane. Its azimuth is the wave's direction, so it turns with the wave: what an
/// orientation changes is the grid under both.
inline constexpr double kLightElevation_rad = 0.78539816339744831;  // 45°

/// Integrals over the measured triangles.
struct ErrorSums {
  double area = 0.0;
  double elevation = 0.0;          ///< of |mesh - sine|, amplitudes
  double elevation_squared = 0.0;  ///< of its square
  double normal_rad = 0.0;         ///< of the angle between the face's normal and the sine's
  double shading = 0.0;            ///< of |difference of max(0, n·l)|, Lambert's law with unit light and albedo

  ErrorSums& operator+=(const ErrorSums& other);
};

/// Measures the triangles of one mesh against one wave of amplitude 1 (elevations) whose steepest slope is
/// `steepest` (normals and shading).
class ErrorMeter {
 public:
  ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest);

  /// Adds a triangle. O(1), about 35 evaluations of the wave.
  /// turn     exp(i (k·p + phase)) at the triangle's first vertex p
  /// heights  of its three vertices
  void add(const MeshTriangle& triangle, std::complex<double> turn, const std::array<double, 3>& heights,
           ErrorSums& sums) const;

  [[nodiscard]] std::span<const WaveOnShape> shapes() const { return shapes_; }

 private:
  void add_elevation(const WaveOnShape& on, double area, std::complex<double> turn,
                     const std::array<double, 3>& heights, ErrorSums& sums) const;
  void add_slopes(const WaveOnShape& on, const TriangleShape& shape, std::complex<double> turn,
                  const std::array<double, 3>& heights, ErrorSums& sums) const;

  const TestMesh* mesh_;
  std::vector<WaveOnShape> shapes_;
  std::array<double, kElevationPoints> second_;
  std::array<double, kElevationPoints> third_;
  std::array<double, kElevationPoints> elevation_weight_;
  std::array<double, kSlopePoints> slope_weight_;
  Place direction_;
  double slope_of_height_;  ///< true slope for one amplitude per sample spacing
  double steepest_;
};

}  // namespace isohf::experiment
