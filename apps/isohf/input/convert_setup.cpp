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

/// The last name is the output if -o names none and it is called .isohf. Any other name is an input: a forgotten output
/// must not cost the last of them.
void take_output(ConvertCommandOptions& options) {
  std::vector<std::string>& names = options.inputs.names;
  if (!options.output.empty() || names.size() < 2 || !is_archive_name(names.back())) return;
  options.output = names.back();
  names.pop_back();
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

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

/// What has no meaning for many archives, or for a shard.
void check_kind(const CLI::App& line, const ConvertCommandOptions& options) {
  const auto refuse_with = [&](const char* kind, std::initializer_list<const char*> others) {
    for (const char* option : others) {
      if (given(line, option)) refuse(fmt::format("{} cannot be combined with {}", option, kind));
    }
  };
  if (!options.out_dir.empty()) refuse_with("--out-dir", {"--output", "--shard", "--on-top"});
  if (options.keep_going && options.out_dir.empty()) refuse("--keep-going needs --out-dir");
  if (!options.shard) return;
  refuse_with("--shard", {"--resume", "--max-error"});
  if (!options.convert.z_range && options.convert.code_type != CodeType::kF32) {
    refuse(
        "--shard needs --z-range MIN:MAX, or --type f32, as no shard sees all elevations; isohf plan INPUT --shard K/N "
        "prints the range");
  }
}

}  // namespace

/// What is packed shares the memory with what is read from it, and with the tiles.
void share_memory(ConvertCommandOptions& options) {
  options.open.unpacked_bytes = options.work.unpacked_bytes(options.open.unpacked_bytes);
}

void add_conversion_options(CLI::App& line, ConvertCommandOptions& options, Common& common) {
  option(line, "-o,--output", "OUTPUT", "Archive to write [default: the last name, if it ends in .isohf]",
         options.output);
  line.add_flag("--overwrite", options.convert.overwrite, "Replace OUTPUT if it exists");
  line.add_flag("--resume", options.convert.resume,
                "Continue OUTPUT.part of an interrupted run after checking it, and skip complete archives");
  option(line, "--out-dir", "DIR", "Make DIR/NAME.isohf from each input; all names are inputs", options.out_dir);
  line.add_flag("--keep-going", options.keep_going, "With --out-dir: continue after a failed input");
  option(line, "--shard", "K/N", "Make shard K of N, some rows of tiles; isohf merge joins them",
         [&options](const std::string& text) { options.shard = shard_from_string(text); });
  add_source_options(line, options.open);
  add_mosaic_options(line, options.inputs);
  add_lattice_options(line, options.convert.plan, options.spacing_in_metres);
  add_shape_options(line, options.convert.plan);
  add_ground_options(line, options.convert.plan.ground);
  add_geoid_option(line, options.geoid);
  add_quantisation_options(line, options.convert);
  group(line, "Reconstruction");
  option(line, "--filter", "nearest|bilinear|limited-cubic|bspline3",
         "Reconstruction filter [default: " + to_string(kDefaultFilter) + "]",
         [&options](const std::string& text) { options.convert.filter = filter_from_string(text); });
  option(line, "--acquisition", "point|box|gaussian:SIGMA|TAPS",
         "How samples were taken; taps as in 0.25,0.5,0.25 [default: " + to_string(options.convert.acquisition) + "]",
         [&options](const std::string& text) { options.convert.acquisition = acquisition_from_string(text); });
  group(line, "Size and extras");
  choice<Effort>(line, "--effort", {{"fast", Effort::kFast}, {"default", Effort::kDefault}, {"best", Effort::kBest}},
                 "Effort to make the archive small; the elevations are the same", options.convert.effort);
  line.add_flag("--lossless", options.convert.lossless,
                "Store residuals too, so that isohf export returns every sample bit for bit");
  CLI::Option* const seeds = line.add_flag_callback(
      "--shadow-seeds", [&options] { options.convert.shadow_seeds.emplace(); },
      "Store what each tile needs to compute its own cast shadows");
  option(line, "--sun-min", "DEG", "Lowest sun for --shadow-seeds; a lower one takes more room [default: 2]",
         [&options](const std::string& text) { options.convert.shadow_seeds.value().sun_min_deg = parse_number(text); })
      ->needs(seeds);
  add_texture_options(line, options.texture);
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
}

void complete(const CLI::App& line, ConvertCommandOptions& options) {
  check_kind(line, options);
  if (options.out_dir.empty()) take_output(options);
  if (options.convert.lossless && !options.geoid.path.empty()) {
    refuse("--lossless keeps the input's own samples, --geoid changes them; give one of the two");
  }
  options.inputs.as_given = recorded_options(line);
  options.work.scratch_folder = scratch_folder_for(options.out_dir.empty() ? options.output : options.out_dir + "/");
  share_memory(options);
  options.convert.strict = options.common.strict;
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
