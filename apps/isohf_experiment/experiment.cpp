#include "experiment.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <utility>

#include "height_fit.h"
#include "isohf/base/arena.h"
#include "isohf/error.h"
#include "reconstruction_error.h"
#include "sine_wave.h"
#include "test_mesh.h"

namespace isohf::experiment {
namespace {

constexpr double kFirstFrequency = 0.01;
constexpr double kFrequencyStep = 0.05;
constexpr int kMostFrequencies = 20;
constexpr double kNyquist = 0.5;  // cycles per sample

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
        both(make_ortho_mesh(count, Diagonals::kBoth)),
        diagonal_fit(both) {}

  std::int64_t triangles;
  std::array<TestMesh, 3> meshes;  ///< by MeshKind
  std::array<HeightFit, 3> fits;
  TestMesh both;
  DiagonalFit diagonal_fit;
};

/// Errors of one trial, phase by phase.
class PhaseErrors {
 public:
  void add(const ErrorSums& sums) {
    sums_ += sums;
    const double mean = sums.elevation / sums.area;
    least_ = count_ == 0 ? mean : std::min(least_, mean);
    most_ = std::max(most_, mean);
    ++count_;
  }
  [[nodiscard]] Errors average() const {
    Errors errors = {sums_.elevation / sums_.area,         std::sqrt(sums_.elevation_squared / sums_.area),
                     sums_.normal_rad / sums_.area,        sums_.shading / sums_.area,
                     sums_.vertex_normal_rad / sums_.area, sums_.vertex_shading / sums_.area,
                     sums_.defect_rad / sums_.vertices};
    for (std::size_t i = 0; i < kAzimuths; ++i) errors.azimuth_shading[i] = sums_.azimuth_shading[i] / sums_.area;
    return errors;
  }
  [[nodiscard]] double spread() const { return (most_ - least_) / average().mean; }

 private:
  ErrorSums sums_;
  double least_ = 0.0;
  double most_ = 0.0;
  int count_ = 0;
};

std::vector<double> phases_of(const ExperimentSettings& settings) {
  std::vector<double> phases;
  for (int i = 0; i < settings.phases; ++i) phases.push_back(std::numbers::pi * i / settings.phases);
  return phases;
}

PhaseErrors measure_fixed_mesh(const TestMesh& mesh, const ComplexHeights& fitted, const SineWave& wave,
                               double steepest, const ExperimentSettings& settings) {
  const ErrorMeter meter(mesh, wave, steepest, settings.light);
  const ComplexHeights exact = wave_at_vertices(wave, mesh);
  const std::vector<bool> all(mesh.triangles.size(), true);
  std::vector<double> heights(fitted.size());
  PhaseErrors errors;
  for (const double phase : phases_of(settings)) {
    const std::complex<double> turn = std::polar(1.0, phase);
    for (std::size_t i = 0; i < fitted.size(); ++i) heights[i] = (turn * fitted[i]).imag();
    ErrorSums sums;
    meter.add(all, turn, exact, heights, sums);
    errors.add(sums);
  }
  return errors;
}

/// From the heights that fit the consistent diagonals and, where heights are fitted, also from the wave's own; the
/// better end counts.
PhaseErrors measure_best_diagonals(const Bench& bench, const ComplexHeights& start, const SineWave& wave,
                                   double steepest, const ExperimentSettings& settings) {
  const TestMesh& mesh = bench.both;
  const ErrorMeter meter(mesh, wave, steepest, settings.light);
  const ComplexHeights exact = wave_at_vertices(wave, mesh);
  const bool is_fitted = settings.heights == HeightRule::kLeastSquares;
  PhaseErrors errors;
  for (const double phase : phases_of(settings)) {
    const std::complex<double> turn = std::polar(1.0, phase);
    const auto descend = [&](const ComplexHeights& from) {
      std::vector<double> heights;
      for (const std::complex<double>& y : from) heights.push_back((turn * y).imag());
      return bench.diagonal_fit.fit(meter.shapes(), exact, phase, std::move(heights), is_fitted);
    };
    DiagonalChoice choice = descend(start);
    if (is_fitted) {
      DiagonalChoice second = descend(exact);
      if (second.square_error < choice.square_error) choice = std::move(second);
    }
    std::vector<bool> takes(mesh.triangles.size());
    for (std::size_t i = 0; i < takes.size(); ++i) takes[i] = ((i / 2) % 2 != 0) == choice.takes_other[i / 4];
    ErrorSums sums;
    meter.add(takes, turn, exact, choice.heights, sums);
    errors.add(sums);
  }
  return errors;
}

/// One orientation and frequency on one Bench: four trials.
struct Task {
  const Bench* bench;
  double frequency;
  int orientation;
};

void run_task(const Task& task, const ExperimentSettings& settings, Trial* out) {
  const Bench& bench = *task.bench;
  const double angle_rad = 2.0 * std::numbers::pi * task.orientation / settings.orientations;
  const SineWave wave = {angle_rad, cycles_per_sample(task.frequency, bench.triangles, settings.nyquist_triangles)};
  const double steepest = task.frequency;  // one amplitude for all, 45 degrees at frequency 1
  const auto put = [&](MeshKind kind, std::size_t mesh_triangles, const PhaseErrors& errors) {
    out[static_cast<int>(kind)] = {kind,           bench.triangles,        static_cast<std::int64_t>(mesh_triangles),
                                   task.frequency, wave.cycles_per_sample, task.orientation,
                                   angle_rad,      errors.average(),       errors.spread()};
  };
  for (std::size_t i = 0; i < bench.meshes.size(); ++i) {
    const TestMesh& mesh = bench.meshes[i];
    const ComplexHeights heights =
        settings.heights == HeightRule::kLeastSquares ? bench.fits[i].fit(wave) : wave_at_vertices(wave, mesh);
    const auto kind = static_cast<MeshKind>(i);
    put(kind, mesh.triangles.size(), measure_fixed_mesh(mesh, heights, wave, steepest, settings));
    if (kind == MeshKind::kOrthoConsistent) {
      put(MeshKind::kOrthoBest, mesh.triangles.size(),
          measure_best_diagonals(bench, heights, wave, steepest, settings));
    }
  }
}

void require(const ExperimentSettings& settings) {
  const auto within = [](const char* what, std::int64_t found, std::int64_t least, std::int64_t most) {
    if (found >= least && found <= most) return;
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("experiment: found {} {}, must be {} to {}", found, what, least, most));
  };
  within("phases", settings.phases, 1, 360);
  within("orientations", settings.orientations, 2, 3600);
  if (settings.orientations % 2 != 0) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("experiment: found {} orientations, must be even", settings.orientations));
  }
  within("frequencies", settings.frequency_count, 1, kMostFrequencies);
  within("as stride of the frequencies", settings.frequency_stride, 1, kMostFrequencies);
  within("triangles at frequency 1", settings.nyquist_triangles, 1, 1'000'000'000);
  within("triangle counts", static_cast<std::int64_t>(settings.triangles.size()), 1, 1000);
}

}  // namespace

