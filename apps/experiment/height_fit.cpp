#include "height_fit.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <array>

#include "isohf/base/assert.h"

namespace isohf::experiment {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

constexpr double kTolerance = 1e-10;
constexpr double kRefitTolerance = 1e-7;  // a choice of diagonals changes errors by far more
constexpr int kMostRounds = 6;

/// ∫ φi φj over a triangle: its area over 6 on the diagonal, over 12 beside it.
double mass(const TriangleShape& shape, bool same) {
  return shape.doubled_area() / (same ? 12.0 : 24.0);
}

/// Of the triangles that `takes` tells to be part of the surface.
template <typename Takes>
Matrix mass_matrix(const TestMesh& mesh, Takes takes) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t index = 0; index < mesh.triangles.size(); ++index) {
    if (!takes(index)) continue;
    const MeshTriangle& t = mesh.triangles[index];
    for (const std::uint32_t i : t.vertices) {
      for (const std::uint32_t j : t.vertices) {
        entries.emplace_back(static_cast<int>(i), static_cast<int>(j), mass(mesh.shapes[t.shape], i == j));
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(mesh.vertices.size());
  Matrix matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Vector solve(const Matrix& matrix, const Vector& load, const Vector& guess, double tolerance) {
  Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(tolerance);
  solver.compute(matrix);
  Vector heights = solver.solveWithGuess(load, guess);
  ISOHF_ASSERT(solver.info() == Eigen::Success);  // M is well conditioned by construction
  return heights;
}

/// True where any square changed its diagonal.
bool choose(const TestMesh& mesh, std::span<const WaveOnShape> shapes, const ComplexHeights& turned,
            DiagonalChoice& choice) {
  // ∫ (mesh - f)² over a triangle less ∫ f², which is the same for both diagonals of a square.
  const auto square_error = [&](const MeshTriangle& t) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double y = choice.heights[t.vertices[i]];
      sum -= 2.0 * y * (turned[t.vertices[0]] * shapes[t.shape].load[i]).imag();
      for (std::size_t j = 0; j < 3; ++j) {
        sum += y * choice.heights[t.vertices[j]] * mass(mesh.shapes[t.shape], i == j);
      }
    }
    return sum;
  };
  bool changed = false;
  choice.square_error = 0.0;
  for (std::size_t square = 0; square < choice.takes_other.size(); ++square) {
    std::array<double, 2> error = {};
    for (std::size_t i = 0; i < 4; ++i) error[i / 2] += square_error(mesh.triangles[4 * square + i]);
    const std::uint8_t better = error[1] < error[0] ? 1 : 0;
    choice.square_error += error[better];
    changed = changed || better != choice.takes_other[square];
    choice.takes_other[square] = better;
  }
  return changed;
}

}  // namespace

HeightFit::HeightFit(const TestMesh& mesh)
    : mesh_(&mesh), matrix_(mass_matrix(mesh, [](std::size_t) { return true; })) {}

ComplexHeights HeightFit::fit(const SineWave& wave) const {
  ComplexHeights heights = wave_at_vertices(wave, *mesh_);
  const std::vector<WaveOnShape> shapes = wave_on_shapes(wave, *mesh_);
  Eigen::VectorXcd load = Eigen::VectorXcd::Zero(matrix_.rows());
  for (const MeshTriangle& t : mesh_->triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      load[static_cast<Eigen::Index>(t.vertices[i])] += heights[t.vertices[0]] * shapes[t.shape].load[i];
    }
  }
  const Eigen::Map<const Eigen::VectorXcd> guess(heights.data(), load.size());
  const Vector re = solve(matrix_, load.real(), guess.real(), kTolerance);
  const Vector im = solve(matrix_, load.imag(), guess.imag(), kTolerance);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = {re[static_cast<Eigen::Index>(i)], im[static_cast<Eigen::Index>(i)]};
  }
  return heights;
}

DiagonalChoice fit_diagonals(const TestMesh& mesh, std::span<const WaveOnShape> shapes, const ComplexHeights& turned,
                             std::vector<double> heights, bool refit) {
  DiagonalChoice choice = {std::move(heights), std::vector<std::uint8_t>(mesh.triangles.size() / 4, 0), 0.0};
  bool changed = choose(mesh, shapes, turned, choice) || refit;
  for (int round = 0; refit && changed && round < kMostRounds; ++round) {
    const auto takes = [&](std::size_t triangle) { return choice.takes(triangle); };
    const Matrix matrix = mass_matrix(mesh, takes);
    Vector load = Vector::Zero(matrix.rows());
    for (std::size_t index = 0; index < mesh.triangles.size(); ++index) {
      if (!takes(index)) continue;
      const MeshTriangle& t = mesh.triangles[index];
      for (std::size_t i = 0; i < 3; ++i) {
        load[static_cast<Eigen::Index>(t.vertices[i])] += (turned[t.vertices[0]] * shapes[t.shape].load[i]).imag();
      }
    }
    Eigen::Map<Vector> stored(choice.heights.data(), load.size());
    stored = solve(matrix, load, stored, kRefitTolerance);
    changed = choose(mesh, shapes, turned, choice);
  }
  return choice;
}

}  // namespace isohf::experiment
