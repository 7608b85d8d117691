/// isohf-experiment: section 2 of the paper, and its figures.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "experiment.h"
#include "figures.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "output/standard_output.h"
#include "program.h"

namespace isohf::cli {
namespace {

using experiment::ExperimentResult;
using experiment::ExperimentSettings;
using experiment::MeshKind;
using nlohmann::ordered_json;

constexpr const char* kFooter =
    R"(Fits meshes of equal triangle counts to 22,800 plane sine waves by least squares and measures what is left:
iso against square grids with consistent, alternating and best diagonals. Frequency 1 is half a cycle a sample
of the square grid of --nyquist-triangles; docs/experiment.md says more of units, and what came out.
The full set takes minutes, --quick seconds.

Examples:
  isohf experiment --quick
  isohf experiment -o figures
  isohf experiment --triangles 5000 --fit interpolate --json)";

struct ExperimentCommandOptions {
  CommonOptions common;
  WorkOptions work;
  bool quick = false;
  bool overwrite = false;
  std::string folder;
  std::vector<std::int64_t> triangles;
  std::int64_t nyquist_triangles = 5000;
  experiment::HeightRule heights = experiment::HeightRule::kLeastSquares;
  experiment::Light light;
};

std::vector<std::int64_t> parse_counts(const std::string& text) {
  std::vector<std::int64_t> counts;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const std::int64_t count = parse_whole_number(text.substr(from, to - from), 500, 1'000'000);
    if (!counts.empty() && count <= counts.back()) {
      throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be rising numbers: 1000,5000,10000");
    }
    counts.push_back(count);
    from = to + 1;
  }
  return counts;
}

std::optional<ExperimentCommandOptions> parse(const Arguments& arguments) {
  ExperimentCommandOptions options;
  CommandLine line("experiment", "Measures iso and ortho meshes against sine waves, as section 2 of the paper does.");
  line.group("Options");
  line.option("-o,--output", "DIR", "Write CSV and the paper's Figs. 2, 3 and 8 as SVG there (default: nothing)",
              options.folder);
  line.flag("--overwrite", "Replace files of DIR that exist", options.overwrite);
  line.flag("--quick", "A subset of the waves, in seconds", options.quick);
  line.option("--triangles", "N,...", "Triangle counts (default 1000,2000,5000,10000)",
              [&](const std::string& text) { options.triangles = parse_counts(text); });
  line.option("--nyquist-triangles", "N", "Triangles whose square grid has its Nyquist frequency at 1 (default 5000)",
              [&](const std::string& text) { options.nyquist_triangles = parse_whole_number(text, 500, 1'000'000); });
  line.option(
      "--fit", "RULE", "Heights: least-squares (default), or interpolate: the wave's own at the vertices",
      [&](const std::string& text) {
        options.heights = static_cast<experiment::HeightRule>(parse_word(text, {"least-squares", "interpolate"}));
      });
  line.option("--light", "AZ,EL",
              "A light that stands still: degrees clockwise from North, and above the ground (default: 45 high in the "
              "direction of each wave)",
              [&](const std::string& text) {
                const std::vector<double> angles = parse_numbers(text);
                if (angles.size() != 2 || !(angles[1] > 0.0 && angles[1] <= 90.0)) {
                  throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be AZ,EL with EL above 0 to 90");
                }
                options.light = {angles[0] * std::numbers::pi / 180.0, angles[1] * std::numbers::pi / 180.0};
              });
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  return options;
}

/// The files of an output folder: refused before the experiment, written after it.
class FigureFolder {
 public:
  FigureFolder(std::string folder, bool overwrite) : folder_(std::move(folder)), overwrite_(overwrite) {
    if (folder_.empty()) return;
    std::error_code failure;
    std::filesystem::create_directories(folder_, failure);
    if (failure) throw Error(ErrorCode::kIo, folder_ + ": cannot make the folder: " + failure.message());
    for (const char* name : kNames) {
      if (!overwrite && std::filesystem::exists(path(name), failure)) {
        throw Error(ErrorCode::kInvalidArgument, path(name) + ": exists; --overwrite replaces it");
      }
    }
  }

  /// Returns the paths that were written.
  std::vector<std::string> write(const ExperimentResult& result) const {
    if (folder_.empty()) return {};
    const TileShape huge = TileShape::make(2564, 3075, 10);
    const std::string texts[] = {
        experiment::trials_csv(result),  experiment::figure2_csv(result), experiment::figure2_svg(result),
        experiment::figure3_csv(result), experiment::figure3_svg(result), experiment::figure8_csv(huge),
        experiment::figure8_svg(huge),   experiment::azimuth_csv(result), experiment::azimuth_svg(result)};
    std::vector<std::string> written;
    for (std::size_t i = 0; i < std::size(kNames); ++i) {
      write_output(path(kNames[i]), texts[i], overwrite_);
      written.push_back(path(kNames[i]));
    }
    return written;
  }

 private:
  static constexpr const char* kNames[] = {"trials.csv", "fig2.csv", "fig2.svg",    "fig3.csv",   "fig3.svg",
                                           "fig8.csv",   "fig8.svg", "azimuth.csv", "azimuth.svg"};

  [[nodiscard]] std::string path(const char* name) const { return folder_ + "/" + name; }

  std::string folder_;
  bool overwrite_;
};

