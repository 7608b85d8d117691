#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace isohf::terrain {

/// What land to make. The same options give the same heights on every machine and for any order of calls.
struct TerrainOptions {
  std::uint64_t seed = 1;
  double spacing_m = 30;     ///< distance between samples
  double relief_m = 2600;    ///< from the plains to the highest peaks, about
  double base_m = 0;         ///< added to every height; the sea lies there
  double feature_m = 16000;  ///< distance between the main mountain ridges
  double roughness_m = 1.5;  ///< half the range of the uncorrelated error that a real sensor leaves on each sample
  double void_fraction = 0;  ///< share of samples that lie in void patches, 0 to 0.4
  bool coast = false;        ///< lets the lowlands go under a flat sea
};

/// A square noise lattice, turned against the raster. Positions are 32.32 fixed point, so that precision does not
/// depend on how far from the origin a sample lies.
struct NoiseLattice {
  std::int64_t u_per_column = 0, u_per_row = 0, u_origin = 0;
  std::int64_t v_per_column = 0, v_per_row = 0, v_origin = 0;
  float cosine = 1, sine = 0;
  float cells_per_feature = 1;  ///< scales an offset given in features (TerrainOptions::feature_m)
  std::uint32_t seed = 0;
};

/// An endless landscape, evaluated anywhere: domain-warped ridged multifractal mountains over lowlands whose valley
/// floors are filled, then gullies that run down the slope of all that is coarser, each octave of them branching off
/// the one before, as water would have cut them.
class Terrain {
 public:
  explicit Terrain(const TerrainOptions& options);

  /// Heights of the samples (column .. column + heights.size(), row), in metres; NaN where void. Thread-safe.
  void row(std::int64_t column, std::int64_t row, std::span<float> heights) const;

  /// A bound on every height: [lowest, highest] in metres.
  [[nodiscard]] std::array<double, 2> bounds() const;

 private:
  void chunk(std::int64_t column, std::int64_t row, int count, float* heights) const;

  TerrainOptions options_;
  std::array<NoiseLattice, 3> continent_;
  std::array<NoiseLattice, 4> bend_;  ///< two octaves each of the warp's x and z
  std::array<NoiseLattice, 4> ridges_;
  std::vector<NoiseLattice> gullies_;
  NoiseLattice grit_;
  NoiseLattice void_edge_;
};

}  // namespace isohf::terrain
