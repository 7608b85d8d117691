#include "experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "figures.h"
#include "isohf/error.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::experiment {
namespace {

using testing::HasSubstr;

ExperimentSettings small_settings() {
  ExperimentSettings settings;
  settings.triangles = {1000, 2000};
  settings.phases = 3;
  settings.orientations = 6;
  settings.frequency_stride = 6;
  return settings;
}

TEST(Experiment, HasThePapersNumberOfWaves) {
  const ExperimentSettings settings;
  const std::vector<double> frequencies = frequencies_of(settings);
  EXPECT_EQ(settings.phases * settings.orientations * static_cast<int>(frequencies.size()), 22800);
  EXPECT_NEAR(frequencies.front(), 0.01, 1e-12);
  EXPECT_NEAR(frequencies.back(), 0.91, 1e-12);
}

TEST(Experiment, ResultDoesNotDependOnThreads) {
  const std::string one = trials_csv(run_experiment(small_settings(), {.threads = 1}));
  EXPECT_EQ(trials_csv(run_experiment(small_settings(), {.threads = 3})), one);
}

TEST(Experiment, LeavesOutWavesAboveTheNyquistFrequency) {
  const ExperimentResult result = run_experiment(small_settings());
  for (const Trial& t : result.trials) EXPECT_LE(t.cycles_per_sample, 0.5);
  // 0.01, 0.31, 0.61, 0.91 against √(1000/5000) = 0.447 and √(2000/5000) = 0.632: two and one are left out.
  EXPECT_EQ(result.left_out, 3 * 3 * 6);
  EXPECT_EQ(result.trials.size(), std::size_t{(2 + 3) * 3 * 4});
  EXPECT_EQ(result.waves, 3 * 6 * 4);
}

TEST(Experiment, RefusesSettingsOutOfRangeAndStopsWhenAsked) {
  ExperimentSettings settings = small_settings();
  settings.orientations = 5;
  EXPECT_THROW((void)run_experiment(settings), Error);
  settings = small_settings();
  settings.triangles = {};
  EXPECT_THROW((void)run_experiment(settings), Error);
  const std::atomic<bool> cancel = true;
  try {
    (void)run_experiment(small_settings(), {.cancel = &cancel});
    ADD_FAILURE() << "ran to its end";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

/// Averages of one mesh of 2000 triangles over waves that lie along one direction, heights interpolated.
Errors along(MeshKind mesh, double cycles_per_sample, int orientation, int of, Light light = {}) {
  ExperimentSettings settings;
  settings.triangles = {2000};
  settings.phases = 4;
  settings.orientations = of;
  settings.frequency_count = 1;
  settings.heights = HeightRule::kInterpolate;
  settings.light = light;
  settings.nyquist_triangles = std::lround(2000.0 * std::pow(cycles_per_sample / 0.005, 2));
  for (const Trial& t : run_experiment(settings).trials) {
    if (t.mesh == mesh && t.orientation == orientation) return t.errors;
  }
  return {};
}

// Both waves have one slope. A face errs by the curvature across it, a vertex by the change of curvature.
TEST(ErrorMeter, FaceNormalsErrByTheWaveNumberAndVertexNormalsByItsSquare) {
  for (const MeshKind mesh : {MeshKind::kIso, MeshKind::kOrthoConsistent}) {
    const Errors longer = along(mesh, 0.02, 1, 20);
    const Errors shorter = along(mesh, 0.04, 1, 20);
    EXPECT_NEAR(shorter.normal_rad / longer.normal_rad / 2.0, 1.0, 0.05) << to_string(mesh);
    EXPECT_NEAR(shorter.vertex_normal_rad / longer.vertex_normal_rad / 4.0, 1.0, 0.05) << to_string(mesh);
  }
}

// A sheet that is only folded has no Gaussian curvature: crests along the rows of iso, or along the diagonals of ortho.
TEST(ErrorMeter, FoldedSheetsHaveNoAngleDefect) {
  EXPECT_LT(along(MeshKind::kIso, 0.1, 2, 8).defect_rad, 1e-12);
  EXPECT_LT(along(MeshKind::kOrthoConsistent, 0.1, 3, 8).defect_rad, 1e-12);
  EXPECT_GT(along(MeshKind::kIso, 0.1, 1, 8).defect_rad, 1e-8);
  EXPECT_GT(along(MeshKind::kOrthoConsistent, 0.1, 1, 8).defect_rad, 1e-8);
}

TEST(ErrorMeter, ALightOverheadHasNoAzimuthAndAFixedOneCountsWithItsOpposite) {
  const double right_angle = std::acos(0.0);
  const Errors noon = along(MeshKind::kIso, 0.1, 1, 8, {0.3, right_angle});
  for (const double shading : noon.azimuth_shading) EXPECT_NEAR(shading, noon.vertex_shading, 1e-12);
  const Errors east = along(MeshKind::kIso, 0.1, 1, 8, {right_angle, 0.5});
  const Errors west = along(MeshKind::kIso, 0.1, 1, 8, {3.0 * right_angle, 0.5});
  EXPECT_NEAR(east.vertex_shading, west.vertex_shading, 1e-12);
  EXPECT_NEAR(east.vertex_shading, east.azimuth_shading[kAzimuths / 2], 1e-12);
  EXPECT_NE(east.vertex_shading, east.azimuth_shading[0]);
}

// Fig. 8: strips fall fourfold a level, stitches grow, and from level 5 on little is saved (section 3.5).
TEST(Figures, Figure8ShowsThePointOfDiminishingReturns) {
  const std::string csv = figure8_csv(TileShape::make(2564, 3075, 10));
  EXPECT_THAT(csv, HasSubstr("\n0,15731712,0,15731712\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 11);
}

}  // namespace
}  // namespace isohf::experiment

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(ExperimentCommand, WritesItsFilesAndRefusesToReplaceThem) {
  const TemporaryFolder folder;
  const std::vector<std::string> command = {"experiment", "--quick", "--triangles",     "500",
                                            "--json",     "-o",      folder / "figures"};
  const RunResult result = run_isohf(command);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const json document = json::parse(result.out);
  EXPECT_EQ(document.at("averages").size(), 4U);
  EXPECT_EQ(document.at("files").size(), 9U);
  for (const json& path : document.at("files")) EXPECT_GT(std::filesystem::file_size(path.get<std::string>()), 50U);
  const RunResult again = run_isohf(command);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("exists; --overwrite replaces it"));
}

TEST(ExperimentCommand, RefusesBadLists) {
  for (const char* list : {"", "100", "5000,1000", "1000,", "1000,x"}) {
    EXPECT_EQ(run_isohf({"experiment", "--triangles", list}).exit_code, 2) << list;
  }
}

}  // namespace
}  // namespace isohf::test
