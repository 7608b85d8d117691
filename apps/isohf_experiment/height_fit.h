#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sine_wave.h"
#include "test_mesh.h"

/// Vertex heights that bring a mesh as near to a wave as its triangles allow.

namespace isohf::experiment {

using ComplexHeights = std::vector<std::complex<double>>;

/// Least squares over the whole patch: M y = b with the mass matrix M_ij = ∫ φi φj of the hat functions and
/// b_i = ∫ f φi, solved by conjugate gradients with a diagonal preconditioner (the condition number of M is below 10
/// whatever the size). M depends on the mesh alone and is assembled once. Immutable: one object serves many threads.
class HeightFit {
 public:
  /// `mesh` has no two triangles in one place and outlives this.
  explicit HeightFit(const TestMesh& mesh);
  ~HeightFit();
  HeightFit(HeightFit&&) noexcept;
  HeightFit& operator=(HeightFit&&) noexcept;

  /// Heights for exp(i k·p): those of the sine of any phase p are the imaginary part of exp(ip) times these, for the
  /// fit is linear. Relative residual at most 1e-10.
  [[nodiscard]] ComplexHeights fit(const SineWave& wave) const;

  /// The same by a sparse Cholesky factorisation. An independent check, slower.
  [[nodiscard]] ComplexHeights fit_directly(const SineWave& wave) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A square grid's heights together with the better diagonal of every square.
struct DiagonalChoice {
  std::vector<double> heights;
  std::vector<std::uint8_t> takes_other;  ///< for each square: 0 its consistent diagonal, 1 the other one
  double square_error = 0.0;              ///< ∫ (mesh - sine)² less ∫ sine², over the whole patch
};

/// Heights and diagonals in turn (Akenine-Möller and Haines' choice of a diagonal for each square): with the heights
/// given, each square takes the diagonal of the lower square error; with the diagonals given, the heights are fitted
/// again. The error falls with every step, so it ends in a local minimum, or after `kMostRounds`. Where it ends depends
/// on where it starts; start from several heights and keep the lowest error.
class DiagonalFit {
 public:
  static constexpr int kMostRounds = 6;

  /// `mesh` is a make_ortho_mesh(..., Diagonals::kBoth) and outlives this.
  explicit DiagonalFit(const TestMesh& mesh);
  ~DiagonalFit();
  DiagonalFit(DiagonalFit&&) noexcept;
  DiagonalFit& operator=(DiagonalFit&&) noexcept;

  /// For the sine of `phase_rad`, starting from `heights`. With `refit` false only the diagonals are chosen.
  [[nodiscard]] DiagonalChoice fit(std::span<const WaveOnShape> shapes, std::span<const std::complex<double>> vertices,
                                   double phase_rad, std::vector<double> heights, bool refit) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isohf::experiment
