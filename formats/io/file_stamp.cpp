#include "formats/io/file_stamp.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>

#include "formats/io/packed_files.h"
#include "isohf/base/file.h"
#include "isohf/error.h"

namespace isohf {

FileStamp FileStamp::of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    const int error = errno;
    if (const auto member = error == ENOTDIR ? member_path(path) : std::nullopt) return of(member->archive);
    throw Error(ErrorCode::kIo, {path, error == ENOENT ? "no such file" : reason(error), "", ""});
  }
  return {status.st_dev, status.st_ino, static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec,
          status.st_mtim.tv_nsec};
}

std::string FileStamp::text() const {
  return fmt::format("{} bytes {}.{:09}", size_bytes, changed_s, changed_ns);
}

void require_unchanged(const std::string& path, const FileStamp& opened) {
  const FileStamp now = FileStamp::of(path);
  if (now == opened) return;
  const std::string sizes = now.size_bytes == opened.size_bytes
                                ? std::string()
                                : fmt::format(" ({} bytes, {} before)", now.size_bytes, opened.size_bytes);
  throw Error(ErrorCode::kIo, {path, "was changed or replaced while it was read" + sizes, "", "begin again"});
}

}  // namespace isohf
