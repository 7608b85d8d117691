#include "input/convert_setup.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "formats/io/file_stamp.h"
#include "input/input_files.h"
#include "input/options_ground.h"
#include "input/options_lattice.h"
#include "input/options_source.h"
#include "input/options_texture.h"
#include "input/source_inputs.h"
#include "input/source_size.h"
#include "interrupt.h"
#include "isohf/archive.h"
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
#include "options/describe.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/plan_report.h"
#include "output/standard_output.h"
#include "output/void_counts_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kFooter =
    R"(The archive is written as OUTPUT.part and renamed when it is complete; an interrupted run leaves the
part for --resume and nothing under the final name. The bytes do not depend on --threads.

Examples:
  isohf convert dem.tif dem.isohf
  isohf convert dem.tif -o dem.isohf --density 0.866 --outside void --overwrite
  isohf convert dem.tif dem.isohf --texture orthophoto.tif
  isohf convert N4*E00*.hgt alps.isohf               many inputs form one surface
  isohf convert tiles/ -o land.isohf --strict        fails if a tile is missing
  isohf convert heights.exr h.isohf --channel R --z-scale 1200 --sample-spacing 2
  isohf convert tiles/ -o part-3.isohf --shard 3/64 --z-range -100:5000    one of many machines
  isohf plan dem.tif                  the same options without writing: see what comes out
  isohf convert --each tiles/ --recursive --out-dir archives --keep-going    one of each
  isohf convert --each tiles/ --recursive --out-dir archives --resume        goes on)";

/// The last name is the output where -o names none and it is called .isohf. Any other name is an input: a forgotten
/// output must not cost the last of them.
void take_output(ConvertCommandOptions& options) {
  std::vector<std::string>& names = options.inputs.names;
  if (!options.output.empty() || names.size() < 2) return;
  if (is_archive_name(names.back())) {
    options.output = names.back();
    names.pop_back();
  } else if (!options.dry_run) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("convert: no OUTPUT given: {0} is not called .isohf and counts as an input; name the "
                            "archive NAME.isohf, or give -o {0} if that is meant",
                            names.back()));
  }
}

/// What belongs to --each alone, and what has no meaning for many archives.
void check_each_options(const CommandLine& line, const ConvertCommandOptions& options) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorCode::kInvalidArgument, {"convert", why, "", ""});
  };
  for (const char* option : {"--out-dir", "--keep-going"}) {
    if (!options.each.each && line.given(option)) refuse(std::string(option) + " needs --each");
  }
  if (!options.each.each) return;
  if (options.each.folder.empty()) refuse("--each needs --out-dir DIR, where the archives go");
  for (const char* option : {"--output", "--dry-run", "--overlap"}) {
    if (line.given(option)) refuse(fmt::format("{} is for one archive, --each makes many; leave one out", option));
  }
}

/// "3/64".
ShardNumber shard_from_string(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("found \"{}\", must be K/N, as in 3/16", text));
  }
  return {static_cast<int>(parse_whole_number(text.substr(0, slash), 1, kMostShards)),
          static_cast<int>(parse_whole_number(text.substr(slash + 1), 1, kMostShards))};
}

void check_shard_options(const CommandLine& line, const ConvertCommandOptions& options) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorCode::kInvalidArgument, {"convert", why, "", ""});
  };
  for (const char* option : {"--each", "--dry-run", "--resume", "--max-error"}) {
    if (line.given(option)) refuse(fmt::format("{} has no place with --shard", option));
  }
  if (!options.convert.z_range && options.convert.code_type != CodeType::kF32) {
    refuse(
        "--shard needs --z-range MIN:MAX, or --type f32, as no shard sees all elevations; isohf info --stats INPUT "
        "prints their range");
  }
}

}  // namespace

/// What is packed shares the memory with what is read from it, and with the tiles.
void share_memory(ConvertCommandOptions& options) {
  options.open.unpacked_bytes = options.work.unpacked_bytes(options.open.unpacked_bytes);
}

