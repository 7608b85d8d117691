/// isohf convert: a raster of elevations becomes an archive.

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "commands/command.h"
#include "commands/convert_each.h"
#include "commands/shards.h"
#include "formats/io/file_stamp.h"
#include "formats/io/text.h"
#include "input/convert_setup.h"
#include "input/input_files.h"
#include "input/options_ground.h"
#include "input/options_lattice.h"
#include "input/options_source.h"
#include "input/options_texture.h"
#include "input/source_inputs.h"
#include "input/source_size.h"
#include "interrupt.h"
#include "isohf/archive.h"
#include "isohf/archive/journal.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/base/file.h"
#include "isohf/base/output_file.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/memory_plan.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/resampling.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/plan_report.h"
#include "output/standard_output.h"
#include "output/void_counts_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kConvertFooter =
    R"(The archive is written as OUTPUT.part and renamed when it is complete; an interrupted run leaves the part for --resume
and nothing under the final name. isohf plan takes the same options and previews what comes out.

Examples:
  isohf convert dem.tif dem.isohf
  isohf convert dem.tif dem.isohf --max-error 5
  isohf convert N4*E00*.hgt alps.isohf               join many tiles
  isohf convert tiles/ -o land.isohf --strict        fail if a tile is missing
  isohf convert heights.exr h.isohf --z-scale 1200 --sample-spacing 2
  isohf convert dem.tif dem.isohf --texture orthophoto.tif
  isohf convert dems/ --recursive --out-dir archives --keep-going
  isohf convert tiles/ -o part-3.isohf --shard 3/64 --z-range -100:5000)";

struct Measured {
  double samples_per_second = 0.0;  ///< of the source
  std::uint64_t peak_memory_bytes = 0;
};

Measured measure(const ConvertSummary& summary) {
  Measured measured;
  if (summary.seconds > 0.0) {
    measured.samples_per_second = static_cast<double>(summary.source_samples) / summary.seconds;
  }
  measured.peak_memory_bytes = peak_memory_bytes();
  return measured;
}

ordered_json document_of(const ConvertCommandOptions& options, const ConvertSummary& summary,
                         const std::optional<VoidCounts>& voids, const ErrorEstimate& expected) {
  const std::optional<AccuracyInfo> accuracy = accuracy_info(summary.metadata);
  const Measured measured = measure(summary);
  const SizeBesideSource size(summary.metadata, summary.tile_bytes);
  return {{"input", options.input},
          {"files", summary.metadata.source.mosaic ? summary.metadata.source.mosaic->files : 1},
          {"output", options.output},
          {"status", "converted"},
          {"tiles_expected", summary.tiles_expected},
          {"tiles_written", summary.tiles_written},
          {"tiles_void", summary.tiles_void},
          {"archive_bytes", summary.archive_bytes},
          {"tile_bytes", summary.tile_bytes},
          {"plane_bytes", summary.plane_bytes},
          {"shadow_seed_bytes", summary.seed_bytes},
          {"residual_bytes", summary.residual_bytes},
          {"texture_bytes", summary.texture_bytes},
          {"photo_pixels_per_texel", summary.pixels_per_texel},
          {"source_samples", size.source_samples},
          {"source_bytes", size.source_bytes},
          {"bits_per_source_sample", size.bits_per_source_sample},
          {"ratio_to_source", size.ratio_to_source},
          {"source_voids", json_from_voids(voids)},
          {"lattice_samples", summary.lattice_samples},
          {"expected_error", json_from_estimate(expected)},
          {"accuracy", accuracy ? ordered_json::parse(format_accuracy_info(*accuracy)) : ordered_json(nullptr)},
          {"step", summary.step},
          {"worst_rounding", summary.worst_rounding},
          {"seconds", summary.seconds},
          {"source_samples_per_second", measured.samples_per_second},
          {"peak_memory_bytes", measured.peak_memory_bytes},
          {"warnings", json_from(summary.warnings)},
          {"metadata", ordered_json::parse(ArchiveReader(options.output).metadata_json())}};
}