/// One line a triangle count and mesh: an error, and iso's divided by it.
struct ErrorColumn {
  const char* heading;
  double experiment::Errors::*error;
  double scale;
  int digits;
};
constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
constexpr ErrorColumn kColumns[] = {{"mean", &experiment::Errors::mean, 1.0, 6},
                                    {"rms", &experiment::Errors::rms, 1.0, 6},
                                    {"face normal", &experiment::Errors::normal_rad, kDegreesPerRadian, 4},
                                    {"shading", &experiment::Errors::shading, 1.0, 6},
                                    {"vertex normal", &experiment::Errors::vertex_normal_rad, kDegreesPerRadian, 4},
                                    {"shading", &experiment::Errors::vertex_shading, 1.0, 6},
                                    {"curvature", &experiment::Errors::defect_rad, kDegreesPerRadian, 4}};

std::string table_of(const ExperimentResult& result, bool as_ratio) {
  std::string text = fmt::format("{:>9} {:<12}", "triangles", "mesh");
  for (const ErrorColumn& column : kColumns) text += fmt::format(" {:>13}", column.heading);
  text += "\n";
  for (const std::int64_t triangles : result.settings.triangles) {
    const experiment::Errors iso = average_errors(result, MeshKind::kIso, triangles);
    for (const MeshKind kind : experiment::kMeshKinds) {
      if (as_ratio && kind == MeshKind::kIso) continue;
      const experiment::Errors e = average_errors(result, kind, triangles);
      text += fmt::format("{:>9} {:<12}", triangles, to_string(kind));
      for (const ErrorColumn& column : kColumns) {
        const double error = e.*column.error;
        text += as_ratio ? fmt::format(" {:>13.3f}", iso.*column.error / error)
                         : fmt::format(" {:>13.{}f}", column.scale * error, column.digits);
      }
      text += "\n";
    }
  }
  return text;
}

std::string summary_text(const ExperimentResult& result) {
  std::string text = fmt::format(
      "{} waves, {} triangle counts; {} pairs of them above the Nyquist frequency left out\n\nerrors, averaged\n",
      result.waves, result.settings.triangles.size(), result.left_out);
  text += table_of(result, false) + "\niso's error divided by the other mesh's\n" + table_of(result, true);
  const experiment::Figure3Case at = figure3_case(result);
  text +=
      fmt::format("\nFig. 3, {} triangles, frequency {:.2f}: iso's mean error is lower at", at.triangles, at.frequency);
  for (const MeshKind kind : experiment::kMeshKinds) {
    if (kind == MeshKind::kIso) continue;
    text += fmt::format(" {:.0f} % of orientations ({})",
                        100.0 * share_of_lower_orientations(result, kind, at.triangles, at.frequency), to_string(kind));
  }
  const experiment::Light& light = result.settings.light;
  text += fmt::format(
      "\nmean and rms in amplitudes, normals and curvature (angle defect of a vertex) in degrees\n"
      "shading: Lambert's law, by the normals before it, light {:.4g} degrees high {}\n",
      light.elevation_rad * kDegreesPerRadian,
      light.azimuth_rad ? fmt::format("at azimuth {:.4g}", *light.azimuth_rad * kDegreesPerRadian)
                        : "in the wave's direction");
  return text;
}

ordered_json summary_json(const ExperimentResult& result, const std::vector<std::string>& written) {
  ordered_json rows = ordered_json::array();
  for (const std::int64_t triangles : result.settings.triangles) {
    for (const MeshKind kind : experiment::kMeshKinds) {
      const experiment::Errors e = average_errors(result, kind, triangles);
      rows.push_back({{"triangles", triangles},
                      {"mesh", to_string(kind)},
                      {"mean", e.mean},
                      {"rms", e.rms},
                      {"normal_rad", e.normal_rad},
                      {"shading", e.shading},
                      {"vertex_normal_rad", e.vertex_normal_rad},
                      {"vertex_shading", e.vertex_shading},
                      {"angle_defect_rad", e.defect_rad},
                      {"shading_by_azimuth", e.azimuth_shading}});
    }
  }
  const experiment::Figure3Case at = figure3_case(result);
  ordered_json lower = ordered_json::object();
  for (const MeshKind kind : experiment::kMeshKinds) {
    if (kind != MeshKind::kIso) {
      lower[to_string(kind)] = share_of_lower_orientations(result, kind, at.triangles, at.frequency);
    }
  }
  return {{"waves", result.waves},
          {"phases", result.settings.phases},
          {"orientations", result.settings.orientations},
          {"frequencies", frequencies_of(result.settings)},
          {"nyquist_triangles", result.settings.nyquist_triangles},
          {"left_out", result.left_out},
          {"averages", rows},
          {"figure3",
           {{"triangles", at.triangles}, {"frequency", at.frequency}, {"share_of_orientations_iso_is_lower", lower}}},
          {"files", written}};
}

int run(const ExperimentCommandOptions& options) {
  const FigureFolder folder(options.folder, options.overwrite);
  ExperimentSettings settings = options.quick ? ExperimentSettings::quick() : ExperimentSettings();
  if (!options.triangles.empty()) settings.triangles = options.triangles;
  settings.nyquist_triangles = options.nyquist_triangles;
  settings.heights = options.heights;
  settings.light = options.light;
  ExperimentResult result;
  {
    ProgressDisplay display(options.work.progress, options.common.quiet, options.common.verbose);
    result = run_experiment(settings, job_from(options.work, display));
  }
  const std::vector<std::string> written = folder.write(result);
  StandardOutput out;
  if (options.common.json) {
    out.write(summary_json(result, written).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n");
  } else if (!options.common.quiet) {
    out.write(summary_text(result));
    for (const std::string& path : written) out.write("wrote " + path + "\n");
  }
  out.finish();
  return kExitDone;
}

int experiment(const Arguments& arguments) {
  const std::optional<ExperimentCommandOptions> options = parse(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace
}  // namespace isohf::cli

int main(int argc, char** argv) {
  return isohf::cli::run_program("isohf", argc, argv, isohf::cli::experiment);
}
