#include "opening.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "formats/registry.h"
#include "interrupt.h"
#include "isohf/convert.h"
#include "output/standard_output.h"

namespace isohf::view {
namespace {

std::filesystem::path temporary_folder() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error)
    throw Error(ErrorCode::kIo, "needs a folder for temporary files, and TMPDIR names none: " + error.message());
  return folder;
}

/// Converts what is named where it is a raster; nullptr where it is none.
std::unique_ptr<ScratchArchive> convert_for_viewing(const std::string& name, const Options& options) {
  if (native_format_of(name, {}) == nullptr) return nullptr;
  const std::unique_ptr<HeightSource> source = open_raster(name, {});
  auto scratch = std::make_unique<ScratchArchive>();
  ConvertOptions request;
  request.overwrite = true;
  understand_ground(source->info(), request.plan.ground);
  Job job;
  job.scratch_folder = temporary_folder().string();
  job.threads = options.threads;
  job.cancel = &cli::watch_interrupts();
  const ConvertSummary summary = convert(*source, scratch->path(), request, job);
  if (options.common.quiet) return scratch;
  for (const Warning& warning : summary.warnings) cli::print_warning(warning);
  return scratch;
}

std::string next_path() {
  static int number = 0;
  return (temporary_folder() / fmt::format("isohf-view-{}-{}.isohf", ::getpid(), ++number)).string();
}

}  // namespace

ScratchArchive::ScratchArchive() : path_(next_path()) {}

ScratchArchive::~ScratchArchive() {
  std::error_code ignored;
  for (const char* ending : {"", ".part"}) std::filesystem::remove(path_ + ending, ignored);
}

FileStamp stamp_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return {};
  return {found.st_ino, found.st_size, found.st_mtim.tv_sec, found.st_mtim.tv_nsec};
}

Opened open_shown(const std::string& name, const Options& options, const std::string& second) {
  Opened opened{name, stamp_of(name), convert_for_viewing(name, options), nullptr};
  const std::string& path = opened.scratch ? opened.scratch->path() : name;
  if (second.empty()) {
    opened.source = open_archive(path);
  } else {
    const auto other = convert_for_viewing(second, options);
    opened.source = open_archive(path, other ? other->path() : second);  // an open file outlives its name
  }
  return opened;
}

}  // namespace isohf::view
