#include "options/work_options.h"

#include <algorithm>
#include <cstdlib>

#include "interrupt.h"
#include "isohf/base/file.h"
#include "isohf/base/memory/machine_memory.h"
#include "options/option_values.h"

namespace isohf::cli {

void add_threads_option(CLI::App& line, int& threads) {
  group(line, "Work");
  option(line, "-j,--threads", "N", "Use 1 to 1024 threads; the result is the same [default: all cores]",
         [&](const std::string& text) { threads = static_cast<int>(parse_whole_number(text, 1, 1024)); });
}

void add_work_options(CLI::App& line, WorkOptions& options, Common& common) {
  add_threads_option(line, options.threads);
  option(line, "--progress", "auto|plain|json|none",
         "Show progress: one line on a terminal, plain lines with -v, else nothing [default: auto]",
         [&](const std::string& text) {
           options.progress = static_cast<ProgressMode>(parse_word(text, {"auto", "plain", "json", "none"}));
           common.json_notes = options.progress == ProgressMode::kJson;
         });
}

void add_memory_option(CLI::App& line, WorkOptions& options) {
  option(line, "--memory", "SIZE",
         "Use at most SIZE of memory, as in 400M or 1.5GiB [default: a quarter of the machine's]",
         [&](const std::string& text) { options.memory_bytes = parse_bytes(text); });
}

std::uint64_t WorkOptions::reader_bytes(std::uint64_t wanted) const {
  const std::uint64_t bound = job_from(*this).bound_bytes();
  return bound == 0 ? wanted : std::min(wanted, bound / 8);
}

std::string scratch_folder_for(const std::string& output) {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : folder_of(output);
}

ScratchFolder scratch_of(const WorkOptions& options) {
  return options.memory_bytes == 0 ? std::nullopt : ScratchFolder(options.scratch_folder);
}

Job job_from(const WorkOptions& options) {
  Job job;
  job.threads = options.threads;
  job.memory_bytes = options.memory_bytes;
  job.machine_bytes = machine_memory_bytes();
  if (!options.scratch_folder.empty()) job.scratch_folder = options.scratch_folder;
  return job;
}

Job job_from(const WorkOptions& options, ProgressDisplay& display) {
  Job job = job_from(options);
  job.progress = [&display](const Progress& at) { display.update(at.stage, at.unit, at.done, at.total); };
  job.cancel = &watch_interrupts();
  return job;
}

}  // namespace isohf::cli