std::string text_from(const ConvertCommandOptions& options, const ConvertSummary& summary,
                      const std::optional<VoidCounts>& voids, const ErrorEstimate& expected) {
  const Measured measured = measure(summary);
  const Metadata& metadata = summary.metadata;
  const TileShape& shape = metadata.grid.shape();
  const std::string unit = metadata.vertical_unit == "unknown" ? "" : " " + metadata.vertical_unit;
  std::string text;
  const auto say = [&](const char* what, const std::string& value) { text += fmt::format("{:<12} {}\n", what, value); };
  say("archive", fmt::format("{}: {}", options.output, describe_bytes(summary.archive_bytes)));
  say("tiles", fmt::format("{} of {} written, {} of them wholly void; {} x {} tiles of {}x{}",
                           describe_count(summary.tiles_written), describe_count(summary.tiles_expected),
                           describe_count(summary.tiles_void), metadata.grid.tile_columns(), metadata.grid.tile_rows(),
                           shape.columns(), shape.rows()));
  if (metadata.source.ground) say("map scale", describe_map_scale(*metadata.source.ground));
  if (const std::string& why = options.convert.plan.ground.why_no_map; !why.empty()) {
    say("map scale", "not known: " + why);
  }
  if (metadata.projection) say("projection", describe_projection(*metadata.projection));
  if (metadata.wraps_x) say("joins", "the East edge is the West edge");
  say("size", describe_size(metadata, summary.tile_bytes));
  if (summary.residual_bytes > 0) {
    say("residuals",
        fmt::format("{}, {:.3f} bits a source sample", describe_bytes(summary.residual_bytes),
                    8.0 * static_cast<double>(summary.residual_bytes) / static_cast<double>(summary.source_samples)));
  }
  if (metadata.quantisation.type == CodeType::kF32) {
    say("elevations", fmt::format("f32, worst rounding {:.4g}{}", summary.worst_rounding, unit));
  } else {
    say("elevations", fmt::format("{}, step {:.9g}{}, worst rounding {:.4g}{}", to_string(metadata.quantisation.type),
                                  summary.step, unit, summary.worst_rounding, unit));
  }
  if (const auto accuracy = accuracy_info(metadata)) {
    say("error", describe_accuracy(*accuracy, unit));
  } else {
    say("expected", describe_estimate(expected, unit));
  }
  if (metadata.planes.count > 0) {
    say("planes",
        fmt::format("{}, {}, {:.1f} % of the tiles'", metadata.planes.count, describe_bytes(summary.plane_bytes),
                    100.0 * static_cast<double>(summary.plane_bytes) / static_cast<double>(summary.tile_bytes)));
  }
  if (summary.seed_bytes > 0) {
    const auto tile_bytes = static_cast<double>(summary.tile_bytes);
    say("shadows", fmt::format("seeds of {}, {:.1f} % of the tiles'", describe_bytes(summary.seed_bytes),
                               100.0 * static_cast<double>(summary.seed_bytes) / tile_bytes));
  }
  if (const auto info = texture_info(metadata)) say("textures", describe_textures(*info, summary.pixels_per_texel));
  if (voids && voids->found > 0) say("voids", text_from_voids(*voids));
  if (metadata.statistics.clamped > 0) {
    say("clamped", fmt::format("{} vertices moved into the range", describe_count(metadata.statistics.clamped)));
  }
  say("time", fmt::format("{}, {:.3g} million input samples a second", describe_seconds(summary.seconds),
                          measured.samples_per_second / 1e6));
  say("memory", fmt::format("{} at most", describe_bytes(measured.peak_memory_bytes)));
  return text;
}

/// Why a file is no complete archive, for a message that names it.
std::string incomplete(const std::string& path, const Error& error) {
  const std::string why = error.what();
  return "is no complete archive: " + (why.starts_with(path + ": ") ? why.substr(path.size() + 2) : why);
}

/// A note of an interrupted run that this one does not resume. Empty where there is none, or another run is writing it.
std::string note_of_interrupted_run(const ConvertCommandOptions& options) {
  if (options.convert.resume) return {};
  const std::string part = output_place(options.output, true) + ".part";
  const std::uint64_t bytes = interrupted_bytes(part);
  if (bytes == 0) return {};
  return fmt::format(
      "{}: {} of an interrupted run are kept until this run is complete; to continue that one instead, "
      "interrupt and give --resume",
      part, describe_bytes(bytes));
}

