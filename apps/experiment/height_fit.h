#pragma once

#include <Eigen/SparseCore>
#include <complex>
#include <cstdint>
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

  /// Heights for exp(i k·p): those of the sine of any phase p are the imaginary part of exp(ip) times these, for the
  /// fit is linear. Relative residual at most 1e-10.
  [[nodiscard]] ComplexHeights fit(const SineWave& wave) const;

 private:
  const TestMesh* mesh_;
  Eigen::SparseMatrix<double> matrix_;
};

/// A square grid's heights together with the better diagonal of every square.
struct DiagonalChoice {
  std::vector<double> heights;
  std::vector<std::uint8_t> takes_other;  ///< for each square: 0 its consistent diagonal, 1 the other one
  double square_error = 0.0;              ///< ∫ (mesh - sine)² less ∫ sine², over the whole patch

  /// Whether a triangle of the mesh is part of the surface.
  [[nodiscard]] bool takes(std::size_t triangle) const { return (triangle / 2) % 2 == takes_other[triangle / 4]; }
};

/// Heights and diagonals in turn (Akenine-Möller and Haines' choice of a diagonal for each square): with the heights
/// given, each square takes the diagonal of the lower square error; with the diagonals given, the heights are fitted
/// again. The error falls with every step, so it ends in a local minimum, or after 6 rounds. Where it ends depends on
/// where it starts; start from several heights and keep the lowest error.
///
/// For a make_ortho_mesh(..., Diagonals::kBoth) and the sine whose values at the vertices are the imaginary parts of
/// `turned`, starting from `heights`. With `refit` false only the diagonals are chosen.
[[nodiscard]] DiagonalChoice fit_diagonals(const TestMesh& mesh, std::span<const WaveOnShape> shapes,
                                           const ComplexHeights& turned, std::vector<double> heights, bool refit);

}  // namespace isohf::experiment
