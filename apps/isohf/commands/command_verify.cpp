/// isohf verify: is an archive whole, and how far is it from what it was made from?

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/georeference/reference_system.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "input/source_inputs.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "isohf/verify/accuracy/same_source.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kVerifyFooter =
    R"(Each finding is one line: its number, its severity, where, what. Exit code 0: nothing above a note was found;
3: something was, or the surface is further from INPUT than allowed; 1: the check itself failed.
The input is read as the archive says that it was read.

Examples:
  isohf verify dem.isohf
  isohf verify archives/ --json       one JSON object a line
  isohf verify dem.isohf --against dem.tif --max-error 5)";

struct VerifyCommandOptions {
  const Common& common;
  WorkOptions work{};
  std::vector<std::string> archives{};
  std::string archive{};  ///< the one in hand
  std::vector<std::string> against{};
  GeoidRequest geoid{};
  std::optional<double> max_error{};
  std::optional<double> max_rms{};
};

const char* to_word(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      return "warning";
    case Severity::kError:
      return "error";
  }
  return "?";
}

ordered_json checks_of(const VerifyReport& report) {
  ordered_json findings = ordered_json::array();
  for (const Finding& finding : report.findings) {
    ordered_json json = {{"id", finding_name(finding.id)}, {"severity", to_word(finding.severity)}};
    json["tile"] = finding.tile ? ordered_json{{"column", finding.tile->column}, {"row", finding.tile->row}}
                                : ordered_json(nullptr);
    json["text"] = spelled(finding.text);
    findings.push_back(std::move(json));
  }
  return {{"passed", report.passed()},
          {"tiles_checked", report.tiles_checked},
          {"shared_vertices_checked", report.shared_vertices_checked},
          {"findings_total", report.findings_total},
          {"findings", findings}};
}

std::string text_from(const Finding& finding) {
  std::string text = finding_name(finding.id) + " " + to_word(finding.severity);
  if (finding.tile) text += fmt::format(" tile ({},{})", finding.tile->column, finding.tile->row);
  return text + ": " + printable(spelled(finding.text)) + "\n";
}

/// What the comparison found beside errors of size: ground that is missing or made up, away from borders of voids.
void add_findings(const Accuracy& measured, const std::string& contradiction, VerifyReport& report) {
  const AccuracyReport& accuracy = measured.surface;
  const VertexReport& vertices = measured.vertices;
  const auto add = [&](int id, std::int64_t count, const std::string& what, std::optional<TileIndex> tile = {}) {
    if (count == 0) return;
    report.findings.push_back({id, severity_of(id), tile, fmt::format("{} {}", describe_count(count), what)});
    ++report.findings_total;
  };
  add(finding::kVertex, vertices.wrong,
      fmt::format("vertices, from this tile on, differ from the input resampled, by up to {:.6g} where {:.6g} is "
                  "allowed, or in being void",
                  vertices.worst, vertices.bound),
      vertices.first_wrong);
  if (!contradiction.empty()) {
    report.findings.push_back({finding::kAccuracy, severity_of(finding::kAccuracy), {}, contradiction});
    ++report.findings_total;
  }
  add(finding::kSourceLost, accuracy.lost_inside, "elevations of the input lie where the archive has none");
  add(finding::kSourceInvented, accuracy.invented_inside, "voids of the input lie where the archive has elevations");
}

/// The geoid of an archive's record, beside the inputs or in the working folder.
void find_geoid(const std::string& archive, const std::vector<std::string>& files, GeoidRequest& geoid) {
  const std::string name = geoid.path;
  for (const std::string& path : {(std::filesystem::path(files.front()).parent_path() / name).string(), name}) {
    std::error_code ignored;
    geoid.path = path;
    if (std::filesystem::exists(path, ignored)) return;
  }
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: was made with --geoid {}, which lies neither beside the input nor in this folder; give "
                          "--geoid FILE",
                          archive, name));
}