/// Whether OUTPUT is what --resume would come to. Throws Error{kInvalidArgument} where it is another archive,
/// Error{kCorrupt, ...} where it is none, unless it may be replaced.
bool is_complete(const ConvertCommandOptions& options, const Prepared& prepared) {
  std::error_code none;
  if (!options.convert.resume || !std::filesystem::exists(options.output, none)) return false;
  std::string difference;
  const auto written = std::filesystem::last_write_time(options.output, none);
  for (const std::string& file : prepared.files) {
    if (std::filesystem::last_write_time(file, none) > written) difference = file + " was changed after it was written";
  }
  ErrorCode code = ErrorCode::kInvalidArgument;
  try {
    if (difference.empty()) {
      const SourceInfo& info = prepared.source->info();
      difference = difference_from_job(ArchiveReader(options.output).metadata_json(), info,
                                       make_plan(info, options.convert.plan), options.convert);
      if (!difference.empty()) difference = "was made otherwise: " + difference;
    }
  } catch (const Error& error) {
    difference = incomplete(options.output, error);
    code = error.code();
  }
  if (difference.empty()) {
    // A run that was killed between its last two steps left its journal.
    if (!std::filesystem::exists(options.output + ".part", none)) {
      std::filesystem::remove(options.output + ".part.journal", none);
    }
    remove_part_aside(options.output + ".part");
    return true;
  }
  if (options.convert.overwrite) return false;
  throw Error(code, {options.output, difference, "", "--overwrite makes it anew"});
}

ordered_json json_of_complete(const std::string& input, const std::string& output) {
  return {{"input", input},
          {"output", output},
          {"status", "complete"},
          {"archive_bytes", std::filesystem::file_size(output)}};
}

/// Makes the folders of all archives, and looks whether they can be written to, once for each.
void make_folders(const std::vector<EachFile>& files) {
  std::set<std::filesystem::path> folders;
  for (const EachFile& file : files) folders.insert(std::filesystem::path(file.output).parent_path());
  for (const std::filesystem::path& folder : folders) {
    std::error_code none;
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure && !std::filesystem::exists(folder, none)) {
      throw Error(ErrorCode::kIo, fmt::format("cannot make the folder {}: {}", folder.string(), failure.message()));
    }
    require_writable_folder(folder.string());
  }
}

/// The files of --out-dir, whose archives may be written.
std::vector<EachFile> checked_files(const ConvertCommandOptions& options) {
  std::vector<EachFile> files = files_of_each(options.inputs.names, options.inputs.recursive, options.out_dir);
  std::error_code none;
  std::set<std::filesystem::path> inputs;
  for (const EachFile& file : files) inputs.insert(std::filesystem::weakly_canonical(file.input, none));
  std::string existing;
  std::size_t count = 0;
  for (const EachFile& file : files) {
    if (!std::filesystem::exists(std::filesystem::symlink_status(file.output, none))) continue;
    if (inputs.contains(std::filesystem::weakly_canonical(file.output, none))) {
      throw Error(ErrorCode::kInvalidArgument,
                  {file.output, "the output is one of the inputs", "", "choose another folder"});
    }
    if (count++ == 0) existing = file.output;
  }
  if (count > 0 && !options.convert.overwrite && !options.convert.resume) {
    throw Error(ErrorCode::kInvalidArgument,
                {existing, count == 1 ? "exists" : fmt::format("exists, and {} more archives do", count - 1), "",
                 "--resume leaves those that are complete, --overwrite replaces them"});
  }
  make_folders(files);
  return files;
}

