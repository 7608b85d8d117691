/// isohf-experiment: section 2 of the paper, and the same question asked of real rasters.

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>

#include "experiment.h"
#include "isohf/base/arena.h"
#include "isohf/base/output_file.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/verify.h"
#include "options/command_line.h"
#include "options/work_options.h"
#include "output/standard_output.h"
#include "program.h"
#include "raster_meshes.h"

namespace isohf::cli {
namespace {

constexpr const char* kExperimentFooter =
    R"(Without --waves, archives of every RASTER are made, at three densities and by three filters, and compared with
meshes of squares: one line of CSV each, and at the end on how many the archive errs less. docs/accuracy.md says more.
--waves fits meshes of equal triangle counts to 22,800 plane sine waves by least squares and writes what is left, the
numbers of the paper's Figs. 2, 3 and 8: minutes, --quick seconds. docs/experiment.md says more.

Examples:
  isohf-experiment dem.tif other.tif
  isohf-experiment --waves figures --quick)";

/// CSV of one raster; `lower` and `all` count archives.
std::string compare_raster(const std::string& path, const std::string& archive, const Job& job, int& lower, int& all) {
  std::string csv;
  for (const double density : {1.0, 0.25, 0.0625}) {
    for (const Filter filter : {Filter::kLimitedCubic, Filter::kBilinear, Filter::kBspline3}) {
      const std::unique_ptr<HeightSource> source = open_raster(path, {});
      ConvertOptions options;
      options.plan.density = density;
      options.filter = filter;
      options.overwrite = true;
      understand_ground(source->info(), options.plan.ground);
      (void)convert(*source, archive, options, job);
      const ArchiveReader reader(archive);
      const double rms = compare_with_source(reader, *source, job).rms;
      std::optional<experiment::RasterComparison> found;
      Arena(job).execute([&] { found = experiment::compare_with_squares(reader, *source, rms); });
      const experiment::SquareErrors& squares = found->squares;
      csv +=
          fmt::format("{},{},{},{},{:.6g},{:.6g},{:.3f},{:.3f},{:.3f},{:.3f},{}\n",
                      std::filesystem::path(path).filename().string(), density, to_string(filter), found->triangles,
                      rms, squares.one_diagonal, rms / squares.one_diagonal, found->regular_rms / squares.one_diagonal,
                      found->regular_rms / squares.least_curvature, found->regular_rms / squares.best,
                      found->triangles_of_equal_rms ? fmt::format("{:.3f}", *found->triangles_of_equal_rms) : "");
      ++all;
      lower += rms < squares.one_diagonal ? 1 : 0;
    }
  }
  return csv;
}

struct Options {
  const Common& common;
  WorkOptions work{};
  std::vector<std::string> rasters{};
  std::string folder{};
  bool quick = false;
  bool interpolate = false;
};

void measure_waves(const Options& options, const Job& job) {
  experiment::ExperimentSettings settings{.interpolate = options.interpolate};
  if (options.quick) settings.phases = 6, settings.orientations = 40, settings.frequency_stride = 3;
  const std::string& folder = options.folder;
  std::filesystem::create_directories(folder);
  const experiment::ExperimentResult result = run_experiment(settings, job);
  write_output(folder + "/fig2.csv", figure2_csv(result), true);
  write_output(folder + "/fig3.csv", figure3_csv(result), true);
  write_output(folder + "/fig8.csv", experiment::figure8_csv(), true);
}

void compare_rasters(const Options& options, const Job& job) {
  std::string place = (std::filesystem::temp_directory_path() / "isohf-experiment-XXXXXX").string();
  if (::mkdtemp(place.data()) == nullptr) throw Error(ErrorCode::kIo, place + ": cannot make the folder");
  int lower = 0;
  int all = 0;
  StandardOutput out(options.common);
  out.write(
      "raster,density,filter,triangles,rms,squares_rms,ratio,one_diagonal,least_curvature,best,triangles_at_equal_"
      "rms\n");
  for (const std::string& raster : options.rasters)
    out.write(compare_raster(raster, place + "/a.isohf", job, lower, all));
  out.write(fmt::format("the archive errs less than squares in {} of {}\n", lower, all));
  out.finish();
  std::filesystem::remove_all(place);
}

int run(const Options& options) {
  if (options.folder.empty() == options.rasters.empty())
    throw Error(ErrorCode::kInvalidArgument, "give RASTER..., or --waves DIR");
  ProgressDisplay display(options.common, options.work.progress);
  const Job job = job_from(options.work, display);
  options.folder.empty() ? compare_rasters(options, job) : measure_waves(options, job);
  return kExitDone;
}

Run add_experiment(CLI::App& line, Common& common) {
  const auto options = std::make_shared<Options>(Options{common});
  positionals(line, "RASTER...", "Rasters to compare meshes on", options->rasters);
  option(line, "--waves", "DIR", "Measure sine waves, and write fig2.csv, fig3.csv and fig8.csv there",
         options->folder);
  line.add_flag("--quick", options->quick, "A subset of the waves, in seconds");
  line.add_flag("--interpolate", options->interpolate, "Heights are the wave's own at the vertices, not fitted");
  add_work_options(line, options->work, common);
  line.footer(kExperimentFooter);
  return [options] { return run(*options); };
}

constexpr Command kCommands[] = {{"experiment", "Measure iso and ortho meshes", "", add_experiment}};
constexpr Program kProgram = {"isohf-experiment",
                              "Measures iso and ortho meshes on rasters, or on sine waves as section 2 of the paper.",
                              "", kCommands};

}  // namespace
}  // namespace isohf::cli

int main(int argc, char** argv) {
  return isohf::cli::run_main(isohf::cli::kProgram, argc, argv);
}
