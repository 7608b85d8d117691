#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "formats/inflated_bytes.h"

namespace isohf {

struct ZipMember;

/// Whether the name ends in .gz, in any case.
[[nodiscard]] bool is_gzip_name(const std::string& path);
/// The name without a .gz at its end.
[[nodiscard]] std::string without_gzip(const std::string& path);

/// A regular file open for reading at any offset, by several threads at once. Closes itself.
///
/// Of a file that is called .gz and is gzip, all members speak of what is inside; opening reads it once, and reading
/// backwards costs more than forwards (inflated_bytes.h).
class RawFile {
 public:
  /// Throws Error{kIo} naming the path: missing, unreadable, not a regular file; Error{kCorrupt}: damaged gzip data.
  explicit RawFile(const std::string& path);
  /// The contents of one member of a zip archive: stored or deflated, checked against size and CRC.
  /// Throws also Error{kUnsupported}: encrypted, or packed by another method.
  RawFile(const std::string& path, const ZipMember& member);
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;
  ~RawFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  /// Of the file as it is stored.
  [[nodiscard]] int descriptor() const { return descriptor_; }

  /// Reads up to bytes.size() bytes at `offset_bytes`; returns how many there were before the end of the file.
  /// Throws Error{kIo}.
  std::size_t read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

  /// Fills `bytes`. Throws Error{kIo}, and Error{kCorrupt} where the file ends early.
  void read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

 private:
  std::size_t read_stored(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;
  void inflate(std::uint64_t begin_bytes, std::uint64_t stored_bytes, InflatedBytes::Kind kind);

  std::string path_;
  int descriptor_ = -1;
  std::uint64_t begin_bytes_ = 0;  // of a stored zip member
  std::uint64_t size_bytes_ = 0;
  std::unique_ptr<InflatedBytes> inflated_;
  mutable std::mutex one_inflates_;
};

/// Turns the byte order of every sample of `sample_bytes` (1, 2, 4 or 8) in place.
void swap_byte_order(std::span<std::byte> samples, std::size_t sample_bytes);

}  // namespace isohf
