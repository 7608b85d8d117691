#include "height_fit.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>

#include "isohf/base/assert.h"

namespace isohf::experiment {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using Solver = Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper>;

constexpr double kTolerance = 1e-10;
constexpr double kRefitTolerance = 1e-7;  // a choice of diagonals changes errors by far more

/// ∫ φi φj over a triangle: its area over 6 on the diagonal, over 12 beside it.
double mass(const TriangleShape& shape, bool same) {
  return shape.doubled_area() / (same ? 12.0 : 24.0);
}

Matrix mass_matrix(const TestMesh& mesh) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * mesh.triangles.size());
  for (const MeshTriangle& t : mesh.triangles) {
    for (const std::uint32_t i : t.vertices) {
      for (const std::uint32_t j : t.vertices) {
        entries.emplace_back(static_cast<int>(i), static_cast<int>(j), mass(mesh.shapes[t.shape], i == j));
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(mesh.vertices.size());
  Matrix matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  matrix.makeCompressed();
  return matrix;
}

Vector solve(const Matrix& matrix, const Vector& load, const Vector& guess, double tolerance) {
  Solver solver;
  solver.setTolerance(tolerance);
  solver.compute(matrix);
  Vector heights = solver.solveWithGuess(load, guess);
  ISOHF_ASSERT(solver.info() == Eigen::Success);  // M is well conditioned by construction
  return heights;
}

}  // namespace

struct HeightFit::State {
  const TestMesh* mesh;
  Matrix matrix;

  [[nodiscard]] Eigen::VectorXcd load(const SineWave& wave, const ComplexHeights& at) const {
    const std::vector<WaveOnShape> shapes = wave_on_shapes(wave, *mesh);
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(matrix.rows());
    for (const MeshTriangle& t : mesh->triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        sum[static_cast<Eigen::Index>(t.vertices[i])] += at[t.vertices[0]] * shapes[t.shape].load[i];
      }
    }
    return sum;
  }
};

HeightFit::HeightFit(const TestMesh& mesh) : state_(new State{&mesh, mass_matrix(mesh)}) {}
HeightFit::~HeightFit() = default;
HeightFit::HeightFit(HeightFit&&) noexcept = default;
HeightFit& HeightFit::operator=(HeightFit&&) noexcept = default;

ComplexHeights HeightFit::fit(const SineWave& wave) const {
  ComplexHeights heights = wave_at_vertices(wave, *state_->mesh);
  const Eigen::VectorXcd load = state_->load(wave, heights);
  const Eigen::Map<const Eigen::VectorXcd> guess(heights.data(), load.size());
  const Vector re = solve(state_->matrix, load.real(), guess.real(), kTolerance);
  const Vector im = solve(state_->matrix, load.imag(), guess.imag(), kTolerance);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = {re[static_cast<Eigen::Index>(i)], im[static_cast<Eigen::Index>(i)]};
  }
  return heights;
}

ComplexHeights HeightFit::fit_directly(const SineWave& wave) const {
  ComplexHeights heights = wave_at_vertices(wave, *state_->mesh);
  const Eigen::VectorXcd load = state_->load(wave, heights);
  const Eigen::SimplicialLDLT<Matrix> factors(state_->matrix);
  const Vector re = factors.solve(Vector(load.real()));
  const Vector im = factors.solve(Vector(load.imag()));
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = {re[static_cast<Eigen::Index>(i)], im[static_cast<Eigen::Index>(i)]};
  }
  return heights;
}

struct DiagonalFit::State {
  const TestMesh* mesh;
  Matrix pattern;                              ///< an entry for every pair that either diagonal joins
  std::vector<std::array<int, 9>> value_slot;  ///< for each triangle: where its nine entries lie in the values

  [[nodiscard]] Vector load(std::span<const WaveOnShape> shapes, std::span<const std::complex<double>> turned,
                            std::span<const std::uint8_t> takes_other) const {
    Vector sum = Vector::Zero(pattern.rows());
    for (std::size_t square = 0; square < takes_other.size(); ++square) {
      for (std::size_t half = 0; half < 2; ++half) {
        const MeshTriangle& t = mesh->triangles[4 * square + 2 * takes_other[square] + half];
        for (std::size_t i = 0; i < 3; ++i) {
          const std::complex<double> part = turned[t.vertices[0]] * shapes[t.shape].load[i];
          sum[static_cast<Eigen::Index>(t.vertices[i])] += part.imag();
        }
      }
    }
    return sum;
  }

