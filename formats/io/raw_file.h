#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "isohf/base/file.h"

namespace isohf {

/// Whether a regular file is there; what cannot be looked at is none.
[[nodiscard]] bool is_file(const std::filesystem::path& path);

/// A regular file open for reading at any offset, by several threads at once. Closes itself.
class RawFile {
 public:
  /// Throws Error{kIo} naming the path: missing, unreadable, not a regular file.
  explicit RawFile(const std::string& path);

  [[nodiscard]] const std::string& path() const { return file_.path(); }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  [[nodiscard]] int descriptor() const { return file_.descriptor(); }

  /// Reads up to bytes.size() bytes at `offset_bytes`; returns how many there were before the end of the file.
  /// Throws Error{kIo}.
  std::size_t read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
    return file_.read_at(offset_bytes, bytes);
  }

  /// Fills `bytes`. Throws Error{kIo}, and Error{kCorrupt} where the file ends early.
  void read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

 private:
  File file_;
  std::uint64_t size_bytes_;  ///< when it was opened
};

/// The first `most_bytes` bytes of a file, fewer where it has fewer. Throws Error{kIo}.
[[nodiscard]] std::string first_bytes(const RawFile& file, std::uint64_t most_bytes);

/// ".tif" of dem.TIF, empty where a name has none.
[[nodiscard]] std::string extension_of(const std::string& path);

/// Turns the byte order of every sample of `sample_bytes` (1, 2, 4 or 8) in place.
void swap_byte_order(std::span<std::byte> samples, std::size_t sample_bytes);

}  // namespace isohf
