#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/base/source_bytes.h"

namespace isohf {

/// Reads a source in large pieces, for ranges that ascend. One thread.
class ReadAhead {
 public:
  static constexpr std::uint64_t kPieceBytes = std::uint64_t{256} << 10U;

  /// The bytes of a range, until the next call. Throws as read_exactly().
  [[nodiscard]] std::span<const std::byte> bytes(const ByteSource& source, std::uint64_t offset, std::uint64_t size);

 private:
  const ByteSource* source_ = nullptr;
  std::uint64_t offset_ = 0;
  std::vector<std::byte> piece_;
};

}  // namespace isohf