/// One of --out-dir; nullopt where the share is too small for it.
std::optional<EachResult> convert_one(ConvertCommandOptions options, const EachFile& file, const EachShare& share) {
  /// What one thread does in a fraction of a second.
  constexpr std::int64_t kSmallSamples = std::int64_t{1} << 24U;
  options.output = file.output;
  options.work.threads = share.threads;
  options.work.memory_bytes = share.memory_bytes;
  share_memory(options);
  check_archive_output({file.input}, file.output, options.convert.overwrite || options.convert.resume);
  const Prepared prepared = prepare(options, {file.input});
  const SourceInfo& info = prepared.source->info();
  if (is_complete(options, prepared)) {
    return EachResult{false, json_line(json_of_complete(file.input, file.output)), {}};
  }
  Job job;
  job.threads = share.threads;
  job.memory_bytes = share.memory_bytes;
  job.machine_bytes = share.machine_bytes;
  job.cancel = &watch_interrupts();
  if (!share.alone) {
    if (info.width > kSmallSamples / info.height) return std::nullopt;
    const Plan plan = make_plan(info, options.convert.plan);
    const MemoryPlan memory = plan_memory(*prepared.source, plan, options.convert, job);
    if (job.bound_bytes() != 0 && memory.bytes > job.bound_bytes()) return std::nullopt;
  }
  std::string note = note_of_interrupted_run(options);
  ConvertSummary summary = convert(*prepared.source, file.output, options.convert, job);
  const ordered_json document =
      document_of(options, summary, counts_of_voids(*prepared.source, summary.source_voids), {});
  return EachResult{true, json_line(document), std::move(summary.warnings), std::move(note)};
}

int run_each(const ConvertCommandOptions& options) {
  return convert_each(
      checked_files(options), options.keep_going, options.work, options.common,
      [&](const EachFile& file, const EachShare& share) { return convert_one(options, file, share); },
      watch_interrupts());
}

int run(ConvertCommandOptions options) {
  const Common& common = options.common;
  const bool may_exist = options.convert.overwrite || options.convert.resume;
  // What the output is can be told before anything is looked for.
  check_archive_output(options.inputs.names, options.output, may_exist);
  std::vector<std::string> files = expand_inputs(options.inputs.names, options.inputs.recursive);
  check_archive_output(files, options.output, may_exist);
  const Prepared prepared = prepare(options, std::move(files));
  HeightSource& source = *prepared.source;
  std::optional<ProgressDisplay> display(std::in_place, options.common, options.work.progress);
  const Job job = job_from(options.work, *display);
  if (is_complete(options, prepared)) {
    StandardOutput out(common);
    if (common.json) out.write(json_text(json_of_complete(options.input, options.output)));
    if (!common.json && !common.quiet) {
      out.write(fmt::format("{}: complete already, made of this input with these options\n", options.output));
    }
    out.finish();
    return kExitDone;
  }
  if (common.verbose && !common.quiet) print_plan_notes(source, options.convert, job, common);
  if (const std::string note = note_of_interrupted_run(options); !note.empty() && !common.quiet)
    print_note(common, note);
  const ConvertSummary summary = [&] {
    try {
      return convert(source, options.output, options.convert, job);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCancelled) throw;
      throw interrupted(options.output, "the same command with --resume");
    }
  }();
  ErrorEstimate expected;
  if (!common.quiet && !options.convert.max_error)
    expected = estimate_error(source, options.convert, job, summary.metadata.quantisation);
  display.reset();
  print_warnings(common, summary.warnings);
  const std::optional<VoidCounts> voids = counts_of_voids(source, summary.source_voids);
  StandardOutput out(common);
  if (common.json) {
    out.write(json_text(document_of(options, summary, voids, expected)));
  } else if (!common.quiet) {
    out.write(text_from(options, summary, voids, expected));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

Run add_convert(CLI::App& line, Common& common) {
  const auto options = std::make_shared<ConvertCommandOptions>(ConvertCommandOptions{common});
  positionals(line, "INPUT... OUTPUT.isohf",
              "Rasters of elevations, joined into one surface: files, folders, \"patterns*\" and @LISTs, text files of "
              "one input a line",
              options->inputs.names)
      ->required();
  add_conversion_options(line, *options, common);
  most_used(line, {"--output", "--overwrite", "--out-dir", "--crs", "--sample-spacing", "--z-scale", "--fill",
                   "--max-error", "--lossless", "--memory"});
  line.footer(kConvertFooter);
  return [options, &line] {
    complete(line, *options);
    if (!options->out_dir.empty()) return run_each(*options);
    if (options->output.empty()) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("no OUTPUT given: {} is an input; name an archive NAME.isohf, or give -o or --out-dir",
                              options->inputs.names.back()));
    }
    return options->shard ? convert_shard_of(*options) : run(*options);
  };
}

}  // namespace isohf::cli
