#include "output/part_output.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "options/describe.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {

std::string describe_tiles(const TileRange& tiles) {
  return fmt::format("columns {} to {}, rows {} to {}", tiles.first.column, tiles.end.column - 1, tiles.first.row,
                     tiles.end.row - 1);
}

int print_part(const std::string& output, const CommonOptions& common, const WorkOptions& work,
               const std::function<PartSummary(const Job&)>& write) {
  std::optional<ProgressDisplay> display(std::in_place, work.progress, common.quiet, common.verbose);
  const PartSummary summary = write(job_from(work, *display));
  display.reset();
  print_warnings(summary.warnings);
  StandardOutput out;
  if (common.json) {
    const TileRange& tiles = summary.tiles;
    out.write(json_text({{"archive", output},
                         {"columns", {tiles.first.column, tiles.end.column}},
                         {"rows", {tiles.first.row, tiles.end.row}},
                         {"whole", summary.is_whole},
                         {"same_as_whole", summary.same_as_whole},
                         {"tiles_stored", summary.tiles_stored},
                         {"archive_bytes", summary.archive_bytes},
                         {"content_sha256", summary.content_sha256},
                         {"warnings", summary.warnings}}));
  } else if (!common.quiet) {
    out.write(fmt::format("{:<12} {}: {}\n", "archive", output, describe_bytes(summary.archive_bytes)));
    out.write(fmt::format("{:<12} {}; {} stored\n", "tiles",
                          summary.is_whole ? "all of the lattice" : describe_tiles(summary.tiles) + ": a part",
                          describe_count(summary.tiles_stored)));
    if (summary.same_as_whole)
      out.write(fmt::format("{:<12} that of the archive that the parts were cut from\n", "content"));
  }
  out.finish();
  return kExitDone;
}

}  // namespace isohf::cli
