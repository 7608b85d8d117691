#pragma once

#include <array>
#include <complex>
#include <span>
#include <vector>

#include "sine_wave.h"
#include "test_mesh.h"

/// How far a mesh is from the wave that it stands for.

namespace isohf::experiment {

/// Shading is max(0, n·l), Lambert's law with unit light and albedo. The light stands 45 degrees high in the wave's
/// direction: it turns with the wave, and what an orientation changes is the grid under both.
enum ErrorKind : std::size_t {
  kMean,     ///< of |mesh - sine|, amplitudes
  kRms,      ///< root of the mean square of that
  kNormal,   ///< angle between the face's normal and the sine's, radians
  kShading,  ///< |difference of shading| by these normals
  kErrorKinds,
};
using Errors = std::array<double, kErrorKinds>;

/// Integrals over the measured triangles; of kRms the square.
struct ErrorSums {
  Errors sums = {};
  double area = 0.0;

  [[nodiscard]] Errors mean() const;
};

/// Measures the triangles of one mesh against one wave of amplitude 1 (elevations) whose steepest slope is
/// `steepest` (normals and shading).
class ErrorMeter {
 public:
  ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest);

  /// Adds the measured ones of the mesh's triangles.
  /// takes    one of the mesh's triangles each: whether it is part of the surface
  /// exact    exp(i (k·p + phase)) at the vertices p
  /// heights  of the vertices, amplitudes
  void add(const std::vector<bool>& takes, std::span<const std::complex<double>> exact, std::span<const double> heights,
           ErrorSums& sums) const;

  [[nodiscard]] std::span<const WaveOnShape> shapes() const { return shapes_; }

 private:
  const TestMesh* mesh_;
  std::vector<WaveOnShape> shapes_;
  Place direction_;
  double slope_of_height_;  ///< true slope for one amplitude per sample spacing
  double steepest_;
};

}  // namespace isohf::experiment
