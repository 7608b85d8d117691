#include "opening.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include "formats/registry.h"
#include "interrupt.h"
#include "isohf/base/file.h"
#include "isohf/base/memory/machine_memory.h"
#include "isohf/convert.h"
#include "isohf/error.h"
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

/// An archive made of a raster, in a folder of its own that no other user can write to. The folder goes when this does,
/// and with it what a conversion may leave in it.
class ScratchArchive {
 public:
  ScratchArchive() : folder_((temporary_folder() / "isohf-view-XXXXXX").string()) {
    if (::mkdtemp(folder_.data()) == nullptr) {
      throw Error(ErrorCode::kIo, {temporary_folder().string(), reason(errno), "", "TMPDIR names another folder"});
    }
  }
  ~ScratchArchive() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ScratchArchive(const ScratchArchive&) = delete;
  ScratchArchive& operator=(const ScratchArchive&) = delete;
  [[nodiscard]] std::string path() const { return folder_ + "/shown.isohf"; }

 private:
  std::string folder_;
};

/// The archive that a raster is converted to.
std::unique_ptr<ScratchArchive> convert_for_viewing(const Options& options) {
  auto scratch = std::make_unique<ScratchArchive>();
  ConvertOptions request;
  request.overwrite = true;
  Job job;
  job.scratch_folder = temporary_folder().string();
  job.threads = options.threads;
  job.machine_bytes = machine_memory_bytes();
  job.cancel = &cli::watch_interrupts();
  const std::unique_ptr<HeightSource> source = open_raster(options.archive, {});
  understand_ground(source->info(), request.plan.ground);
  try {
    const std::vector<Warning> warnings = convert(*source, scratch->path(), request, job).warnings;
    if (!options.common.quiet) cli::print_warnings(options.common, warnings);
  } catch (const Error& error) {
    const std::string why = error.what();
    const std::size_t kept = why.find("; " + scratch->path() + ".part keeps");
    if (kept == std::string::npos) throw;
    // What is done goes when the program ends: nothing resumes it.
    throw Error(error.code(), why.substr(0, kept) + "; TMPDIR names another folder, with more room", error.parts());
  }
  return scratch;
}

}  // namespace

std::unique_ptr<TileSource> open_shown(const Options& options) {
  if (native_format_of(options.archive, {}) == nullptr) return open_archive(options.archive);
  // An open file outlives its name: what is converted leaves nothing behind, however the program ends.
  return open_archive(convert_for_viewing(options)->path(), options.archive);
}

}  // namespace isohf::view
