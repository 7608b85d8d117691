#pragma once

#include <cstdint>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/job.h"
#include "options/command_line.h"
#include "output/progress.h"

namespace isohf::cli {

/// Options of commands that take a while.
struct WorkOptions {
  int threads = 0;                 ///< 0: all cores
  std::uint64_t memory_bytes = 0;  ///< 0: a quarter of the machine's
  std::string scratch_folder;
  ProgressMode progress = ProgressMode::kAuto;

  /// What a reader may keep of decoded samples (OpenOptions::buffer_bytes): an eighth of the memory, `wanted` at most.
  [[nodiscard]] std::uint64_t reader_bytes(std::uint64_t wanted) const;
};

/// -j alone.
void add_threads_option(CLI::App& line, int& threads);
/// -j, --progress.
void add_work_options(CLI::App& line, WorkOptions& options, Common& common);

/// --memory SIZE.
void add_memory_option(CLI::App& line, WorkOptions& options);

/// The folder for the scratch file that --memory may need: TMPDIR, or the output's folder if that is not set.
[[nodiscard]] std::string scratch_folder_for(const std::string& output);

/// Where files that are written keep what memory has no room for: nowhere where it is not bounded.
[[nodiscard]] ScratchFolder scratch_of(const WorkOptions& options);

/// A job with these threads and this memory.
[[nodiscard]] Job job_from(const WorkOptions& options);
/// The same, which `display` shows and an interrupt cancels.
[[nodiscard]] Job job_from(const WorkOptions& options, ProgressDisplay& display);

}  // namespace isohf::cli