/// The archive's input, read as it was read then.
std::unique_ptr<HeightSource> open_as_recorded(const VerifyCommandOptions& options, const Metadata& metadata) {
  const SourceRecord& record = metadata.source;
  const std::vector<std::string> files = expand_inputs(options.against, false);
  const RecordedOptions recorded = record.options.value_or(RecordedOptions{});
  RecordedInput input = [&] {
    try {
      return recorded_input(recorded);
    } catch (const Error& error) {
      throw error.within(options.archive);
    }
  }();
  input.open.unpacked_bytes = options.work.unpacked_bytes(input.open.unpacked_bytes);
  if (!options.geoid.path.empty()) {
    input.geoid = options.geoid;
  } else if (!input.geoid.path.empty()) {
    find_geoid(options.archive, files, input.geoid);
  }
  if (!input.open.registration) input.open.registration = record.registration;
  // Inputs of different reference systems were joined in that of the record.
  if (const std::string system = system_text(source_georeference(record).system); record.mosaic && !system.empty()) {
    ProjectionRequest& onto = input.inputs.onto;
    onto.is_auto = false;
    onto.is_given = true;
    onto.kind = ProjectionKind::kSystem;
    onto.system = system;
  }
  GroundRequest ground;
  const auto open = [&] {
    OpenedInputs opened = open_inputs(files, input.inputs, input.open, options.work);
    const bool repeats_column = record.repeats_column && opened.source->info().width == record.width + 1;
    ground.wrap = metadata.wraps_x || repeats_column ? Wrap::kAlways : Wrap::kNever;
    return laid_out(std::move(opened.source), input.geoid, ground, true);
  };
  const auto is_scaled_alike = [&](const HeightSource& source) {
    return source.info().z_scale == record.z_scale && source.info().z_offset == record.z_offset;
  };
  try {
    std::unique_ptr<HeightSource> source = open();
    if (!(input.open.z_scale || input.open.z_offset) || is_scaled_alike(*source)) return source;
    // What export wrote states the scale with these options in it.
    input.open.z_scale.reset();
    input.open.z_offset.reset();
    std::unique_ptr<HeightSource> exported = open();
    if (is_scaled_alike(*exported)) return exported;
    return source;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kInvalidArgument || input.open.reference_system.empty()) throw;
    throw error.within(options.archive + ": was made with --crs");
  }
}

/// What of the measured error is more than was allowed; empty where nothing is.
std::string why_too_far(const VerifyCommandOptions& options, const AccuracyReport& accuracy) {
  if (options.max_error && accuracy.max > *options.max_error) {
    return fmt::format("the largest error is {:.6g}, at most {:.6g} is allowed", accuracy.max, *options.max_error);
  }
  if (options.max_rms && accuracy.rms > *options.max_rms) {
    return fmt::format("the rms error is {:.6g}, at most {:.6g} is allowed", accuracy.rms, *options.max_rms);
  }
  return {};
}

