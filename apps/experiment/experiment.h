#pragma once

#include <array>
#include <cstdint>
#include <string>
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

enum MeshKind : std::size_t { kIso, kConsistent, kAlternating, kBest, kMeshKinds };
inline constexpr std::array<const char*, kMeshKinds> kMeshNames = {"iso", "consistent", "alternating", "best"};

struct ExperimentSettings {
  std::vector<std::int64_t> triangles = {1000, 2000, 5000, 10000};
  int phases = 12;           ///< from 0 to π, π left out
  int orientations = 100;    ///< of a full turn, even
  int frequency_count = 19;  ///< 0.01, 0.06, ...
  int frequency_stride = 1;  ///< every how many of them
  std::int64_t nyquist_triangles = 5000;
  bool interpolate = false;  ///< heights are the wave's own at the vertices, not fitted
};

/// All meshes against one orientation and frequency.
struct Trial {
  std::int64_t triangles;
  double frequency;                       ///< 1: Nyquist at settings.nyquist_triangles
  int orientation;                        ///< 0 <= orientation < settings.orientations / 2
  double angle_rad;                       ///< of the wave vector, 0 along the rows
  std::array<Errors, kMeshKinds> errors;  ///< averaged over the measured area and the phases
};

struct ExperimentResult {
  ExperimentSettings settings;
  std::vector<Trial> trials;  ///< by triangle count, frequency, orientation
};

[[nodiscard]] std::vector<double> frequencies_of(const ExperimentSettings& settings);

/// Runs them all. Memory: a few meshes a thread. The full set is hundreds of seconds of one core. Throws
/// Error{kCancelled}.
[[nodiscard]] ExperimentResult run_experiment(const ExperimentSettings& settings, const Job& job = {});

/// Averages over frequencies and orientations.
[[nodiscard]] Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles);

// Text of CSV files: a heading line, then commas.

/// Fig. 2: errors against triangle count, averaged over orientations and frequencies.
[[nodiscard]] std::string figure2_csv(const ExperimentResult& result);
/// Fig. 3: mean elevation error against orientation, for 5000 triangles and the highest frequency.
[[nodiscard]] std::string figure3_csv(const ExperimentResult& result);
/// Fig. 8: triangles of strip and stitch at every level of the paper's tile, 2564x3075 with 10 levels.
[[nodiscard]] std::string figure8_csv();

}  // namespace isohf::experiment