std::optional<ConvertCommandOptions> parse_convert(const Arguments& arguments) {
  ConvertCommandOptions options;
  std::optional<double> sun_min_deg;
  CommandLine line("convert", "Turns rasters of elevations into an archive of isometric heightfield tiles.");
  line.group("Arguments");
  line.positionals("INPUT... OUTPUT",
                   "Rasters of elevations: files, folders, \"patterns*\" and @lists, which form one source; then the "
                   "archive to write, NAME.isohf",
                   options.inputs.names);
  line.option("-o,--output", "OUTPUT", "The archive to write; then all others are inputs", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.convert.overwrite);
  line.flag("--resume",
            "Continue OUTPUT.part of an interrupted run, or OUTPUT.part.old if that is larger, after checking it",
            options.convert.resume);
  line.flag("--dry-run", "Print the plan and write nothing, as isohf plan INPUT does", options.dry_run);
  line.option("--shard", "K/N",
              "Make shard K of N, some rows of tiles; isohf merge joins them. Needs --z-range, or --type f32",
              [&](const std::string& text) { options.shard = shard_from_string(text); });
  add_each_options(line, options.each);
  add_source_options(line, options.open);
  add_mosaic_options(line, options.inputs);
  add_lattice_options(line, options.convert.plan, options.spacing_in_metres);
  add_ground_options(line, options.convert.plan.ground);
  add_geoid_option(line, options.geoid);
  add_shape_options(line, options.convert.plan);
  add_quantisation_options(line, options.convert);
  line.group("Reconstruction");
  line.option("--filter", "NAME",
              "nearest, bilinear, limited-cubic or bspline3 (default " + to_string(kDefaultFilter) + ")",
              [&](const std::string& text) { options.convert.filter = filter_from_string(text); });
  line.words({"nearest", "bilinear", "limited-cubic", "bspline3"});
  line.option("--acquisition", "NAME",
              "Account for how samples were taken: point, box, gaussian:SIGMA or taps as 0.25,0.5,0.25 (default " +
                  to_string(options.convert.acquisition) + ")",
              [&](const std::string& text) { options.convert.acquisition = acquisition_from_string(text); });
  line.words({"point", "box", "gaussian"});
  line.group("Size and speed");
  line.option("--effort", "WORD",
              "Effort to make the archive small: fast, default or best; the elevations are the same",
              [&](const std::string& text) {
                options.convert.effort = static_cast<Effort>(parse_word(text, {"fast", "default", "best"}));
              });
  line.words({"fast", "default", "best"});
  line.group("Shadows");
  bool shadow_seeds = false;
  line.flag(
      "--shadow-seeds",
      "Store the shadows that tiles cast over their neighbours, so that none needs another, for every sun elevation "
      "from --sun-min on",
      shadow_seeds, [&] { options.convert.shadow_seeds.emplace(); });
  line.option("--sun-min", "DEG", "Lowest sun elevation for --shadow-seeds (default 2); a lower one takes more room",
              [&](const std::string& text) { sun_min_deg = parse_number(text); });
  add_texture_options(line, options.texture);
  line.group("Residuals");
  line.flag("--lossless", "Keep residuals as well, so that export gives INPUT's samples bit for bit",
            options.convert.lossless);
  add_work_options(line, options.work);
  add_memory_option(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  check_each_options(line, options);
  if (options.shard) check_shard_options(line, options);
  if (!options.each.each) take_output(options);
  line.require("INPUT", options.inputs.names);
  if (!options.dry_run && !options.each.each) line.require("OUTPUT", options.output);
  if (options.convert.clamp_range && !options.convert.z_range) {
    throw Error(ErrorCode::kInvalidArgument, "convert: --clamp-range needs --z-range MIN:MAX");
  }
  if (options.convert.max_error && options.dry_run) {
    throw Error(ErrorCode::kInvalidArgument,
                "convert: --dry-run cannot tell what --max-error will choose; leave one of the two out");
  }
  if (sun_min_deg) {
    if (!options.convert.shadow_seeds) {
      throw Error(ErrorCode::kInvalidArgument, "convert: --sun-min needs --shadow-seeds");
    }
    options.convert.shadow_seeds->sun_min_deg = *sun_min_deg;
  }
  if (options.convert.lossless && !options.geoid.path.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                "convert: --lossless keeps the input's own samples, --geoid changes them; give one of the two");
  }
  options.inputs.as_given = recorded_options(line);
  check_texture_options(options.texture);
  options.work.scratch_folder = scratch_folder_for(options.each.each ? options.each.folder + "/" : options.output);
  share_memory(options);
  options.convert.strict = options.common.strict;
  return options;
}

Prepared prepare(ConvertCommandOptions& options, std::vector<std::string> files) {
  options.inputs.onto = options.convert.plan.ground.projection;
  OpenedInputs opened = open_inputs(std::move(files), options.inputs, options.open, options.work);
  if (opened.is_reprojected) options.convert.plan.ground.projection = ProjectionRequest{};
  Prepared prepared{
      std::move(opened.files),
      laid_out(std::move(opened.source), options.geoid, options.convert.plan.ground, options.convert.lossless),
      nullptr};
  understand_ground(prepared.source->info(), options.convert.plan.ground);
  options.input = prepared.source->info().path;
  options.convert.source_note = opened.note;
  if (const std::string& file = options.geoid.path; !file.empty()) {
    prepared.files.push_back(file);
    options.convert.source_note.fingerprint += fmt::format(" | {} {}", file, FileStamp::of(file).text());
  }
  prepared.photo = open_texture(options.texture, prepared.source->info(), options.convert.texture);
  check_spacing_unit(prepared.source->info(), options.convert.plan, options.spacing_in_metres);
  return prepared;
}

std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::strtoull(line.c_str() + 6, nullptr, 10) * 1024;
  }
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

Error interrupted(const std::string& output, const std::string& again) {
  const std::string part = output + ".part";
  std::error_code none;
  return {ErrorCode::kCancelled,
          {output, std::filesystem::exists(part, none) ? "interrupted" : "interrupted before anything was written", "",
           std::filesystem::exists(part, none) ? again + " goes on with what is in " + part : ""}};
}

}  // namespace isohf::cli
