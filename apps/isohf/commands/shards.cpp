/// One conversion on many machines: isohf plan --write, isohf convert --plan.

#include "commands/shards.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "isohf/base/file.h"
#include "isohf/base/output_file.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"
#include "options/convert_setup.h"
#include "options/describe.h"
#include "options/input_files.h"
#include "options/option_values.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kShardFooter =
    R"(INPUT and all options are the plan's; -j, --memory and --tmpdir are each machine's own. A shard that is there already
is left alone; one that was interrupted goes on with PART.part.

Examples:
  isohf plan dem.tif --write land.plan --shards 16 --shadow-seeds
  isohf convert --plan land.plan --shard 3/16 -o part-3.isohf
  isohf merge land.plan part-*.isohf -o land.isohf)";

/// The arguments that make the same source and options again.
std::vector<std::string> recorded(const Arguments& arguments) {
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--") {
      kept.insert(kept.end(), arguments.begin() + static_cast<std::ptrdiff_t>(i), arguments.end());
      break;
    }
    // What one machine prints is its own business.
    constexpr std::array kDropped = {"--overwrite", "-q", "--quiet", "--json"};
    if (std::find(kDropped.begin(), kDropped.end(), argument) != kDropped.end()) continue;
    if (argument == "--write" || argument == "--shards") {
      ++i;
      continue;
    }
    if (!argument.starts_with("--write=") && !argument.starts_with("--shards=")) kept.push_back(argument);
  }
  return kept;
}

struct ShardCommand {
  CommonOptions common;
  WorkOptions work;
  std::string plan;
  int shard = 0;
  int shards = 0;
  std::string output;
  bool overwrite = false;
};

std::optional<ShardCommand> parse_shard(const Arguments& arguments) {
  ShardCommand options;
  CommandLine line("convert", "Makes one shard of a plan: some rows of tiles of its archive.");
  line.group("Arguments");
  line.option("--plan", "PLAN", "Plan of isohf plan --write", options.plan);
  line.option("--shard", "K/N", "The Kth of the plan's N shards, from 1 on", [&](const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("found \"{}\", must be K/N, as in 3/16", text));
    }
    options.shard = static_cast<int>(parse_whole_number(text.substr(0, slash), 1, 1000000));
    options.shards = static_cast<int>(parse_whole_number(text.substr(slash + 1), 1, 1000000));
  });
  line.option("-o,--output", "PART", "The archive to write", options.output);
  line.flag("--overwrite", "Make it anew where it exists", options.overwrite);
  add_work_options(line, options.work);
  add_memory_options(line, "that of -o", options.work);
  add_common_options(line, options.common);
  line.footer(kShardFooter);
  line.settled("convert", "is settled by the plan; isohf plan takes it");
  if (!line.parse(arguments)) return std::nullopt;
  line.require("PLAN (--plan)", options.plan);
  line.require("PART (-o)", options.output);
  if (options.shard == 0) line.fail("which shard? Give --shard K/N");
  return options;
}

/// What both --plan and --shard must agree on.
ShardPlan read_plan_of(const ShardCommand& options) {
  ShardPlan plan = read_plan(options.plan);
  const int count = static_cast<int>(plan.shards.size());
  if (options.shards != count || options.shard > count) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--shard {}/{}: {} has shards 1/{} to {}/{}", options.shard,
                                                         options.shards, options.plan, count, count, count));
  }
  return plan;
}

std::string text_of_file(const std::string& path) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20U;
  const auto file = open_file_source(path);
  if (file->size_bytes() > kMostBytes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: is no plan: it has {} bytes", path, file->size_bytes()));
  }
  const std::vector<std::byte> bytes = SourceBytes(*file, 0, file->size_bytes()).take();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The plan's conversion, with what is this machine's own.
ConvertCommandOptions conversion_of(const ShardCommand& command, const ShardPlan& plan) {
  Arguments again = plan.arguments;
  again.insert(again.begin(), {"--write", command.plan});
  std::optional<ConvertCommandOptions> options = parse_convert(again, ConvertLine::kPlan);
  if (!options) throw Error(ErrorCode::kCorrupt, command.plan + ": its arguments make no conversion");
  options->work = command.work;
  share_memory(*options);
  if (options->work.scratch_folder.empty()) options->work.scratch_folder = folder_of(command.output);
  options->convert.strict = command.common.strict;
  options->convert.overwrite = command.overwrite;
  options->convert.resume = !command.overwrite;
  return std::move(*options);
}

