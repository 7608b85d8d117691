#include "experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "isohf/error.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::experiment {
namespace {

using testing::HasSubstr;

ExperimentSettings small_settings() {
  ExperimentSettings settings{.triangles = {1000, 2000}, .phases = 3, .orientations = 6, .frequency_stride = 6};
  return settings;
}

TEST(Experiment, HasThePapersNumberOfWaves) {
  const ExperimentSettings settings;
  const std::vector<double> frequencies = frequencies_of(settings);
  EXPECT_EQ(settings.phases * settings.orientations * static_cast<int>(frequencies.size()), 22800);
  EXPECT_NEAR(frequencies.front(), 0.01, 1e-12);
  EXPECT_NEAR(frequencies.back(), 0.91, 1e-12);
}

TEST(Experiment, ResultDoesNotDependOnThreadsAndLeavesOutWavesAboveTheNyquistFrequency) {
  const ExperimentResult result = run_experiment(small_settings(), {.threads = 1});
  EXPECT_EQ(figure2_csv(run_experiment(small_settings(), {.threads = 3})), figure2_csv(result));
  // 0.01, 0.31, 0.61, 0.91 against √(1000/5000) = 0.447 and √(2000/5000) = 0.632: two and three are left.
  EXPECT_EQ(result.trials.size(), std::size_t{(2 + 3) * 3});
}

TEST(Experiment, StopsWhenAsked) {
  const std::atomic<bool> cancel = true;
  try {
    (void)run_experiment(small_settings(), {.cancel = &cancel});
    ADD_FAILURE() << "ran to its end";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

/// One mesh of 2000 triangles and waves that lie along one direction, heights interpolated.
Errors along(MeshKind mesh, double cycles_per_sample) {
  ExperimentSettings settings{.triangles = {2000},
                              .phases = 4,
                              .orientations = 20,
                              .frequency_count = 1,
                              .nyquist_triangles = std::lround(2000.0 * std::pow(cycles_per_sample / 0.005, 2)),
                              .interpolate = true};
  return run_experiment(settings).trials[1].errors[mesh];
}

// Both waves have one slope. A face errs by the curvature across it.
TEST(ErrorMeter, FaceNormalsErrByTheWaveNumber) {
  for (const MeshKind mesh : {kIso, kConsistent}) {
    EXPECT_NEAR(along(mesh, 0.04)[kNormal] / along(mesh, 0.02)[kNormal] / 2.0, 1.0, 0.05) << kMeshNames[mesh];
  }
}

// Fig. 8: strips fall fourfold a level, stitches grow, and from level 5 on little is saved (section 3.5).
TEST(Figures, Figure8ShowsThePointOfDiminishingReturns) {
  const std::string csv = figure8_csv();
  EXPECT_THAT(csv, HasSubstr("\n0,15731712,0,15731712\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 11);
}

// The ground is a raster of the test data, on which the archive is known to err less.
TEST(ExperimentProgram, ComparesARasterWithMeshesOfSquares) {
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  const test::RunResult result = test::run_program({ISOHF_BIN_DIR "/isohf-experiment", raster, "-q"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("coast_512x384_int16.tif,1,limited-cubic,"));
  EXPECT_THAT(result.out, HasSubstr("\nthe archive errs less than squares in 9 of 9\n"));
  EXPECT_EQ(test::run_program({ISOHF_BIN_DIR "/isohf-experiment"}).exit_code, 2);
}

}  // namespace
}  // namespace isohf::experiment
