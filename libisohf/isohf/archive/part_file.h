#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/file.h"

namespace isohf {

/// NAME.part: locked against other writers, written from front to back through one large buffer.
class PartFile {
 public:
  /// Opens or makes it. Throws Error{kIo} where another process is writing it.
  explicit PartFile(const std::string& path);

  [[nodiscard]] const std::string& path() const { return file_.path(); }
  [[nodiscard]] std::uint64_t position() const { return flushed_ + buffer_.size(); }
  [[nodiscard]] std::uint64_t size_on_disk() const { return file_.size_bytes(); }

  void append(std::span<const std::byte> bytes);
  void flush();
  /// Replaces bytes that were flushed.
  void overwrite(std::uint64_t offset_bytes, std::span<const std::byte> bytes) { file_.write_at(offset_bytes, bytes); }
  [[nodiscard]] std::size_t read_at(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
    return file_.read_at(offset_bytes, bytes);
  }
  /// Cuts the file; writing goes on there. The buffer must be empty.
  void truncate(std::uint64_t size_bytes);
  /// Flushes everything to the disk.
  void sync();
  void close() { file_.close(); }

 private:
  std::vector<std::byte> buffer_;
  File file_;
  std::uint64_t flushed_ = 0;
};

}  // namespace isohf
