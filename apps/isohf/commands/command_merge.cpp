/// isohf merge: archives that share a lattice become one.

#include <fmt/format.h>

#include <optional>

#include "commands/command.h"
#include "isohf/parts.h"
#include "options/options_common.h"
#include "output/output_kinds.h"
#include "output/part_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kFooter =
    R"(Of a tile that several archives hold, the last one gives it. Tiles are copied as they are. Every archive is read
and checked before anything is written, and all that is wrong is said at once.

Examples:
  isohf merge west.isohf east.isohf -o land.isohf      what isohf extract cut
  isohf merge land.isohf newer.isohf -o update.isohf   tiles of newer.isohf over those of land.isohf)";

struct MergeCommand {
  CommonOptions common;
  WorkOptions work;
  std::vector<std::string> archives;
  std::string output;
  bool overwrite = false;
};

std::optional<MergeCommand> parse(const Arguments& arguments) {
  MergeCommand options;
  CommandLine line("merge", "Joins archives that share a lattice: parts, or an update and what it updates.");
  line.group("Arguments");
  line.positionals("ARCHIVE...", "Archives to join, the older before the newer", options.archives);
  line.option("-o,--output", "OUTPUT", "Archive to write", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archives);
  line.require("OUTPUT (-o)", options.output);
  return options;
}

}  // namespace

int command_merge(const Arguments& arguments) {
  const auto options = parse(arguments);
  if (!options) return kExitDone;
  check_archive_output(options->archives, options->output, options->overwrite);
  return print_part(options->output, options->common, options->work, [&](const Job& job) {
    return merge_archives(options->archives, options->output, {options->overwrite, options->common.strict}, job);
  });
}

}  // namespace isohf::cli
