#include "opening.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include "formats/registry.h"
#include "interrupt.h"
#include "isohf/base/file.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "machine_memory.h"
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

/// Messages name settings between backticks: options of `isohf convert`, of which this program takes none.
constexpr const char* kWhoseOptions = "options named here are isohf convert's: convert with them, and view the archive";
bool names_options(const std::string& message) {
  return message.find('`') != std::string::npos;
}

/// Converts options.archive if it is a raster; nullptr if it is not.
std::unique_ptr<ScratchArchive> convert_for_viewing(const Options& options) {
  const std::string& name = options.archive;
  if (native_format_of(name, {}) == nullptr) return nullptr;
  auto scratch = std::make_unique<ScratchArchive>();
  ConvertOptions request;
  request.overwrite = true;
  Job job;
  job.scratch_folder = temporary_folder().string();
  job.threads = options.threads;
  job.machine_bytes = cli::machine_memory_bytes();
  job.cancel = &cli::watch_interrupts();
  std::vector<Warning> warnings;
  try {
    const std::unique_ptr<HeightSource> source = open_raster(name, {});
    understand_ground(source->info(), request.plan.ground);
    warnings = convert(*source, scratch->path(), request, job).warnings;
  } catch (const Error& error) {
    const std::string why = error.what();
    // What is done goes when the program ends: nothing resumes it.
    if (const std::size_t kept = why.find(fmt::format("; {}.part keeps", scratch->path())); kept != std::string::npos) {
      throw Error(error.code(), why.substr(0, kept) + "; TMPDIR names another folder, with more room", error.parts());
    }
    if (!names_options(why)) throw;
    throw Error(error.code(), fmt::format("{} ({})", why, kWhoseOptions), error.parts());
  }
  if (options.common.quiet) return scratch;
  cli::print_warnings(options.common, warnings);
  if (std::any_of(warnings.begin(), warnings.end(), names_options)) cli::print_warning(options.common, kWhoseOptions);
  return scratch;
}

/// An archive, or what neither that nor a raster is.
std::unique_ptr<TileSource> open_unconverted(const std::string& name) {
  try {
    return open_archive(name);
  } catch (const Error& error) {
    const bool is_called_archive = std::filesystem::path(name).extension() == ".isohf";
    if (is_called_archive || error.code() != ErrorCode::kCorrupt) throw;
    throw Error(error.code(),
                fmt::format("{}; nor is it a raster of a kind that is viewed: isohf formats lists those "
                            "that isohf convert reads",
                            error.what()),
                error.parts());
  }
}

}  // namespace

std::unique_ptr<TileSource> open_shown(const Options& options) {
  // An open file outlives its name: what is converted leaves nothing behind, however the program ends.
  const auto shown = convert_for_viewing(options);
  return shown ? open_archive(shown->path(), options.archive) : open_unconverted(options.archive);
}

}  // namespace isohf::view