int check_one(const VerifyCommandOptions& options, bool is_one_of_many) {
  std::optional<ProgressDisplay> display(std::in_place, options.common, options.work.progress);
  const Job job = job_from(options.work, *display);
  VerifyReport report = verify_archive(options.archive, job);
  if (!report.findings.empty() && report.findings.front().id == finding::kNotReadable) {
    if (const std::string what = what_else(options.archive); !what.empty()) {
      report.findings.front().text = options.archive + ": " + what;
    }
  }
  std::optional<Accuracy> accuracy;
  // An archive that is not whole has no surface to measure.
  const bool compares = !options.against.empty() && report.passed();
  if (compares) {
    const ArchiveReader archive = open_archive(options.archive);
    const Metadata& metadata = archive.metadata();
    const std::unique_ptr<HeightSource> source = open_as_recorded(options, metadata);
    const SourceInfo& info = source->info();
    const auto same_system = are_same(source_georeference(metadata.source).system, info.georeference.system);
    for (const Warning& warning : check_same_source(archive, info, same_system)) {
      display->clear();
      print_warning(options.common, warning);
    }
    accuracy = measure_accuracy(options.archive, *source, job);
    add_findings(*accuracy, contradiction(metadata, accuracy->surface), report);
  }
  display.reset();
  const std::string too_far = accuracy ? why_too_far(options, accuracy->surface) : "";
  const bool passed = report.passed() && too_far.empty();

  StandardOutput out(options.common);
  if (options.common.json) {
    ordered_json document = {{"archive", options.archive}, {"passed", passed}, {"checks", checks_of(report)}};
    if (accuracy) document["against"] = json_from(*accuracy);
    if (!too_far.empty()) document["difference"] = too_far;
    out.write(is_one_of_many ? json_line(document) : json_text(document));
  } else if (!options.common.quiet) {
    for (const Finding& finding : report.findings) out.write(text_from(finding));
    const std::int64_t not_listed = report.findings_total - static_cast<std::int64_t>(report.findings.size());
    if (not_listed > 0) out.write(fmt::format("and {} more\n", describe_count(not_listed)));
    if (accuracy) out.write(text_from(*accuracy, fmt::format("{}", fmt::join(options.against, " "))));
    if (!options.against.empty() && !compares) out.write("not compared with the input: the archive is not whole\n");
    if (!too_far.empty()) out.write("difference: " + too_far + "\n");
    out.write(fmt::format("{}: {}: {} tiles and {} shared vertices checked, {} findings\n", printable(options.archive),
                          passed ? "passed" : "FAILED", describe_count(report.tiles_checked),
                          describe_count(report.shared_vertices_checked), describe_count(report.findings_total)));
  }
  out.finish();
  return passed ? kExitDone : kExitDifferences;
}

int run(const VerifyCommandOptions& options) {
  const std::vector<std::string> files = list_files(options.archives, true);
  if (files.size() > 1 && !options.against.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--against compares one archive with its input, {} archives are given; every file of "
                            "a mosaic wants an --against of its own (--against a.tif --against b.tif), or one "
                            "pattern in quotes takes them all (--against \"*.tif\")",
                            files.size()));
  }
  return for_each_file(files, options.common, [&](const std::string& file) {
    VerifyCommandOptions one = options;
    one.archive = file;
    return check_one(one, files.size() > 1);
  });
}

}  // namespace

Run add_verify(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<VerifyCommandOptions>(VerifyCommandOptions{common});
  VerifyCommandOptions& options = *kept;
  positionals(line, "ARCHIVE...", "Archives to check: files, folders of .isohf, \"patterns*\" and @lists",
              options.archives)
      ->required();
  group(line, "Comparison");
  CLI::Option* const against = repeated(line, "--against", "INPUT",
                                        "Measure the surface against the raster it was made from; for a mosaic a "
                                        "folder, \"pattern*\" or @list, or several "
                                        "--against",
                                        [&options](const std::string& text) { options.against.push_back(text); });
  const auto limit = [](std::optional<double>& value) {
    return [&value](const std::string& text) {
      double found = 0.0;
      if (!read_number(text, found) || !(found >= 0.0)) {
        throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be a number of at least 0");
      }
      value = found;
    };
  };
  option(line, "--max-error", "E", "Exit with 3 if a sample is off by more than E", limit(options.max_error))
      ->needs(against);
  option(line, "--max-rms", "E", "Exit with 3 if the root mean square error is above E", limit(options.max_rms))
      ->needs(against);
  add_geoid_option(line, options.geoid)->needs(against);
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
  line.footer(kVerifyFooter);
  return [kept] {
    std::error_code none;
    kept->work.scratch_folder = std::filesystem::temp_directory_path(none).string();
    return run(*kept);
  };
}

}  // namespace isohf::cli
