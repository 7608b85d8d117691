#include "options/options_common.h"

#include <algorithm>
#include <cstdlib>

#include "interrupt.h"
#include "isohf/base/file.h"
#include "machine_memory.h"
#include "options/option_values.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr int kMaxThreads = 1024;

}  // namespace

void add_common_options(CommandLine& line, CommonOptions& options) {
  line.group("Common");
  line.flag("--json", "Print one JSON document on standard output instead of text, of an error as well", options.json,
            [] { telling().json = true; });
  line.flag("-q,--quiet", "Print nothing but errors, and warnings of lost data", options.quiet,
            [] { telling().quiet = true; });
  line.flag("--strict", "Take warnings as errors: where one arises, nothing is written", options.strict,
            [] { telling().strict = true; });
  line.flag("-v,--verbose", "Say more, on standard error", options.verbose);
}

void add_threads_option(CommandLine& line, int& threads) {
  line.group("Work");
  line.option("-j,--threads", "N", "Threads, 1 to 1024 (default: all cores); the result does not depend on it",
              [&](const std::string& text) { threads = static_cast<int>(parse_whole_number(text, 1, kMaxThreads)); });
}

void add_work_options(CommandLine& line, WorkOptions& options) {
  add_threads_option(line, options.threads);
  line.option("--progress", "MODE",
              "auto: a bar on a terminal, plain lines with -v, else nothing; plain: lines; json: one object a line; "
              "none. On standard error (default auto)",
              [&](const std::string& text) {
                options.progress = static_cast<ProgressMode>(parse_word(text, {"auto", "plain", "json", "none"}));
                telling().json_notes = options.progress == ProgressMode::kJson;
              });
}

void add_memory_option(CommandLine& line, WorkOptions& options) {
  line.option("--memory", "SIZE",
              "Use at most SIZE of memory, to a tenth, as in 400M or 1.5GiB (default: a quarter of the machine's)",
              [&](const std::string& text) { options.memory_bytes = parse_bytes(text); });
}

std::uint64_t WorkOptions::unpacked_bytes(std::uint64_t wanted) const {
  const std::uint64_t bound = job_from(*this).bound_bytes();
  return bound == 0 ? wanted : std::min(wanted, bound / 3);
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
