/// isohf convert: a raster of elevations becomes an archive.

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "commands/convert_each.h"
#include "input/convert_setup.h"
#include "input/input_files.h"
#include "interrupt.h"
#include "isohf/archive.h"
#include "isohf/archive/journal.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/base/output_file.h"
#include "isohf/convert/job_description.h"
#include "isohf/error.h"
#include "isohf/fill/filled_source.h"
#include "isohf/restore/source_size.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "output/accuracy_output.h"
#include "output/output_kinds.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kConvertFooter =
    R"(The archive is written as OUTPUT.part and renamed when it is complete; an interrupted run leaves the part for --resume
and nothing under the final name. isohf plan takes the same options and previews the result.

Examples:
  isohf convert dem.tif dem.isohf
  isohf convert dem.tif dem.isohf --max-error 5
  isohf convert N4*E00*.hgt alps.isohf               join many tiles
  isohf convert tiles/ -o land.isohf --strict        fail if a tile is missing
  isohf convert heights.exr h.isohf --z-scale 1200 --sample-spacing 2
  isohf convert dem.tif dem.isohf --texture orthophoto.tif
  isohf convert dems/ --recursive --out-dir archives --keep-going
  isohf convert tiles/ -o part-3.isohf --shard 3/64 --z-range -100:5000)";

/// The largest resident set so far. getrusage() would also count the program that started this one.
std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::strtoull(line.c_str() + 6, nullptr, 10) * 1024;
  }
  return 0;
}

/// "; 12 vertices clamped; nodata in 1 204 samples, 17 by --valid-range; 1 100 filled, 104 left"
std::string describe_losses(std::int64_t clamped, const std::optional<VoidCounts>& voids) {
  std::string text;
  if (clamped > 0) text += fmt::format("; {} vertices clamped", describe_count(clamped));
  if (!voids || voids->found == 0) return text;
  text += fmt::format("; nodata in {} samples", describe_count(voids->found));
  if (voids->by_valid_range > 0) text += fmt::format(", {} by --valid-range", describe_count(voids->by_valid_range));
  if (voids->filled > 0)
    text += fmt::format("; {} filled, {} left", describe_count(voids->filled), describe_count(voids->left));
  return text;
}

ordered_json json_from_voids(const std::optional<VoidCounts>& counts) {
  if (!counts) return nullptr;
  return {{"found", counts->found},
          {"by_valid_range", counts->by_valid_range},
          {"filled", counts->filled},
          {"left", counts->left}};
}

/// "; 4.8 bits a sample, 3.3 times smaller than the source's int16"
std::string describe_compression(const SizeBesideSource& size, const std::string& sample_type) {
  const std::string bits = fmt::format("; {:.3g} bits a sample", size.bits_per_source_sample);
  const double ratio = size.ratio_to_source;
  if (ratio == 0.0) return bits;
  return bits + fmt::format(", {:.3g} times {} than the source's {}", ratio >= 1.0 ? ratio : 1.0 / ratio,
                            ratio >= 1.0 ? "smaller" : "larger", sample_type);
}

