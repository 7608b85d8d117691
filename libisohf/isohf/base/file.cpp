#include "isohf/base/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "isohf/error.h"

namespace isohf {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& deed, int error_number) {
  throw Error(ErrorCode::kIo, {path, deed + ": " + reason(error_number), "", ""});
}

}  // namespace

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

File::File(const std::string& path, Mode mode) : path_(path), name_(path) {
  const int flags = O_CLOEXEC | (mode == Mode::kRead ? O_RDONLY | O_NONBLOCK : O_RDWR | O_CREAT | O_NOFOLLOW);
  do {
    descriptor_ = ::open(path.c_str(), flags, 0666);
  } while (descriptor_ < 0 && errno == EINTR);
  if (descriptor_ < 0) fail(path, "cannot open", errno);
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  if (!known || S_ISDIR(status.st_mode)) {
    const int error_number = known ? EISDIR : errno;
    ::close(std::exchange(descriptor_, -1));
    fail(path, "cannot open", error_number);
  }
}

File File::scratch(const std::string& folder, std::uint64_t size_bytes) {
  File file;
  file.path_ = file.name_ = folder;
  file.descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file.descriptor_ < 0 && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL)) {  // no O_TMPFILE there
    std::string name = folder + "/isohf-scratch-XXXXXX";
    file.descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
    if (file.descriptor_ >= 0) ::unlink(name.c_str());
  }
  if (file.descriptor_ < 0) fail(folder, "cannot make a scratch file", errno);
  const int failed = ::posix_fallocate(file.descriptor_, 0, static_cast<off_t>(size_bytes));
  if (failed != 0 && failed != EINVAL && failed != EOPNOTSUPP) {
    fail(folder, fmt::format("cannot reserve {} bytes for a scratch file", size_bytes), failed);
  }
  return file;
}

File::~File() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

File::File(File&& other) noexcept
    : path_(std::move(other.path_)), name_(std::move(other.name_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

File& File::operator=(File&& other) noexcept {
  if (this != &other) {
    if (descriptor_ >= 0) ::close(descriptor_);
    path_ = std::move(other.path_);
    name_ = std::move(other.name_);
    descriptor_ = std::exchange(other.descriptor_, -1);
  }
  return *this;
}

std::uint64_t File::size_bytes() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail(name_, "cannot tell its size", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

bool File::try_lock() {
  int result = 0;
  do {
    result = ::flock(descriptor_, LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  return result == 0 || errno != EWOULDBLOCK;
}

bool File::is_at_path() const {
  struct stat by_path {};
  struct stat by_descriptor {};
  return ::stat(path_.c_str(), &by_path) == 0 && ::fstat(descriptor_, &by_descriptor) == 0 &&
         by_path.st_dev == by_descriptor.st_dev && by_path.st_ino == by_descriptor.st_ino;
}

void File::write_at(std::uint64_t offset_bytes, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset_bytes));
    if (done < 0) {
      if (errno == EINTR) continue;
      fail(name_, fmt::format("cannot write {} bytes at byte {}", bytes.size(), offset_bytes), errno);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(done));
    offset_bytes += static_cast<std::uint64_t>(done);
  }
}

std::size_t File::read_at(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  std::size_t total = 0;
  while (total < bytes.size()) {
    const ssize_t done =
        ::pread(descriptor_, bytes.data() + total, bytes.size() - total, static_cast<off_t>(offset_bytes + total));
    if (done < 0) {
      if (errno == EINTR) continue;
      fail(name_, fmt::format("cannot read at byte {}", offset_bytes + total), errno);
    }
    if (done == 0) break;
    total += static_cast<std::size_t>(done);
  }
  return total;
}

void File::truncate(std::uint64_t size_bytes) {
  int result = 0;
  do {
    result = ::ftruncate(descriptor_, static_cast<off_t>(size_bytes));
  } while (result != 0 && errno == EINTR);
  if (result != 0) fail(name_, "cannot set its size", errno);
}

void File::sync() {
  int result = 0;
  do {
    result = ::fsync(descriptor_);
  } while (result != 0 && errno == EINTR);
  if (result != 0 && errno != EINVAL && errno != ENOTSUP) fail(name_, "cannot flush to the disk", errno);
}

void File::start_writeback(std::uint64_t offset_bytes, std::uint64_t size_bytes) {
  static_cast<void>(::sync_file_range(descriptor_, static_cast<off_t>(offset_bytes), static_cast<off_t>(size_bytes),
                                      SYNC_FILE_RANGE_WRITE));
}

bool rename_file(const std::string& from, const std::string& to, bool overwrite) {
  const auto fail_rename = [&](int error_number) { fail(from, fmt::format("cannot rename to {}", to), error_number); };
  if (overwrite) {
    if (::rename(from.c_str(), to.c_str()) != 0) fail_rename(errno);
    return true;
  }
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) return false;
  if (errno != EINVAL && errno != ENOSYS && errno != ENOTSUP) fail_rename(errno);
  // A file system without RENAME_NOREPLACE: a hard link is refused just as well where the name is taken.
  if (::link(from.c_str(), to.c_str()) == 0) {
    if (::unlink(from.c_str()) != 0) fail(from, "cannot remove", errno);
    return true;
  }
  if (errno == EEXIST) return false;
  // One without hard links too: nothing but a look is left.
  struct stat status {};
  if (::lstat(to.c_str(), &status) == 0) return false;
  if (::rename(from.c_str(), to.c_str()) != 0) fail_rename(errno);
  return true;
}

void sync_folder_of(const std::string& path) {
  const int descriptor = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

bool remove_file(const std::string& path) noexcept {
  return ::unlink(path.c_str()) == 0 || errno == ENOENT;
}

void occupy_standard_descriptors() noexcept {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one. Opened the wrong way round: EBADF, as for what is closed.
    static_cast<void>(::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

}  // namespace isohf
