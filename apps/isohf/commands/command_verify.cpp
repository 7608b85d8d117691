/// isohf verify: checks that an archive is whole, and measures its distance from its input.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "input/source_inputs.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "isohf/verify/accuracy/same_source.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kVerifyFooter =
    R"(Each finding is one line: its number, its severity, where, what. Exit code 0: nothing above a note was found;
3: something was, or the surface is further from INPUT than allowed; 1: the check itself failed.
INPUT is read with the options that the archive records.

Examples:
  isohf verify dem.isohf
  isohf verify archives/ --json       one JSON object a line
  isohf verify dem.isohf --against dem.tif --max-error 5)";

struct VerifyOptions {
  const Common& common;
  WorkOptions work{};
  std::vector<std::string> archives{};
  std::vector<std::string> against{};
  GeoidRequest geoid{};
  std::optional<double> max_error{};
  std::optional<double> max_rms{};
};

const char* to_word(Severity severity) {
  constexpr const char* kWords[] = {"note", "warning", "error"};
  return kWords[static_cast<std::size_t>(severity)];
}

/// The archive's input, read with the options that its record has. Throws Error.
std::unique_ptr<HeightSource> open_as_recorded(const VerifyOptions& options, const Metadata& metadata) {
  const SourceRecord& record = metadata.source;
  const std::vector<std::string> files = expand_inputs(options.against, false);
  RecordedInput input = recorded_input(record.options.value_or(RecordedOptions{}));
  input.open.buffer_bytes = options.work.reader_bytes(input.open.buffer_bytes);
  if (!options.geoid.path.empty()) {
    input.geoid = options.geoid;
  } else if (!input.geoid.path.empty()) {
    input.geoid.path = (std::filesystem::path(files.front()).parent_path() / input.geoid.path).string();
  }
  if (!input.open.registration) input.open.registration = record.registration;
  // Inputs of different reference systems were joined in that of the record.
  if (const std::string system = system_text(source_georeference(record).system); record.mosaic && !system.empty()) {
    input.inputs.onto = ProjectionRequest::parse(system);
  }
  const auto open = [&] {
    OpenedInputs opened = open_inputs(files, input.inputs, input.open, options.work);
    const bool repeats_column = record.repeats_column && opened.source->info().width == record.width + 1;
    GroundRequest ground;
    ground.wrap = metadata.wraps_x || repeats_column ? Wrap::kAlways : Wrap::kNever;
    return laid_out(std::move(opened.source), input.geoid, ground, true);
  };
  std::unique_ptr<HeightSource> source = open();
  const SourceInfo& info = source->info();
  const bool is_scaled = input.open.z_scale || input.open.z_offset;
  if (!is_scaled || (info.z_scale == record.z_scale && info.z_offset == record.z_offset)) return source;
  // A raster of isohf export states the scale with these options in it.
  input.open.z_scale.reset();
  input.open.z_offset.reset();
  return open();
}

struct Accuracy {
  VertexReport vertices;
  AccuracyReport surface;
};

/// Adds to the findings what else the comparison finds.
Accuracy compare(const VerifyOptions& options, const std::string& path, const Job& job, ProgressDisplay& display,
                 VerifyReport& checks) {
  ArchiveReader archive = open_archive(path);
  const Metadata& metadata = archive.metadata();
  std::unique_ptr<HeightSource> source;
  try {
    source = open_as_recorded(options, metadata);
  } catch (const Error& error) {
    throw error.within(path);
  }
  const SourceInfo& info = source->info();
  const auto same_system = are_same(source_georeference(metadata.source).system, info.georeference.system);
  const std::vector<Warning> warnings = check_same_source(archive, info, same_system);
  display.clear();
  print_warnings(options.common, warnings);
  if (is_warped(metadata)) understand_source(archive);
  Accuracy found{check_vertices(archive, *source, job), compare_with_source(archive, *source, job)};
  add_findings(metadata, found.vertices, found.surface, checks);
  return found;
}