Report report_of(const ConvertCommandOptions& options, const HeightSource& source, const ConvertSummary& summary,
                 const ErrorEstimate& expected) {
  const Metadata& metadata = summary.metadata;
  const TileGrid& grid = metadata.grid;
  const std::string unit = metadata.vertical_unit == "unknown" ? "" : " " + metadata.vertical_unit;
  const SizeBesideSource size(metadata, summary.tile_bytes);
  const std::optional<VoidCounts> voids = void_counts(source, summary.source_voids);
  const std::optional<AccuracyInfo> accuracy = accuracy_info(metadata);
  const bool is_f32 = metadata.quantisation.type == CodeType::kF32;
  const auto samples = static_cast<double>(summary.source_samples);
  const double samples_per_second = summary.seconds > 0.0 ? samples / summary.seconds : 0.0;
  const std::uint64_t peak = peak_memory_bytes();
  const auto beside_tiles = [&](std::uint64_t bytes) {
    return fmt::format("{}, {:.1f} % of the tiles'", describe_bytes(bytes),
                       100.0 * static_cast<double>(bytes) / static_cast<double>(summary.tile_bytes));
  };
  Report report;
  report.add("input", source.info().path);
  report.add("files", metadata.source.mosaic ? metadata.source.mosaic->files : 1);
  report.add("output", options.output, "archive",
             fmt::format("{}: {}{}", options.output, describe_bytes(summary.archive_bytes),
                         describe_compression({metadata, summary.archive_bytes}, metadata.source.sample_type)));
  report.add("status", "converted");
  report.add("tiles_expected", summary.tiles_expected);
  std::string tiles = fmt::format("{} x {} of {}x{}", grid.tile_columns(), grid.tile_rows(), grid.shape().columns(),
                                  grid.shape().rows());
  if (summary.tiles_void > 0) tiles += fmt::format(", {} of nodata alone", describe_count(summary.tiles_void));
  if (const int count = metadata.planes.count; count > 0)
    tiles += fmt::format("; {} overview{}", count, count == 1 ? "" : "s");
  report.add("tiles_written", summary.tiles_written, "tiles", tiles);
  report.add("tiles_void", summary.tiles_void);
  report.add("archive_bytes", summary.archive_bytes);
  report.add("tile_bytes", summary.tile_bytes);
  report.add("plane_bytes", summary.plane_bytes);
  report.add("shadow_seed_bytes", summary.seed_bytes);
  report.add("residual_bytes", summary.residual_bytes);
  report.add("texture_bytes", summary.texture_bytes);
  report.add("photo_pixels_per_texel", summary.pixels_per_texel);
  report.add("source_samples", size.source_samples);
  report.add("source_bytes", size.source_bytes);
  report.add("bits_per_source_sample", size.bits_per_source_sample);
  report.add("ratio_to_source", size.ratio_to_source);
  const std::string map = describe_map(metadata.projection, metadata.source.ground,
                                       options.convert.plan.ground.why_no_map, metadata.wraps_x);
  if (!map.empty()) report.line("map", map);
  report.add("source_voids", json_from_voids(voids));
  report.add("lattice_samples", summary.lattice_samples);
  report.add("step", summary.step, "elevations",
             fmt::format("{}{}, rounded by at most {:.4g}{}{}", to_string(metadata.quantisation.type),
                         is_f32 ? "" : fmt::format(", step {:.9g}{}", summary.step, unit), summary.worst_rounding, unit,
                         describe_losses(metadata.statistics.clamped, voids)));
  report.add("worst_rounding", summary.worst_rounding);
  report.add("expected_error", json_from_estimate(expected));
  report.add("accuracy", accuracy ? ordered_json::parse(format_accuracy_info(*accuracy)) : ordered_json(nullptr),
             accuracy ? "error" : "expected",
             accuracy ? describe_accuracy(*accuracy, unit) : describe_estimate(expected, unit));
  report.add("seconds", summary.seconds, "time",
             fmt::format("{}, {:.3g} million samples a second, {} of memory", describe_seconds(summary.seconds),
                         samples_per_second / 1e6, describe_bytes(peak)));
  report.add("source_samples_per_second", samples_per_second);
  report.add("peak_memory_bytes", peak);
  report.add("warnings", json_from(summary.warnings));
  if (options.common.json) report.add("metadata", ordered_json::parse(ArchiveReader(options.output).metadata_json()));
  if (metadata.planes.count > 0) report.detail("overviews", beside_tiles(summary.plane_bytes));
  if (summary.seed_bytes > 0) report.detail("seeds", beside_tiles(summary.seed_bytes));
  if (summary.residual_bytes > 0) {
    report.detail("residuals", fmt::format("{}, {:.3f} bits a sample", describe_bytes(summary.residual_bytes),
                                           8.0 * static_cast<double>(summary.residual_bytes) / samples));
  }
  if (const auto info = texture_info(metadata)) {
    report.detail("textures",
                  fmt::format("{}; {:.3g} photo pixels a texel", describe_textures(*info), summary.pixels_per_texel));
  }
  return report;
}

/// One line, which the log of a scheduler can be searched for.
Report report_of_shard(const ConvertCommandOptions& options, const char* status, const ConvertSummary* summary) {
  const ShardNumber& shard = *options.shard;
  const std::uint64_t bytes = std::filesystem::file_size(options.output);
  const std::uint64_t peak = peak_memory_bytes();
  Report report;
  report.add("shard", shard.number);
  report.add("shards", shard.count);
  report.add("output", options.output);
  report.add("status", status);
  report.add("archive_bytes", bytes);
  report.add("peak_memory_bytes", peak);
  std::string words = fmt::format("{}: {}, {}", status, options.output, describe_bytes(bytes));
  if (summary != nullptr) {
    words += fmt::format(", {} tiles, {}, {} of memory", describe_count(summary->tiles_written),
                         describe_seconds(summary->seconds), describe_bytes(peak));
    report.add("tiles_written", summary->tiles_written);
    report.add("seconds", summary->seconds);
    report.add("warnings", json_from(summary->warnings));
  }
  report.line(fmt::format("shard {}/{}", shard.number, shard.count), words);
  return report;
}

/// A note of an interrupted run that this one does not resume. Empty if there is none, or another run is writing it.
std::string note_of_interrupted_run(const ConvertCommandOptions& options) {
  if (options.convert.resume) return {};
  const std::string part = output_place(options.output, true) + ".part";
  const std::uint64_t bytes = interrupted_bytes(part);
  if (bytes == 0) return {};
  return fmt::format("{}: keeping {} of an interrupted run until this one is complete. --resume would continue it",
                     part, describe_bytes(bytes));
}

