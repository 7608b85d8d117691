#include "output/part_output.h"

#include <fmt/format.h>

#include <optional>

#include "options/describe.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {

int print_part(const std::string& output, const Common& common, const WorkOptions& work,
               const std::function<PartSummary(const Job&)>& write) {
  std::optional<ProgressDisplay> display(std::in_place, common, work.progress);
  const PartSummary summary = write(job_from(work, *display));
  display.reset();
  print_warnings(common, summary.warnings);
  Report report;
  report.add("archive", output, "archive", fmt::format("{}: {}", output, describe_bytes(summary.archive_bytes)));
  report.add("tiles_stored", summary.tiles_stored, "tiles", describe_count(summary.tiles_stored) + " stored");
  report.add("archive_bytes", summary.archive_bytes);
  report.add("content_sha256", summary.content_sha256);
  report.add("warnings", json_from(summary.warnings));
  report.print(common);
  return kExitDone;
}

}  // namespace isohf::cli
