#include "formats/output_part.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "isohf/base/error.h"

namespace isohf {
namespace {

[[noreturn]] void fail(const std::string& what) {
  const int error = errno;
  throw Error(ErrorCode::kIo, fmt::format("{}: {}", what, std::strerror(error)));
}

[[noreturn]] void fail_exists() {
  throw Error(ErrorCode::kInvalidArgument, "exists already (--overwrite replaces it)");
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

OutputPart::OutputPart(const std::string& path, bool overwrite)
    : path_(path), part_path_(path + ".part"), overwrite_(overwrite) {
  struct stat status {};
  if (::stat(path_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw Error(ErrorCode::kInvalidArgument, "is a folder; name a file");
    if (!overwrite_) fail_exists();
  }
  file_ = ::open(part_path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) fail(fmt::format("cannot make {}", part_path_));
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
    ::close(file_);
    throw Error(ErrorCode::kIo, fmt::format("{} is being written by another process", part_path_));
  }
  if (::ftruncate(file_, 0) != 0) {
    const int error = errno;
    ::close(file_);
    errno = error;
    fail(fmt::format("cannot empty {}", part_path_));
  }
}

OutputPart::~OutputPart() {
  if (file_ < 0) return;
  ::unlink(part_path_.c_str());
  ::close(file_);
}

void OutputPart::commit() {
  if (::fsync(file_) != 0) fail("cannot be flushed to the disk");
  // Some file systems cannot refuse to replace; there the check made at the beginning has to do.
  int result = ::renameat2(AT_FDCWD, part_path_.c_str(), AT_FDCWD, path_.c_str(), overwrite_ ? 0U : RENAME_NOREPLACE);
  if (result != 0 && errno == EINVAL) result = ::rename(part_path_.c_str(), path_.c_str());
  if (result != 0 && errno == EEXIST) fail_exists();
  if (result != 0) fail(fmt::format("{} cannot be renamed", part_path_));
  ::close(file_);
  file_ = -1;
  // The name is on the disk when its folder is; where folders cannot be flushed there is nothing more to do.
  const int folder = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  ::fsync(folder);
  ::close(folder);
}

}  // namespace isohf