/// Whether OUTPUT is what --resume would make, complete. Throws Error if something else is there.
bool is_complete(const ConvertCommandOptions& options, const Prepared& prepared) {
  if (!options.convert.resume) return false;
  if (!options.shard) return is_converted(options.output, prepared.source->info(), prepared.files, options.convert);
  std::error_code none;
  if (!std::filesystem::exists(options.output, none)) return false;
  if (is_shard(options.output, *prepared.source, *options.shard, options.convert)) return true;
  throw Error(ErrorCode::kInvalidArgument,
              {options.output, "exists and is not this shard, complete", "", "--overwrite replaces it"});
}

Report report_of_complete(const std::string& input, const std::string& output) {
  Report report;
  report.add("input", input);
  report.add("output", output);
  report.add("status", "complete");
  report.add("archive_bytes", std::filesystem::file_size(output));
  return report;
}

/// One of --out-dir; nullopt if the share is too small for it.
std::optional<EachResult> convert_one(ConvertCommandOptions options, const EachFile& file, const Batch::Share& share) {
  options.output = file.output;
  options.work.threads = share.job.threads;
  options.work.memory_bytes = share.job.memory_bytes;
  check_archive_output({file.input}, file.output, options.convert.overwrite || options.convert.resume);
  const Prepared prepared = prepare(options, {file.input});
  HeightSource& source = *prepared.source;
  if (is_complete(options, prepared)) return EachResult{report_of_complete(file.input, file.output)};
  Job job = share.job;
  job.cancel = &watch_interrupts();
  if (!share.is_whole && !fits_share(source, options.convert, job)) return std::nullopt;
  std::string note = note_of_interrupted_run(options);
  ConvertSummary summary = convert(source, file.output, options.convert, job);
  return EachResult{report_of(options, source, summary, {}), std::move(summary.warnings), std::move(note)};
}

/// One archive, or a shard of it.
int run(ConvertCommandOptions options) {
  const Common& common = options.common;
  // An interrupted shard is continued, and a complete one skipped.
  if (options.shard) options.convert.resume = !options.convert.overwrite;
  const bool may_exist = options.convert.overwrite || options.convert.resume;
  // Whether the output may be written is known before an input is searched.
  check_archive_output(options.inputs.names, options.output, may_exist);
  std::vector<std::string> files = expand_inputs(options.inputs.names, options.inputs.recursive);
  check_archive_output(files, options.output, may_exist);
  const Prepared prepared = prepare(options, std::move(files));
  HeightSource& source = *prepared.source;
  if (is_complete(options, prepared)) {
    Report report = options.shard ? report_of_shard(options, "done already", nullptr)
                                  : report_of_complete(source.info().path, options.output);
    if (!options.shard) report.line("archive", options.output + ": complete already");
    report.print(common);
    return kExitDone;
  }
  if (const std::string note = note_of_interrupted_run(options); !note.empty() && !common.quiet)
    print_note(common, note);
  std::optional<ProgressDisplay> display(std::in_place, common, options.work.progress);
  const Job job = job_from(options.work, *display);
  const ConvertSummary summary = [&] {
    try {
      return options.shard ? convert_shard(source, *options.shard, options.output, options.convert, job)
                           : convert(source, options.output, options.convert, job);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCancelled) throw;
      std::error_code none;
      const bool is_begun = std::filesystem::exists(options.output + ".part", none);
      throw Error(ErrorCode::kCancelled,
                  {options.output, is_begun ? "interrupted" : "interrupted before anything was written", "",
                   is_begun ? "the same command with --resume continues" : ""});
    }
  }();
  ErrorEstimate expected;
  if (!common.quiet && !options.shard && !options.convert.max_error)
    expected = estimate_error(source, options.convert, job, summary.metadata.quantisation);
  display.reset();
  print_warnings(common, summary.warnings);
  (options.shard ? report_of_shard(options, "done", &summary) : report_of(options, source, summary, expected))
      .print(common);
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
    if (!options->out_dir.empty()) {
      return convert_each(*options, [&](const EachFile& file, const Batch::Share& share) {
        return convert_one(*options, file, share);
      });
    }
    if (options->output.empty()) {
      const auto& names = options->inputs.names;
      const bool comes_first = std::ranges::any_of(names, is_archive_name);
      throw Error(ErrorCode::kInvalidArgument,
                  comes_first ? "no OUTPUT given: the archive comes last, after all inputs"
                              : fmt::format("no OUTPUT given: {} is an input; name an archive NAME.isohf last, or give "
                                            "-o or --out-dir",
                                            names.back()));
    }
    if (options->shard && !options->convert.z_range && options->convert.code_type != CodeType::kF32) {
      throw Error(ErrorCode::kInvalidArgument,
                  "--shard needs --z-range MIN:MAX, or --type f32, as no shard sees all elevations; isohf plan INPUT "
                  "--shard K/N prints the range");
    }
    return run(*options);
  };
}

}  // namespace isohf::cli
