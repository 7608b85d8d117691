#include "formats/io/unpacked_folder.h"

#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <mutex>
#include <sstream>
#include <string_view>

#include "isohf/base/file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

/// In all folders of this process, and how many there were.
std::atomic<std::uint64_t> all_bytes = 0;
std::atomic<std::uint64_t> folders = 0;

void remove_folder(const fs::path& path) {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

/// When a process began, in ticks since the machine did; empty where there is none of that number, or no /proc.
std::string start_of(const std::string& process) {
  std::ifstream file("/proc/" + process + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  // The second field is a name in parentheses; the start is the 22nd.
  constexpr int kFieldsAfterName = 20;
  std::istringstream fields(text.substr(std::min(text.rfind(')') + 1, text.size())));
  std::string field;
  for (int i = 0; i < kFieldsAfterName && fields; ++i) fields >> field;
  return fields ? field : std::string();
}

/// How the names of all folders begin that processes of this host made, as far as their numbers mean the same.
std::string name_of_host() {
  std::array<char, 256> host{};
  (void)::gethostname(host.data(), host.size() - 1);
  struct stat numbers {};
  (void)::stat("/proc/self/ns/pid", &numbers);
  return fmt::format("isohf-unpacked_{}_{}_", host.data(), numbers.st_ino);
}

/// Removes folders of processes that were killed, as the class says.
void remove_abandoned(const fs::path& temporary, const std::string& of_host) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(temporary, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(of_host)) continue;
    const std::string process =
        name.substr(of_host.size(), name.find_first_not_of("0123456789", of_host.size()) - of_host.size());
    const std::string start = start_of(process);
    struct stat status {};
    const bool is_own = ::lstat(entry.path().c_str(), &status) == 0 && status.st_uid == ::geteuid();
    if (is_own && (start.empty() || !name.starts_with(fmt::format("{}{}_{}_", of_host, process, start))))
      remove_folder(entry.path());
  }
}

/// The one that is there, or a new one. Throws fs::filesystem_error.
std::shared_ptr<const fs::path> folder_of_process() {
  static std::mutex mutex;
  static std::weak_ptr<const fs::path> there;
  const std::lock_guard lock(mutex);
  if (auto found = there.lock()) return found;
  const fs::path temporary = fs::temp_directory_path();
  const std::string of_host = name_of_host();
  const std::string process = std::to_string(::getpid());
  const std::string start = start_of(process);
  if (!start.empty()) remove_abandoned(temporary, of_host);
  std::string name = (temporary / fmt::format("{}{}_{}_XXXXXX", of_host, process, start)).string();
  if (::mkdtemp(name.data()) == nullptr) throw fs::filesystem_error("", {errno, std::system_category()});
  const std::shared_ptr<const fs::path> made(new fs::path(name), [](const fs::path* path) {
    remove_folder(*path);
    delete path;
  });
  there = made;
  return made;
}

}  // namespace

UnpackedFolder::UnpackedFolder(const std::string& archive) : archive_(archive) {
  try {
    of_process_ = folder_of_process();
    path_ = *of_process_ / std::to_string(++folders);
    fs::create_directory(path_);
  } catch (const fs::filesystem_error& error) {
    throw Error(ErrorCode::kIo,
                fmt::format("{}: has no folder among the temporary files (TMPDIR) to be unpacked in: {}", archive,
                            error.code().message()));
  }
}

UnpackedFolder::~UnpackedFolder() {
  remove_folder(path_);
  all_bytes -= bytes_;
}

void UnpackedFolder::require_room(std::uint64_t bytes) const {
  std::error_code error;
  const fs::space_info space = fs::space(path_, error);
  if (error || bytes <= space.available) return;
  throw Error(ErrorCode::kIo, fmt::format("{}: takes {} bytes more to unpack, {} has room for {}; TMPDIR names another",
                                          archive_, bytes, of_process_->parent_path().string(), space.available));
}

void UnpackedFolder::add(const std::string& name, PackedFiles& files) {
  require_room(files.size_bytes());
  const std::string path = (path_ / name).string();
  std::uint64_t end = 0;
  try {
    File file(path, File::Mode::kReadWrite);
    files.read([&](std::uint64_t offset, std::span<const std::byte> block) {
      require_room(block.size());
      file.write_at(offset, block);
      end = std::max(end, offset + block.size());
    });
    file.truncate(end);  // zeros at the end are no block
  } catch (const Error& error) {
    if (!std::string_view(error.what()).starts_with(path)) throw;
    throw error.within(archive_ + ": cannot be unpacked");
  }
  bytes_ += end;
  all_bytes += end;
}

bool UnpackedFolder::has_room_to_stay() const {
  std::error_code error;
  const fs::space_info space = fs::space(path_, error);
  return !error && all_bytes <= space.available;
}

}  // namespace isohf
