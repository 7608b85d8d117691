#include "experiment.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <utility>

#include "height_fit.h"
#include "isohf/base/arena.h"
#include "isohf/lattice.h"

namespace isohf::experiment {
namespace {

constexpr double kFirstFrequency = 0.01;
constexpr double kFrequencyStep = 0.05;
constexpr double kNyquist = 0.5;  // cycles per sample
constexpr std::int64_t kFigure3Triangles = 5000;
constexpr double kDegrees = 180.0 / std::numbers::pi;

double cycles_per_sample(double frequency, std::int64_t triangles, std::int64_t nyquist_triangles) {
  return kNyquist * frequency * std::sqrt(static_cast<double>(nyquist_triangles) / static_cast<double>(triangles));
}

/// The meshes of one triangle count with what fits heights to them.
struct Bench {
  explicit Bench(std::int64_t count)
      : triangles(count),
        meshes{make_iso_mesh(count), make_ortho_mesh(count, Diagonals::kConsistent),
               make_ortho_mesh(count, Diagonals::kAlternating)},
        fits{HeightFit(meshes[0]), HeightFit(meshes[1]), HeightFit(meshes[2])},
        both(make_ortho_mesh(count, Diagonals::kBoth)) {}

  std::int64_t triangles;
  std::array<TestMesh, 3> meshes;  ///< by MeshKind
  std::array<HeightFit, 3> fits;
  TestMesh both;
};

/// One orientation and frequency on one Bench.
struct Task {
  const Bench* bench;
  double frequency;
  int orientation;
};

/// Errors of one mesh. surface(meter, exp(i phase), the wave at the vertices in that phase): which triangles are part
/// of it, and heights.
template <typename Surface>
Errors measure(const TestMesh& mesh, const SineWave& wave, double steepest, int phases, Surface surface) {
  const ErrorMeter meter(mesh, wave, steepest);
  const ComplexHeights exact = wave_at_vertices(wave, mesh);
  ErrorSums sums;
  for (int i = 0; i < phases; ++i) {
    const std::complex<double> turn = std::polar(1.0, std::numbers::pi * i / phases);
    ComplexHeights turned = exact;
    for (std::complex<double>& value : turned) value *= turn;
    const auto [takes, heights] = surface(meter, turn, turned);
    meter.add(takes, turned, heights, sums);
  }
  return sums.mean();
}

std::vector<double> imaginary(const ComplexHeights& heights, std::complex<double> turn) {
  std::vector<double> parts;
  for (const std::complex<double>& y : heights) parts.push_back((turn * y).imag());
  return parts;
}

Trial run_task(const Task& task, const ExperimentSettings& settings) {
  const Bench& bench = *task.bench;
  const SineWave wave{2.0 * std::numbers::pi * task.orientation / settings.orientations,
                      cycles_per_sample(task.frequency, bench.triangles, settings.nyquist_triangles)};
  const bool is_fitted = !settings.interpolate;
  const double steepest = task.frequency;  // one amplitude for all, 45 degrees at frequency 1
  Trial trial = {bench.triangles, task.frequency, task.orientation, wave.angle_rad, {}};
  std::array<ComplexHeights, 3> heights;
  for (std::size_t i = 0; i < bench.meshes.size(); ++i) {
    const TestMesh& mesh = bench.meshes[i];
    heights[i] = is_fitted ? bench.fits[i].fit(wave) : wave_at_vertices(wave, mesh);
    trial.errors[i] = measure(mesh, wave, steepest, settings.phases, [&](const auto&, auto turn, const auto&) {
      return std::pair(std::vector<bool>(mesh.triangles.size(), true), imaginary(heights[i], turn));
    });
  }
  // From the heights that fit the consistent diagonals and, where heights are fitted, also from the wave's own; the
  // better end counts.
  const auto best = [&](const ErrorMeter& meter, std::complex<double> turn, const ComplexHeights& turned) {
    const auto descend = [&](const std::vector<double>& from) {
      return fit_diagonals(bench.both, meter.shapes(), turned, from, is_fitted);
    };
    DiagonalChoice choice = descend(imaginary(heights[kConsistent], turn));
    if (is_fitted) {
      DiagonalChoice second = descend(imaginary(turned, 1.0));
      if (second.square_error < choice.square_error) choice = std::move(second);
    }
    std::vector<bool> takes;
    for (std::size_t i = 0; i < bench.both.triangles.size(); ++i) takes.push_back(choice.takes(i));
    return std::pair(std::move(takes), std::move(choice.heights));
  };
  trial.errors[kBest] = measure(bench.both, wave, steepest, settings.phases, best);
  return trial;
}

}  // namespace

std::vector<double> frequencies_of(const ExperimentSettings& settings) {
  std::vector<double> frequencies;
  for (int i = 0; i < settings.frequency_count; i += settings.frequency_stride) {
    frequencies.push_back(kFirstFrequency + kFrequencyStep * i);
  }
  return frequencies;
}

ExperimentResult run_experiment(const ExperimentSettings& settings, const Job& job) {
  ExperimentResult result;
  result.settings = settings;
  std::vector<std::unique_ptr<Bench>> benches;
  std::vector<Task> tasks;
  for (const std::int64_t triangles : settings.triangles) {
    const Bench& bench = *benches.emplace_back(std::make_unique<Bench>(triangles));
    for (const double frequency : frequencies_of(settings)) {
      if (cycles_per_sample(frequency, triangles, settings.nyquist_triangles) > kNyquist) continue;
      for (int i = 0; i < settings.orientations / 2; ++i) tasks.push_back({&bench, frequency, i});
    }
  }
  result.trials.resize(tasks.size());
  std::mutex mutex;
  std::int64_t done = 0;
  Arena(job).execute([&] {
    oneapi::tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t i) {
      job.throw_if_cancelled();
      result.trials[i] = run_task(tasks[i], settings);
      const std::scoped_lock lock(mutex);
      job.report({"experiment", "orientations", ++done, static_cast<std::int64_t>(tasks.size())});
    });
  });
  return result;
}

Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles) {
  Errors mean = {};
  double count = 0.0;
  for (const Trial& trial : result.trials) {
    if (trial.triangles != triangles) continue;
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) mean[kind] += trial.errors[mesh][kind];
    ++count;
  }
  for (double& error : mean) error /= std::max(count, 1.0);
  return mean;
}

