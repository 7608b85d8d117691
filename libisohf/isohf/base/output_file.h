#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/base/file.h"

namespace isohf {

/// Looks at an output's name before any work, and returns the file behind it: links are followed, so that a link stays
/// and what it names is replaced. Throws, without the path, Error{kInvalidArgument}: "-"; a folder; no regular file; a
/// link to nothing; a file that exists, without `overwrite`; Error{kIo}: its folder is missing or may not be written.
[[nodiscard]] std::string output_place(const std::string& path, bool overwrite);

/// Throws Error{kIo} if `folder` is missing, not a folder, or not writable.
void require_writable_folder(const std::string& folder);

/// Looks, before any work, whether an output has room that takes so many bytes at least. Throws, without the path,
/// Error{kIo} where its file system has less; what NAME.part takes already counts as free, and what cannot be told as
/// enough.
void require_room(const std::string& path, double least_bytes);

/// What a file that exists holds in its first bytes, up to `most_bytes`; nothing where there is no regular file.
/// Throws, without the path, Error{kIo} where it cannot be read.
[[nodiscard]] std::vector<std::byte> head_of_file(const std::string& path, std::size_t most_bytes);

/// The one way in which a file is written: as NAME.part, locked against other writers, which gets the name in one step
/// when it is complete and on the disk.
///
/// Links are followed: NAME.part stands beside what they name. A file that is replaced hands its permissions on.
/// Destroyed before commit() or keep() it removes NAME.part. Errors carry no path. Not thread-safe.
class OutputFile {
 public:
  struct Options {
    bool overwrite = false;      ///< replace a file of that name
    bool keep_contents = false;  ///< of NAME.part, to go on where an earlier run ended; else it is emptied
    std::size_t buffer_bytes = std::size_t{64} << 10U;
  };

  /// Throws what output_place() throws; Error{kIo} where another process writes it.
  OutputFile(const std::string& path, const Options& options);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  [[nodiscard]] const std::string& path() const { return path_; }  ///< as it was given
  [[nodiscard]] const std::string& part_path() const { return part_path_; }
  [[nodiscard]] std::uint64_t position() const { return flushed_ + buffer_.size(); }  ///< where append() goes on
  [[nodiscard]] std::uint64_t size_on_disk() const { return file_.size_bytes(); }

  void append(std::span<const std::byte> bytes);
  void append(std::string_view text) { append(std::as_bytes(std::span(text))); }
  void flush();
  /// Writes anywhere; what reaches beyond position() moves it to its end.
  void write_at(std::uint64_t offset_bytes, std::span<const std::byte> bytes);
  /// What was flushed; returns how much of it there is.
  [[nodiscard]] std::size_t read_at(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
    return file_.read_at(offset_bytes, bytes);
  }
  /// Cuts the file; writing goes on there. What was appended and not flushed is dropped.
  void truncate(std::uint64_t size_bytes);
  /// Flushes everything to the disk.
  void sync();

  /// Flushes NAME.part to the disk and renames it. Without `overwrite` a file that has appeared meanwhile stays, and so
  /// does the finished NAME.part: Error{kIo}.
  void commit();
  /// Leaves NAME.part behind.
  void keep() { keeps_ = true; }
  /// Leaves NAME.part behind, complete, flushed and closed, for name_part().
  void complete();

 private:
  struct Rights {
    mode_t mode;
    uid_t owner;
    gid_t group;
  };

  void write(std::span<const std::byte> bytes);
  void hand_rights_on();

  std::string path_;
  std::string place_;  ///< with links followed
  std::string part_path_;
  bool overwrite_;
  std::optional<Rights> replaced_;  ///< of the file that is replaced
  std::vector<std::byte> buffer_;
  std::size_t buffer_bytes_;
  File file_;
  std::uint64_t flushed_ = 0;
  bool is_synced_ = false;  ///< nothing was written since the last sync()
  bool keeps_ = false;
};

/// Gives the part of a completed OutputFile its name. Throws as output_place() and commit() do.
void name_part(const std::string& path, bool overwrite);

/// Writes a whole file. Throws as OutputFile does, naming it.
void write_output(const std::string& path, std::string_view text, bool overwrite);

}  // namespace isohf
