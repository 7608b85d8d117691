#pragma once

#include <cstdint>
#include <string>

namespace isohf {

/// Tells one state of a file from another: which file it is, its size and when it was changed last.
struct FileStamp {
  std::uint64_t device = 0;
  std::uint64_t inode = 0;
  std::uint64_t size_bytes = 0;
  std::int64_t changed_s = 0;
  std::int64_t changed_ns = 0;

  /// Of an archive where `path` names a member of it (packed_files.h). Throws Error{kIo} naming the path.
  [[nodiscard]] static FileStamp of(const std::string& path);
  friend bool operator==(const FileStamp&, const FileStamp&) = default;

  /// Size and time as text, for fingerprints: copies that keep their time count as the same.
  [[nodiscard]] std::string text() const;
};

/// Throws Error{kIo} where the file at `path` is not in the state any more in which it was opened.
void require_unchanged(const std::string& path, const FileStamp& opened);

}  // namespace isohf