  void assemble(std::span<const std::uint8_t> takes_other, Matrix& matrix) const {
    std::fill_n(matrix.valuePtr(), matrix.nonZeros(), 0.0);
    for (std::size_t square = 0; square < takes_other.size(); ++square) {
      for (std::size_t half = 0; half < 2; ++half) {
        const std::size_t index = 4 * square + 2 * takes_other[square] + half;
        const TriangleShape& shape = mesh->shapes[mesh->triangles[index].shape];
        for (std::size_t e = 0; e < 9; ++e) matrix.valuePtr()[value_slot[index][e]] += mass(shape, e % 4 == 0);
      }
    }
  }

  /// ∫ (mesh - f)² over a triangle less ∫ f², which is the same for both diagonals of a square.
  [[nodiscard]] double square_error(const MeshTriangle& t, std::span<const WaveOnShape> shapes,
                                    std::span<const std::complex<double>> turned,
                                    std::span<const double> heights) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double y = heights[t.vertices[i]];
      const std::complex<double> load = turned[t.vertices[0]] * shapes[t.shape].load[i];
      sum -= 2.0 * y * load.imag();
      for (std::size_t j = 0; j < 3; ++j) {
        sum += y * heights[t.vertices[j]] * mass(mesh->shapes[t.shape], i == j);
      }
    }
    return sum;
  }

  /// True where any square changed its diagonal.
  bool choose(std::span<const WaveOnShape> shapes, std::span<const std::complex<double>> turned,
              DiagonalChoice& choice) const {
    bool changed = false;
    choice.square_error = 0.0;
    for (std::size_t square = 0; square < choice.takes_other.size(); ++square) {
      std::array<double, 2> error = {};
      for (std::size_t i = 0; i < 4; ++i) {
        error[i / 2] += square_error(mesh->triangles[4 * square + i], shapes, turned, choice.heights);
      }
      const std::uint8_t better = error[1] < error[0] ? 1 : 0;
      choice.square_error += error[better];
      changed = changed || better != choice.takes_other[square];
      choice.takes_other[square] = better;
    }
    return changed;
  }
};

DiagonalFit::DiagonalFit(const TestMesh& mesh) : state_(new State{&mesh, mass_matrix(mesh), {}}) {
  for (const MeshTriangle& t : mesh.triangles) {
    std::array<int, 9> slots = {};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        const double& value =
            state_->pattern.coeffRef(static_cast<int>(t.vertices[i]), static_cast<int>(t.vertices[j]));
        slots[3 * i + j] = static_cast<int>(&value - state_->pattern.valuePtr());
      }
    }
    state_->value_slot.push_back(slots);
  }
}
DiagonalFit::~DiagonalFit() = default;
DiagonalFit::DiagonalFit(DiagonalFit&&) noexcept = default;
DiagonalFit& DiagonalFit::operator=(DiagonalFit&&) noexcept = default;

DiagonalChoice DiagonalFit::fit(std::span<const WaveOnShape> shapes, std::span<const std::complex<double>> vertices,
                                double phase_rad, std::vector<double> heights, bool refit) const {
  std::vector<std::complex<double>> turned(vertices.begin(), vertices.end());
  for (std::complex<double>& value : turned) value *= std::polar(1.0, phase_rad);
  DiagonalChoice choice = {std::move(heights), std::vector<std::uint8_t>(state_->mesh->triangles.size() / 4, 0), 0.0};
  Matrix matrix = state_->pattern;
  state_->choose(shapes, turned, choice);
  for (int round = 0; refit && round < kMostRounds; ++round) {
    state_->assemble(choice.takes_other, matrix);
    const auto size = static_cast<Eigen::Index>(choice.heights.size());
    Eigen::Map<Vector> stored(choice.heights.data(), size);
    stored = solve(matrix, state_->load(shapes, turned, choice.takes_other), stored, kRefitTolerance);
    if (!state_->choose(shapes, turned, choice)) break;
  }
  return choice;
}

}  // namespace isohf::experiment