/// A line that the log of a scheduler can be searched for.
void print_shard(const ShardCommand& options, const char* status, const ConvertSummary* summary) {
  StandardOutput out;
  const std::uint64_t bytes = std::filesystem::file_size(options.output);
  const std::uint64_t peak = peak_memory_bytes();
  if (options.common.json) {
    ordered_json document = {{"plan", options.plan},     {"shard", options.shard}, {"shards", options.shards},
                             {"output", options.output}, {"status", status},       {"archive_bytes", bytes},
                             {"peak_memory_bytes", peak}};
    if (summary != nullptr) {
      document["tiles_written"] = summary->tiles_written;
      document["seconds"] = summary->seconds;
      document["warnings"] = summary->warnings;
    }
    out.write(json_text(document));
  } else if (!options.common.quiet) {
    const std::string shard = fmt::format("shard {}/{} {}: {}", options.shard, options.shards, status, options.output);
    out.write(summary == nullptr ? fmt::format("{}, {}\n", shard, describe_bytes(bytes))
                                 : fmt::format("{}, {} tiles, {}, {}, {} of memory at most\n", shard,
                                               describe_count(summary->tiles_written), describe_bytes(bytes),
                                               describe_seconds(summary->seconds), describe_bytes(peak)));
  }
  out.finish();
}

}  // namespace

bool looks_like_plan(const std::string& path) {
  const std::vector<std::byte> head = head_of_file(path, 1);
  return !head.empty() && head.front() == std::byte{'{'};
}

ShardPlan read_plan(const std::string& path) {
  const std::string text = text_of_file(path);
  try {
    return parse_shard_plan(text);
  } catch (const Error& error) {
    throw error.within(path);
  }
}

int write_plan(const Arguments& arguments) {
  std::optional<ConvertCommandOptions> options = parse_convert(arguments, ConvertLine::kPlan);
  if (!options) return kExitDone;
  check_plan_output(options->inputs.names, options->plan, options->convert.overwrite);
  const Prepared prepared = prepare(*options, expand_inputs(options->inputs.names, options->inputs.recursive));
  std::optional<ProgressDisplay> display(std::in_place, options->work.progress, options->common.quiet,
                                         options->common.verbose);
  ShardPlan plan = plan_shards(*prepared.source, options->convert, options->shards, job_from(options->work, *display));
  display.reset();
  print_warnings(plan.warnings);
  plan.arguments = recorded(arguments);
  write_output(options->plan, format_shard_plan(plan), options->convert.overwrite);
  StandardOutput out;
  const std::int64_t shards = static_cast<std::int64_t>(plan.shards.size());
  if (options->common.json) {
    out.write(json_text({{"plan", options->plan},
                         {"shards", shards},
                         {"tile_columns", plan.tile_columns},
                         {"tile_rows", plan.tile_rows}}));
  } else if (!options->common.quiet) {
    out.write(fmt::format("{:<12} {}: {} shards of {} x {} tiles{}\n", "plan", options->plan, describe_count(shards),
                          plan.tile_columns, plan.tile_rows,
                          shards < options->shards ? fmt::format("; there are no rows for {}", options->shards) : ""));
  }
  out.finish();
  return kExitDone;
}

int convert_shard_of(const Arguments& arguments) {
  const auto command = parse_shard(arguments);
  if (!command) return kExitDone;
  const ShardPlan plan = read_plan_of(*command);
  if (!command->overwrite && is_shard(command->output, plan, command->shard)) {
    print_shard(*command, "done already", nullptr);
    return kExitDone;
  }
  ConvertCommandOptions options = conversion_of(*command, plan);
  check_archive_output(options.inputs.names, command->output, command->overwrite);
  const Prepared prepared = prepare(options, expand_inputs(options.inputs.names, options.inputs.recursive));
  std::optional<ProgressDisplay> display(std::in_place, command->work.progress, command->common.quiet,
                                         command->common.verbose);
  const ConvertSummary summary = [&] {
    try {
      return convert_shard(*prepared.source, plan, command->shard, command->output, options.convert,
                           job_from(command->work, *display));
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCancelled) throw;
      throw interrupted(command->output, "the same command");
    }
  }();
  display.reset();
  print_warnings(summary.warnings);
  print_shard(*command, "done", &summary);
  return kExitDone;
}

}  // namespace isohf::cli
