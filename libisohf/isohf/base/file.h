#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace isohf {

/// An open file descriptor whose every failure is one Error{kIo} naming path (or what it is called), deed and reason.
/// Movable, not copyable.
class File {
 public:
  enum class Mode {
    kRead,       ///< must exist
    kReadWrite,  ///< made where absent, kept where present; no symbolic link
  };

  File() = default;
  /// Throws Error{kIo}; a folder is refused.
  File(const std::string& path, Mode mode);
  /// A new file of `size_bytes` in `folder` that has no name and goes with its descriptor; its room is reserved where
  /// the file system can. path() is the folder's. Throws Error{kIo}.
  [[nodiscard]] static File scratch(const std::string& folder, std::uint64_t size_bytes);
  ~File();
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;

  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] std::uint64_t size_bytes() const;
  /// From here on errors say nothing of the path.
  void leave_path_to_caller() { name_.clear(); }

  /// Takes the exclusive advisory lock; false where another process holds it. A file system without locks gives no
  /// protection, but no reason to refuse either.
  [[nodiscard]] bool try_lock();
  /// True while `path()` still names this very file.
  [[nodiscard]] bool is_at_path() const;

  void write_at(std::uint64_t offset_bytes, std::span<const std::byte> bytes);
  /// Reads as many of the bytes as the file holds there; returns their number.
  [[nodiscard]] std::size_t read_at(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;
  void truncate(std::uint64_t size_bytes);
  void sync();                                                                 ///< data and size reach the disk
  void start_writeback(std::uint64_t offset_bytes, std::uint64_t size_bytes);  ///< a hint, never fails

 private:
  std::string path_;
  std::string name_;  ///< in errors
  int descriptor_ = -1;
};

/// Moves `from` to `to` in one step. Without `overwrite` an existing `to` is left alone and false is returned.
/// Throws Error{kIo} for anything else that goes wrong.
[[nodiscard]] bool rename_file(const std::string& from, const std::string& to, bool overwrite);

/// What the system calls this value of errno.
[[nodiscard]] std::string reason(int error_number);

/// The folder that a path lies in; "." for a bare name.
[[nodiscard]] std::string folder_of(const std::string& path);

/// Makes a rename in the folder of `path` durable, where the system lets it: the rename itself stands.
void sync_folder_of(const std::string& path);

/// Removes a file; an absent one is fine. Returns false where it could not be removed.
bool remove_file(const std::string& path) noexcept;

/// Opens the descriptors 0 to 2 that whoever started the program left closed, such that using them fails as before: no
/// file that is opened later gets the number of standard output or standard error. The first thing in main().
void occupy_standard_descriptors() noexcept;

}  // namespace isohf
