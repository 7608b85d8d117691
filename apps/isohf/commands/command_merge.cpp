/// isohf merge: archives that share a lattice become one.

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "commands/shards.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/part_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kMergeFooter =
    R"(Of a tile that several archives hold, the last one gives it. Tiles are copied as they are. Every archive is read
and checked before anything is written, and all that is wrong is said at once.

Examples:
  isohf merge land.plan part-*.isohf -o land.isohf     the shards of a plan, to the bytes of one run
  isohf merge land.plan part-*.isohf --missing         which shards are to be made (again)
  isohf merge west.isohf east.isohf -o land.isohf      what isohf extract cut
  isohf merge land.isohf newer.isohf -o update.isohf   tiles of newer.isohf over those of land.isohf)";

struct MergeCommand {
  CommonOptions common;
  WorkOptions work;
  std::vector<std::string> archives;
  std::string output;
  std::string plan;  ///< empty: archives alone
  bool missing = false;
  bool overwrite = false;
};

std::optional<MergeCommand> parse_merge(const Arguments& arguments) {
  MergeCommand options;
  CommandLine line("merge", "Joins archives that share a lattice: parts, or an update and what it updates.");
  line.group("Arguments");
  line.positionals("[PLAN] ARCHIVE...", "Archives to join, the older before the newer; or a plan and its shards",
                   options.archives);
  line.option("-o,--output", "OUTPUT", "Archive to write", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.flag("--missing", "Print the numbers of the plan's shards that are missing or damaged, and write nothing",
            options.missing);
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kMergeFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archives);
  if (looks_like_plan(options.archives.front())) {
    options.plan = options.archives.front();
    options.archives.erase(options.archives.begin());
  }
  if (options.missing && options.plan.empty())
    throw Error(ErrorCode::kInvalidArgument, "merge: --missing needs a plan before the archives");
  if (options.missing) return options;
  line.require("OUTPUT (-o)", options.output);
  return options;
}

/// All archives stay open; shells allow a thousand files, systems many more.
void allow_open_files(std::size_t files) {
  struct rlimit limit {};
  const rlim_t needed = files + 64;
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= needed) return;
  limit.rlim_cur = std::min(limit.rlim_max, needed);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

/// An empty line where none is missing.
int print_missing(const MergeCommand& options, const ShardPlan& plan) {
  ProgressDisplay display(options.work.progress, options.common.quiet, options.common.verbose);
  const std::vector<int> missing = missing_shards(plan, options.archives, job_from(options.work, display));
  display.clear();
  StandardOutput out;
  if (options.common.json) {
    out.write(json_text({{"plan", options.plan}, {"shards", plan.shards.size()}, {"missing", missing}}));
  } else {
    out.write(shard_list(missing) + "\n");
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_merge(const Arguments& arguments) {
  const auto options = parse_merge(arguments);
  if (!options) return kExitDone;
  allow_open_files(options->archives.size());
  std::optional<ShardPlan> plan;
  if (!options->plan.empty()) plan = read_plan(options->plan);
  if (options->missing) return print_missing(*options, *plan);
  check_archive_output(options->archives, options->output, options->overwrite);
  return print_part(options->output, options->common, options->work, [&](const Job& job) {
    const PartOptions how{options->overwrite, options->common.strict};
    if (plan) return merge_shards(*plan, options->archives, options->output, how, job);
    return merge_archives(options->archives, options->output, how, job);
  });
}

}  // namespace isohf::cli
