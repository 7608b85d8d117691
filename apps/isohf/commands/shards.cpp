/// One conversion on many machines: isohf convert --shard.

#include "commands/shards.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "input/input_files.h"
#include "isohf/error.h"
#include "isohf/shards.h"
#include "options/describe.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

/// A line that the log of a scheduler can be searched for.
void print_shard(const ConvertCommandOptions& options, const char* status, const ConvertSummary* summary) {
  StandardOutput out(options.common);
  const ShardNumber& shard = *options.shard;
  const std::uint64_t bytes = std::filesystem::file_size(options.output);
  const std::uint64_t peak = peak_memory_bytes();
  if (options.common.json) {
    ordered_json document = {{"shard", shard.number}, {"shards", shard.count},  {"output", options.output},
                             {"status", status},      {"archive_bytes", bytes}, {"peak_memory_bytes", peak}};
    if (summary != nullptr) {
      document["tiles_written"] = summary->tiles_written;
      document["seconds"] = summary->seconds;
      document["warnings"] = json_from(summary->warnings);
    }
    out.write(json_text(document));
  } else if (!options.common.quiet) {
    const std::string name = fmt::format("shard {}/{} {}: {}", shard.number, shard.count, status, options.output);
    out.write(summary == nullptr ? fmt::format("{}, {}\n", name, describe_bytes(bytes))
                                 : fmt::format("{}, {} tiles, {}, {}, {} of memory at most\n", name,
                                               describe_count(summary->tiles_written), describe_bytes(bytes),
                                               describe_seconds(summary->seconds), describe_bytes(peak)));
  }
  out.finish();
}

}  // namespace

int convert_shard_of(ConvertCommandOptions options) {
  const bool overwrite = options.convert.overwrite;
  // What is left of an interrupted run is continued, and a file that is there is looked at.
  options.convert.resume = !overwrite;
  check_archive_output(options.inputs.names, options.output, true);
  const Prepared prepared = prepare(options, expand_inputs(options.inputs.names, options.inputs.recursive));
  HeightSource& source = *prepared.source;
  std::error_code none;
  if (!overwrite && std::filesystem::exists(options.output, none) &&
      is_shard(options.output, source, *options.shard, options.convert)) {
    print_shard(options, "done already", nullptr);
    return kExitDone;
  }
  check_archive_output(options.inputs.names, options.output, overwrite);
  std::optional<ProgressDisplay> display(std::in_place, options.common, options.work.progress);
  const ConvertSummary summary = [&] {
    try {
      return convert_shard(source, *options.shard, options.output, options.convert, job_from(options.work, *display));
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCancelled) throw;
      throw interrupted(options.output, "the same command");
    }
  }();
  display.reset();
  print_warnings(options.common, summary.warnings);
  print_shard(options, "done", &summary);
  return kExitDone;
}

}  // namespace isohf::cli
