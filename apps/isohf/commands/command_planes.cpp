/// isohf planes: gives an archive the coarse planes by which it is looked at from afar.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include <optional>

#include "commands/command.h"
#include "isohf/base/file.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "open_archive.h"
#include "options/describe.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kPlanesFooter =
    R"(convert writes coarse planes by itself, unless --no-planes was given; archives of older versions have none.
Tiles are copied as they are, and so is everything else; the content hash stays the same. Planes that are there
already are made anew.

Examples:
  isohf planes dem.isohf                 in place: replaced once the new archive is whole
  isohf planes dem.isohf -o out.isohf)";

struct PlanesCommand {
  CommonOptions common;
  WorkOptions work;
  std::string archive;
  std::string output;
  bool overwrite = false;
};

std::optional<PlanesCommand> parse_planes(const Arguments& arguments) {
  PlanesCommand options;
  CommandLine line("planes", "Adds coarse planes to an archive, so that it can be looked at from afar.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "Archive that is to have them", options.archive);
  line.option("-o,--output", "OUTPUT", "Archive to write (default: ARCHIVE itself)", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  add_work_options(line, options.work);
  add_memory_options(line, "OUTPUT's folder", options.work);
  add_common_options(line, options.common);
  line.footer(kPlanesFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  if (options.output.empty()) options.output = options.archive;
  if (options.work.scratch_folder.empty()) options.work.scratch_folder = folder_of(options.output);
  return options;
}

int run(const PlanesCommand& options) {
  const CommonOptions& common = options.common;
  ProgressDisplay display(options.work.progress, common.quiet, common.verbose);
  const AddPlanesSummary summary =
      add_planes(options.archive, options.output, options.overwrite, job_from(options.work, display));
  display.clear();
  StandardOutput out;
  if (common.json) {
    out.write(json_text({{"archive", options.output},
                         {"stride", summary.planes.stride},
                         {"planes", summary.planes.count},
                         {"plane_tiles", summary.tiles},
                         {"plane_bytes", summary.plane_bytes},
                         {"archive_bytes", summary.archive_bytes},
                         {"archive_bytes_before", summary.archive_bytes_before}}));
  } else if (!common.quiet) {
    out.write(fmt::format("{:<12} {}: {}\n", "archive", options.output, describe_bytes(summary.archive_bytes)));
    out.write(fmt::format(
        "{:<12} {}\n", "planes",
        summary.planes.count == 0
            ? "none: one tile is all, or the tiles' shape allows none"
            : fmt::format("{}, each of every {}th vertex of the one before; {} tiles, {}", summary.planes.count,
                          summary.planes.stride, describe_count(summary.tiles), describe_bytes(summary.plane_bytes))));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_planes(const Arguments& arguments) {
  const auto options = parse_planes(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
