#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/file.h"

namespace isohf {

/// Bytes that are appended and read back; all but the last few MiB lie in a scratch file, which is made when they are
/// as many. Throws Error{kIo}.
class SpillBuffer {
 public:
  explicit SpillBuffer(std::string folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::uint64_t size_bytes() const { return spilled_ + tail_.size(); }
  void append(std::span<const std::byte> bytes);
  /// Fills `out` with what was appended there.
  void read(std::uint64_t offset_bytes, std::span<std::byte> out) const;

 private:
  std::string folder_;
  File file_;
  std::uint64_t spilled_ = 0;
  std::vector<std::byte> tail_;
};

}  // namespace isohf