const char* to_string(MeshKind kind) {
  switch (kind) {
    case MeshKind::kIso:
      return "iso";
    case MeshKind::kOrthoConsistent:
      return "consistent";
    case MeshKind::kOrthoAlternating:
      return "alternating";
    case MeshKind::kOrthoBest:
      return "best";
  }
  return "?";
}

ExperimentSettings ExperimentSettings::quick() {
  ExperimentSettings settings;
  settings.phases = 6;
  settings.orientations = 40;
  settings.frequency_stride = 3;
  return settings;
}

std::vector<double> frequencies_of(const ExperimentSettings& settings) {
  std::vector<double> frequencies;
  for (int i = 0; i < settings.frequency_count; i += settings.frequency_stride) {
    frequencies.push_back(kFirstFrequency + kFrequencyStep * i);
  }
  return frequencies;
}

ExperimentResult run_experiment(const ExperimentSettings& settings, const Job& job) {
  require(settings);
  ExperimentResult result;
  result.settings = settings;
  const std::vector<double> frequencies = frequencies_of(settings);
  const auto waves_of_a_frequency = std::int64_t{settings.phases} * settings.orientations;
  result.waves = waves_of_a_frequency * static_cast<std::int64_t>(frequencies.size());

  std::vector<std::unique_ptr<Bench>> benches;
  std::vector<Task> tasks;
  for (const std::int64_t triangles : settings.triangles) {
    benches.push_back(std::make_unique<Bench>(triangles));
    for (const double frequency : frequencies) {
      if (cycles_per_sample(frequency, triangles, settings.nyquist_triangles) > kNyquist) {
        result.left_out += waves_of_a_frequency;
        continue;
      }
      for (int i = 0; i < settings.orientations / 2; ++i) tasks.push_back({benches.back().get(), frequency, i});
    }
  }

  result.trials.resize(tasks.size() * kMeshKinds.size());
  std::mutex mutex;
  std::int64_t done = 0;
  Arena(job).execute([&] {
    oneapi::tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t i) {
      job.throw_if_cancelled();
      run_task(tasks[i], settings, &result.trials[i * kMeshKinds.size()]);
      const std::scoped_lock lock(mutex);
      job.report({"experiment", "orientations", ++done, static_cast<std::int64_t>(tasks.size())});
    });
  });
  return result;
}

namespace {

template <typename Change>
void for_each_error(Errors& left, const Errors& right, Change change) {
  for (double Errors::*member : {&Errors::mean, &Errors::rms, &Errors::normal_rad, &Errors::shading,
                                 &Errors::vertex_normal_rad, &Errors::vertex_shading, &Errors::defect_rad}) {
    change(left.*member, right.*member);
  }
  for (std::size_t i = 0; i < kAzimuths; ++i) change(left.azimuth_shading[i], right.azimuth_shading[i]);
}

template <typename Accepts>
Errors average_of(const ExperimentResult& result, Accepts accepts) {
  Errors sum;
  int count = 0;
  for (const Trial& trial : result.trials) {
    if (!accepts(trial)) continue;
    for_each_error(sum, trial.errors, [](double& total, double error) { total += error; });
    ++count;
  }
  const double n = std::max(count, 1);
  for_each_error(sum, sum, [n](double& total, double) { total /= n; });
  return sum;
}

}  // namespace

Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles) {
  return average_of(result, [&](const Trial& trial) { return trial.mesh == mesh && trial.triangles == triangles; });
}

Errors average_errors(const ExperimentResult& result, MeshKind mesh, std::int64_t triangles, double frequency) {
  return average_of(result, [&](const Trial& trial) {
    return trial.mesh == mesh && trial.triangles == triangles && trial.frequency == frequency;
  });
}

}  // namespace isohf::experiment
