#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "commands/command.h"
#include "isohf/raster.h"
#include "support/run_program.h"

namespace isohf::test {
namespace {

/// A file in memory, which stands for one of the standard streams.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : file_(::memfd_create(name, MFD_CLOEXEC)) {
    if (file_ < 0) throw std::runtime_error(std::string("memfd_create: ") + std::strerror(errno));
  }
  ~MemoryFile() { ::close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] int descriptor() const { return file_; }
  void fill(const std::string& text) const {
    if (::pwrite(file_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("a memory file took only a part");
  }
  [[nodiscard]] std::string text() const {
    std::string text(static_cast<std::size_t>(::lseek(file_, 0, SEEK_END)), '\0');
    if (::pread(file_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("a memory file gave only a part");
    return text;
  }

 private:
  int file_;
};

/// The working directory, while it lives.
class InDirectory {
 public:
  explicit InDirectory(const std::string& folder) {
    if (!folder.empty()) std::filesystem::current_path(folder);
  }
  ~InDirectory() {
    std::error_code ignored;
    std::filesystem::current_path(before_, ignored);
  }
  InDirectory(const InDirectory&) = delete;
  InDirectory& operator=(const InDirectory&) = delete;

 private:
  std::filesystem::path before_ = std::filesystem::current_path();
};

bool needs_process(const std::vector<std::string>& arguments, const RunOptions& options) {
  // isohf view becomes another program, and a peak of memory is that of a process.
  for (const std::string& word : arguments) {
    if (word == "view" || word == "--memory") return true;
  }
  return !options.output_path.empty() || options.close_output || options.file_size_limit_bytes ||
         options.address_space_bytes || options.open_files || options.without_privileges;
}

}  // namespace

RunResult run_isohf(const std::vector<std::string>& arguments, const RunOptions& options) {
  if (needs_process(arguments, options)) return run_program(with_more({isohf_path()}, arguments), options);
  // The modules are beside the program.
  static const bool has_modules = (set_module_folder(ISOHF_BIN_DIR), true);
  static_cast<void>(has_modules);
  const MemoryFile in("in");
  const MemoryFile out("out");
  const MemoryFile err("err");
  in.fill(options.input);
  cli::Common common;
  common.in = in.descriptor();
  common.out = out.descriptor();
  common.err = err.descriptor();
  const InDirectory here(options.folder);
  RunResult result;
  result.exit_code = cli::run(cli::kIsohf, arguments, common);
  // A long command catches interrupts; they end the test again.
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_DFL);
  result.out = out.text();
  result.err = err.text();
  return result;
}

}  // namespace isohf::test
