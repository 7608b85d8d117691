/// isohf merge: the shards of a conversion become its archive.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "commands/command.h"
#include "isohf/shards.h"
#include "options/command_line.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/part_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kMergeFooter =
    R"(The archive has the bytes of a single run. All shards are checked before anything is written, and all problems
are printed at once.

Examples:
  isohf merge part-*.isohf -o land.isohf     join the shards of isohf convert --shard
  isohf merge part-*.isohf --missing         list the shards to make (again))";

struct MergeCommand {
  const Common& common;
  WorkOptions work{};
  std::vector<std::string> shards{};
  std::string output{};
  bool missing = false;
  bool overwrite = false;
};

/// As Slurm's --array reads them: an empty line if none is missing.
int print_missing(const MergeCommand& options) {
  ProgressDisplay display(options.common, options.work.progress);
  const MissingShards missing = missing_shards(options.shards, job_from(options.work, display));
  display.clear();
  StandardOutput out(options.common);
  out.write(options.common.json ? json_text({{"shards", missing.count}, {"missing", missing.numbers}})
                                : shard_list(missing.numbers) + "\n");
  out.finish();
  return kExitDone;
}

int run(const MergeCommand& options) {
  if (options.missing) return print_missing(options);
  if (options.output.empty()) throw Error(ErrorCode::kInvalidArgument, "no OUTPUT given. Use -o OUTPUT, or --missing");
  check_archive_output(options.shards, options.output, options.overwrite);
  return print_part(options.output, options.common, options.work, [&](const Job& job) {
    return merge_shards(options.shards, options.output, {options.overwrite, options.common.strict}, job);
  });
}

}  // namespace

Run add_merge(CLI::App& line, Common& common) {
  const auto options = std::make_shared<MergeCommand>(MergeCommand{common});
  positionals(line, "SHARD...", "Shards of isohf convert --shard, in any order", options->shards)->required();
  option(line, "-o,--output", "OUTPUT", "Archive to write", options->output);
  line.add_flag("--overwrite", options->overwrite, "Replace OUTPUT if it exists");
  line.add_flag("--missing", options->missing,
                "Print the numbers of the shards that are missing or damaged, and write nothing");
  add_work_options(line, options->work, common);
  line.footer(kMergeFooter);
  return [options] { return run(*options); };
}

}  // namespace isohf::cli