/// Why the measured error is more than was allowed; empty if it is not.
std::string why_too_far(const VerifyOptions& options, const AccuracyReport& accuracy) {
  const auto exceeds = [](const char* what, double found, const std::optional<double>& most) {
    if (!most || found <= *most) return std::string();
    return fmt::format("the {} error is {:.6g}, at most {:.6g} is allowed", what, found, *most);
  };
  const std::string largest = exceeds("largest", accuracy.max, options.max_error);
  return largest.empty() ? exceeds("rms", accuracy.rms, options.max_rms) : largest;
}

ordered_json checks_of(const VerifyReport& report) {
  ordered_json findings = ordered_json::array();
  for (const Finding& finding : report.findings) {
    ordered_json tile;
    if (finding.tile) tile = {{"column", finding.tile->column}, {"row", finding.tile->row}};
    findings.push_back({{"id", finding_name(finding.id)},
                        {"severity", to_word(finding.severity)},
                        {"tile", tile},
                        {"text", spelled(finding.text)}});
  }
  return {{"passed", report.passed()},
          {"tiles_checked", report.tiles_checked},
          {"shared_vertices_checked", report.shared_vertices_checked},
          {"findings_total", report.findings_total},
          {"findings", findings}};
}

std::string text_from(const VerifyReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) {
    const std::string tile =
        finding.tile ? fmt::format(" tile ({},{})", finding.tile->column, finding.tile->row) : std::string();
    text += fmt::format("{} {}{}: {}\n", finding_name(finding.id), to_word(finding.severity), tile,
                        printable(spelled(finding.text)));
  }
  const std::int64_t not_listed = report.findings_total - static_cast<std::int64_t>(report.findings.size());
  if (not_listed > 0) text += fmt::format("and {} more\n", describe_count(not_listed));
  return text;
}

void add_accuracy(const Accuracy& measured, const std::string& input, Report& report) {
  const auto& [vertices, found] = measured;
  report.add("against",
             {{"samples", found.samples},
              {"samples_void", found.samples_void},
              {"samples_compared", found.samples_compared},
              {"samples_off_map", found.samples_off_map},
              {"samples_lost", found.samples_lost},
              {"lost_inside", found.lost_inside},
              {"samples_invented", found.samples_invented},
              {"invented_inside", found.invented_inside},
              {"rms", found.rms},
              {"max", found.max},
              {"p99", found.p99},
              {"psnr_db", found.psnr_db},
              {"worst", {{"x", found.worst.x}, {"z", found.worst.z}}},
              {"vertices",
               {{"checked", vertices.vertices},
                {"voids", vertices.voids},
                {"clamped", vertices.clamped},
                {"wrong", vertices.wrong},
                {"bound", vertices.bound},
                {"worst", vertices.worst}}}},
             "against",
             fmt::format("{}: {} of {} samples compared, {} nodata in the input{}", input,
                         describe_count(found.samples_compared), describe_count(found.samples),
                         describe_count(found.samples_void),
                         found.samples_off_map > 0
                             ? fmt::format(", {} not on the archive's map", describe_count(found.samples_off_map))
                             : ""));
  if (found.samples_lost + found.samples_invented > 0) {
    report.line("nodata", fmt::format("{} samples have no surface, {} nodata samples have one; {} and {} of them away "
                                      "from borders of nodata",
                                      describe_count(found.samples_lost), describe_count(found.samples_invented),
                                      describe_count(found.lost_inside), describe_count(found.invented_inside)));
  }
  report.line("error",
              fmt::format("rms {:.6g}, 99 % within {:.6g}, largest {:.6g} at x {:.9g} z {:.9g}, PSNR {:.1f} dB",
                          found.rms, found.p99, found.max, found.worst.x, found.worst.z, found.psnr_db));
  report.detail(
      "vertices",
      fmt::format("{} resampled once more: largest difference {:.6g}, at most {:.6g} is rounding, "
                  "{} clamped",
                  describe_count(vertices.vertices), vertices.worst, vertices.bound, describe_count(vertices.clamped)));
}

