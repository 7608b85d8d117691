#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace isohf {

/// A regular file open for reading at any offset, by several threads at once. Closes itself.
class RawFile {
 public:
  /// Throws Error{kIo} naming the path: missing, unreadable, not a regular file.
  explicit RawFile(const std::string& path);
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;
  ~RawFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  [[nodiscard]] int descriptor() const { return descriptor_; }

  /// Reads up to bytes.size() bytes at `offset_bytes`; returns how many there were before the end of the file.
  /// Throws Error{kIo}.
  std::size_t read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

  /// Fills `bytes`. Throws Error{kIo}, and Error{kCorrupt} where the file ends early.
  void read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const;

 private:
  std::string path_;
  int descriptor_ = -1;
  std::uint64_t size_bytes_ = 0;
};

/// Turns the byte order of every sample of `sample_bytes` (1, 2, 4 or 8) in place.
void swap_byte_order(std::span<std::byte> samples, std::size_t sample_bytes);

}  // namespace isohf
