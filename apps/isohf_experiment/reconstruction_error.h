#pragma once

#include <array>
#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "sine_wave.h"
#include "test_mesh.h"

/// How far a mesh is from the wave that it stands for.

namespace isohf::experiment {

/// Where the light stands.
struct Light {
  /// Clockwise from North. nullopt: in the wave's direction, so that it turns with the wave, and what an orientation
  /// changes is the grid under both.
  std::optional<double> azimuth_rad;
  double elevation_rad = 0.78539816339744831;  ///< above the ground plane, 45°
};

/// Fixed lights, besides, by whose azimuth errors of shading are told: 0, 15, ... 165 degrees.
inline constexpr std::size_t kAzimuths = 12;

/// Normals of a surface's vertices, blended over a triangle as renderers do.
using CornerNormals = std::array<std::array<double, 3>, 3>;

/// Integrals over the measured triangles. Shading is max(0, n·l), Lambert's law with unit light and albedo. A light
/// that stands still counts with its opposite, half each: so waves half a turn apart, which are point reflections of
/// each other, are measured at once.
struct ErrorSums {
  double area = 0.0;
  double elevation = 0.0;          ///< of |mesh - sine|, amplitudes
  double elevation_squared = 0.0;  ///< of its square
  double normal_rad = 0.0;         ///< of the angle between the face's normal and the sine's
  double shading = 0.0;            ///< of |difference of shading| by the face's normal
  double vertex_normal_rad = 0.0;  ///< the same two for blended vertex normals
  double vertex_shading = 0.0;
  std::array<double, kAzimuths> azimuth_shading = {};  ///< by vertex normals and fixed lights
  double defect_rad = 0.0;                             ///< of |angle defect| of the measured vertices
  double vertices = 0.0;                               ///< how many these are

  ErrorSums& operator+=(const ErrorSums& other);
};

/// Measures the triangles of one mesh against one wave of amplitude 1 (elevations) whose steepest slope is
/// `steepest` (normals and shading).
class ErrorMeter {
 public:
  ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest, const Light& light);

  /// Adds the measured ones of the mesh's triangles.
  /// takes    one of the mesh's triangles each: whether it is part of the surface
  /// turn     exp(i phase);  exact  exp(i k·p) at the vertices p
  /// heights  of the vertices, amplitudes
  void add(const std::vector<bool>& takes, std::complex<double> turn, std::span<const std::complex<double>> exact,
           std::span<const double> heights, ErrorSums& sums) const;

  [[nodiscard]] std::span<const WaveOnShape> shapes() const { return shapes_; }

 private:
  void add_elevation(const WaveOnShape& on, double area, std::complex<double> turn,
                     const std::array<double, 3>& heights, ErrorSums& sums) const;
  void add_slopes(const WaveOnShape& on, const TriangleShape& shape, std::complex<double> turn,
                  const std::array<double, 3>& heights, const CornerNormals& normals, ErrorSums& sums) const;
  /// Slopes of a triangle's plane in x and z.
  [[nodiscard]] Place slope_of(const TriangleShape& shape, const std::array<double, 3>& heights) const;

  const TestMesh* mesh_;
  std::vector<WaveOnShape> shapes_;
  std::array<double, kElevationPoints> second_;
  std::array<double, kElevationPoints> third_;
  std::array<double, kElevationPoints> elevation_weight_;
  std::array<double, kSlopePoints> slope_weight_;
  Place direction_;
  double slope_of_height_;  ///< true slope for one amplitude per sample spacing
  double steepest_;
  /// To the light: along the wave, up, across it. First that of `shading` and its opposite, then the fixed ones and
  /// theirs.
  std::array<std::array<double, 3>, 2 + 2 * kAzimuths> to_light_;
};

}  // namespace isohf::experiment
