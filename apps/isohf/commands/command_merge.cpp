/// isohf merge: the shards of a conversion become its archive.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "isohf/shards.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/part_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kMergeFooter =
    R"(The archive has the bytes of a single run. Every shard is read and checked before anything is written, and all that
is wrong is printed at once.

Examples:
  isohf merge part-*.isohf -o land.isohf     the shards of isohf convert --shard
  isohf merge part-*.isohf --missing         which shards are to be made (again))";

struct MergeCommand {
  CommonOptions common;
  WorkOptions work;
  std::vector<std::string> shards;
  std::string output;
  bool missing = false;
  bool overwrite = false;
};

std::optional<MergeCommand> parse_merge(const Arguments& arguments) {
  MergeCommand options;
  CommandLine line("merge", "Joins the shards of a conversion to its archive.");
  line.group("Arguments");
  line.positionals("SHARD...", "Shards of isohf convert --shard, in any order", options.shards);
  line.option("-o,--output", "OUTPUT", "Archive to write", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.flag("--missing", "Print the numbers of the shards that are missing or damaged, and write nothing",
            options.missing);
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kMergeFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("SHARD", options.shards);
  if (!options.missing) line.require("OUTPUT (-o)", options.output);
  return options;
}

/// An empty line if none is missing.
int print_missing(const MergeCommand& options) {
  ProgressDisplay display(options.work.progress, options.common.quiet, options.common.verbose);
  const MissingShards missing = missing_shards(options.shards, job_from(options.work, display));
  display.clear();
  StandardOutput out;
  if (options.common.json) {
    out.write(json_text({{"shards", missing.count}, {"missing", missing.numbers}}));
  } else {
    out.write(shard_list(missing.numbers) + "\n");
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_merge(const Arguments& arguments) {
  const auto options = parse_merge(arguments);
  if (!options) return kExitDone;
  if (options->missing) return print_missing(*options);
  check_archive_output(options->shards, options->output, options->overwrite);
  return print_part(options->output, options->common, options->work, [&](const Job& job) {
    return merge_shards(options->shards, options->output, {options->overwrite, options->common.strict}, job);
  });
}

}  // namespace isohf::cli