std::string figure2_csv(const ExperimentResult& result) {
  std::string csv = "triangles,mesh,mean_error,rms_error,normal_error_deg,shading_error,iso_to_this_shading\n";
  for (const std::int64_t triangles : result.settings.triangles) {
    const Errors iso = average_errors(result, kIso, triangles);
    for (std::size_t mesh = 0; mesh < kMeshKinds; ++mesh) {
      const Errors e = average_errors(result, static_cast<MeshKind>(mesh), triangles);
      csv += fmt::format("{},{},{:.6e},{:.6e},{:.6e},{:.6e},{:.4f}\n", triangles, kMeshNames[mesh], e[kMean], e[kRms],
                         e[kNormal] * kDegrees, e[kShading], iso[kShading] / e[kShading]);
    }
  }
  return csv;
}

std::string figure3_csv(const ExperimentResult& result) {
  std::string csv = "orientation_deg,iso,consistent,alternating,best\n";
  for (const double half_turn : {0.0, 180.0}) {
    for (const Trial& trial : result.trials) {
      if (trial.triangles != kFigure3Triangles || trial.frequency != frequencies_of(result.settings).back()) continue;
      csv += fmt::format("{:.2f}", half_turn + trial.angle_rad * kDegrees);
      for (const Errors& errors : trial.errors) csv += fmt::format(",{:.6e}", errors[kMean]);
      csv += "\n";
    }
  }
  return csv;
}

std::string figure8_csv() {
  const TileShape shape = TileShape::make(2564, 3075, 10);
  std::string csv = "level,strip_triangles,stitch_triangles,triangles\n";
  for (int level = 0; level < shape.levels(); ++level) {
    const std::int64_t strip = shape.strip_triangle_count(level);
    const std::int64_t stitch = shape.stitch_triangle_count(level);
    csv += fmt::format("{},{},{},{}\n", level, strip, stitch, strip + stitch);
  }
  return csv;
}

}  // namespace isohf::experiment