int check(const VerifyOptions& options, const std::string& path, bool is_one_of_many) {
  const Common& common = options.common;
  std::optional<ProgressDisplay> display(std::in_place, common, options.work.progress);
  const Job job = job_from(options.work, *display);
  VerifyReport checks = verify_archive(path, job);
  if (!checks.findings.empty() && checks.findings.front().id == finding::kNotReadable) {
    if (const std::string what = what_else(path); !what.empty()) checks.findings.front().text = path + ": " + what;
  }
  std::optional<Accuracy> accuracy;
  // An archive that is not whole has no surface to measure.
  const bool is_whole = checks.passed();
  if (is_whole && !options.against.empty()) accuracy = compare(options, path, job, *display, checks);
  display.reset();
  const std::string too_far = accuracy ? why_too_far(options, accuracy->surface) : "";
  const bool passed = checks.passed() && too_far.empty();

  Report report;
  report.add("archive", path);
  report.add("passed", passed);
  report.add("checks", checks_of(checks));
  if (accuracy) add_accuracy(*accuracy, fmt::format("{}", fmt::join(options.against, " ")), report);
  if (!is_whole && !options.against.empty()) report.line("against", "not compared: the archive is not whole");
  if (!too_far.empty()) report.add("difference", too_far, "difference", too_far);
  StandardOutput out(common);
  const bool prints_text = !common.json && !common.quiet;
  if (prints_text) out.write(text_from(checks));
  out.finish();
  report.print(common, is_one_of_many);
  if (prints_text) {
    out.write(fmt::format("{}: {}: {} tiles and {} shared vertices checked, {} findings\n", printable(path),
                          passed ? "passed" : "FAILED", describe_count(checks.tiles_checked),
                          describe_count(checks.shared_vertices_checked), describe_count(checks.findings_total)));
  }
  out.finish();
  return passed ? kExitDone : kExitDifferences;
}

int run(const VerifyOptions& options) {
  const std::vector<std::string> files = list_files(options.archives, true);
  if (files.size() > 1 && !options.against.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--against compares one archive with its input, {} archives are given. Give each file of a "
                            "mosaic its own --against (--against a.tif --against b.tif), or all as one pattern in "
                            "quotes (--against \"*.tif\")",
                            files.size()));
  }
  return for_each_file(files, options.common,
                       [&](const std::string& file) { return check(options, file, files.size() > 1); });
}

}  // namespace

Run add_verify(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<VerifyOptions>(VerifyOptions{common});
  VerifyOptions& options = *kept;
  positionals(line, "ARCHIVE...", "Archives to check: files, folders of .isohf, \"patterns*\" and @lists",
              options.archives)
      ->required();
  group(line, "Comparison");
  CLI::Option* const against =
      repeated(line, "--against", "INPUT",
               "Measure the surface against the raster it was made from. For a mosaic give a folder, \"pattern*\" or "
               "@list, or several --against",
               [&options](const std::string& text) { options.against.push_back(text); });
  const auto limit = [](std::optional<double>& value) {
    return [&value](const std::string& text) { value = parse_number_in(text, 0.0, HUGE_VAL); };
  };
  option(line, "--max-error", "E", "Exit with 3 if a sample is off by more than E", limit(options.max_error))
      ->needs(against);
  option(line, "--max-rms", "E", "Exit with 3 if the root mean square error is above E", limit(options.max_rms))
      ->needs(against);
  add_geoid_option(line, options.geoid)->needs(against);
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
  most_used(line, {"--against", "--max-error", "--max-rms"});
  line.footer(kVerifyFooter);
  return [kept] {
    std::error_code none;
    kept->work.scratch_folder = std::filesystem::temp_directory_path(none).string();
    return run(*kept);
  };
}

}  // namespace isohf::cli
