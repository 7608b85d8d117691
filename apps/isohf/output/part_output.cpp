#include "output/part_output.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "options/describe.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {

int print_part(const std::string& output, const CommonOptions& common, const WorkOptions& work,
               const std::function<PartSummary(const Job&)>& write) {
  std::optional<ProgressDisplay> display(std::in_place, work.progress, common.quiet, common.verbose);
  const PartSummary summary = write(job_from(work, *display));
  display.reset();
  print_warnings(summary.warnings);
  StandardOutput out;
  if (common.json) {
    out.write(json_text({{"archive", output},
                         {"tiles_stored", summary.tiles_stored},
                         {"archive_bytes", summary.archive_bytes},
                         {"content_sha256", summary.content_sha256},
                         {"warnings", summary.warnings}}));
  } else if (!common.quiet) {
    out.write(fmt::format("{:<12} {}: {}\n", "archive", output, describe_bytes(summary.archive_bytes)));
    out.write(fmt::format("{:<12} {} stored\n", "tiles", describe_count(summary.tiles_stored)));
  }
  out.finish();
  return kExitDone;
}

}  // namespace isohf::cli
