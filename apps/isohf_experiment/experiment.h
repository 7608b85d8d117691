#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isohf/job.h"
#include "reconstruction_error.h"

/// Section 2 of the paper: how well meshes of equal triangle counts stand for plane sine waves (erratum E19).
///
/// What the paper leaves open is fixed here and in docs/experiment.md:
/// - 22,800 waves = 12 phases x 100 orientations x 19 frequencies. 0.01 to 1.00 by 0.05 would be 20; the first 19 are
///   taken, up to 0.91, which is the 0.9 of its Fig. 3.
/// - Frequency 1 is the Nyquist frequency of the square grid with `nyquist_triangles` triangles: half a cycle per
///   sample. Waves above half a cycle per sample of the mesh at hand are left out, as the paper does.
/// - All waves have one amplitude, that which makes the wave of frequency 1 as steep as 45 degrees.
/// - Waves that differ by half a turn are point reflections of each other, as are the meshes and the light, which turns
///   with the wave: 50 of the 100 orientations are computed and stand for all.

namespace isohf::experiment {

enum class MeshKind { kIso, kOrthoConsistent, kOrthoAlternating, kOrthoBest };
inline constexpr std::array<MeshKind, 4> kMeshKinds = {MeshKind::kIso, MeshKind::kOrthoConsistent,
                                                       MeshKind::kOrthoAlternating, MeshKind::kOrthoBest};
/// "iso", "consistent", "alternating", "best".
[[nodiscard]] const char* to_string(MeshKind kind);

enum class HeightRule { kLeastSquares, kInterpolate };

struct ExperimentSettings {
  std::vector<std::int64_t> triangles = {1000, 2000, 5000, 10000};
  int phases = 12;           ///< from 0 to π, π left out; 1 to 360
  int orientations = 100;    ///< of a full turn, even, 2 to 3600
  int frequency_count = 19;  ///< 0.01, 0.06, ...; 1 to 20
  int frequency_stride = 1;  ///< every how many of them; >= 1
  std::int64_t nyquist_triangles = 5000;
  HeightRule heights = HeightRule::kLeastSquares;
  Light light;

  /// A subset with the same limits: 6 phases, 40 orientations, 7 frequencies up to 0.91.
  [[nodiscard]] static ExperimentSettings quick();
};

/// Errors of a mesh, averaged over its measured area and the phases.
struct Errors {
  double mean = 0.0;               ///< of |elevation error|, amplitudes
  double rms = 0.0;                ///< root of the mean square elevation error, amplitudes
  double normal_rad = 0.0;         ///< angle between normals, the face's
  double shading = 0.0;            ///< Lambert, by settings.light, of faces
  double vertex_normal_rad = 0.0;  ///< the same two by blended vertex normals
  double vertex_shading = 0.0;
  double defect_rad = 0.0;  ///< |angle defect| of a vertex: Gaussian curvature, which a plane wave has none of
  std::array<double, kAzimuths> azimuth_shading = {};  ///< by vertex normals, under lights that stand still
};

/// One mesh against one orientation and frequency.
struct Trial {
  MeshKind mesh;
  std::int64_t triangles;  ///< as asked for
  std::int64_t mesh_triangles;
  double frequency;          ///< 1: Nyquist at settings.nyquist_triangles
  double cycles_per_sample;  ///< (0, ½]
  int orientation;           ///< 0 <= orientation < settings.orientations / 2
  double angle_rad;          ///< of the wave vector, 0 along the rows
  Errors errors;
  double phase_spread;  ///< (largest - smallest) / average over the phases of the mean elevation error
};

struct ExperimentResult {
  ExperimentSettings settings;
  std::vector<Trial> trials;  ///< by triangle count, frequency, orientation, mesh
  std::int64_t waves = 0;     ///< phases x orientations x frequencies
  std::int64_t left_out = 0;  ///< (wave, triangle count) pairs above the Nyquist frequency
};

[[nodiscard]] std::vector<double> frequencies_of(const ExperimentSettings& settings);

/// Runs them all. Memory: a few meshes a thread, whatever the job's bound. The full set is hundreds of seconds of one
/// core. Throws Error{kInvalidArgument} for settings out of range, Error{kCancelled}.
[[nodiscard]] ExperimentResult run_experiment(const ExperimentSettings& settings, const Job& job = {});

/// Averages over frequencies and orientations, for one triangle count.
[[nodiscard]] Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles);
/// Averages over orientations only; the frequency is one of frequencies_of().
[[nodiscard]] Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles,
                                    double frequency);

}  // namespace isohf::experiment
