#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/base/memory/kept_rows.h"

namespace isohf {

/// Bytes that are appended and read back; all but the last few MiB lie in a scratch file, which is made when they are
/// as many, if there is a folder for one. Throws Error{kIo}.
class SpillBuffer {
 public:
  explicit SpillBuffer(ScratchFolder folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::uint64_t size_bytes() const { return spilled_ + tail_.size(); }
  void append(std::span<const std::byte> bytes);
  void clear();
  /// Fills `out` with what was appended there.
  void read(std::uint64_t offset_bytes, std::span<std::byte> out) const;

 private:
  ScratchFolder folder_;
  File file_;
  std::uint64_t spilled_ = 0;
  std::vector<std::byte> tail_;
};

}  // namespace isohf
