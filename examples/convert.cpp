// Turns a raster of elevations into an archive of heightfield tiles, and checks it.
//   convert dem.tif dem.isohf
#include <cstdio>
#include <memory>

#include "isohf/isohf.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: convert RASTER ARCHIVE\n"), 2;
  try {
    const std::unique_ptr<isohf::HeightSource> source = isohf::open_raster(argv[1], {});
    isohf::ConvertOptions options;
    options.overwrite = true;
    options.max_error = 5.0;  // of every sample, in the raster's vertical units
    isohf::understand_ground(source->info(), options.plan.ground);

    isohf::Job job;
    job.progress = [](const isohf::Progress& at) {
      if (at.done == at.total) std::printf("%s: %lld %s\n", at.stage.c_str(), (long long)at.total, at.unit.c_str());
    };
    const isohf::ConvertSummary summary = isohf::convert(*source, argv[2], options, job);
    for (const isohf::Warning& warning : summary.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
    std::printf("%lld tiles, %llu bytes\n", (long long)summary.tiles_written,
                (unsigned long long)summary.archive_bytes);

    const isohf::VerifyReport report = isohf::verify_archive(argv[2]);
    for (const isohf::Finding& finding : report.findings) std::printf("%s\n", finding.text.c_str());
    return report.passed() ? 0 : 1;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
