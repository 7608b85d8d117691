#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/byte_source.h"

namespace isohf {

/// Throws Error{kIo} where the source ends before a range does, which may be anything that a file claims.
void require_range(const ByteSource& source, std::uint64_t offset_bytes, std::uint64_t size_bytes);

/// Fills `out`. Throws Error{kIo} where the source ends before that, and what the source throws.
void read_exactly(const ByteSource& source, std::uint64_t offset_bytes, std::span<std::byte> out);

/// A range of a source: a view where the source has one, which must then outlive it, else a copy. Throws as
/// read_exactly().
class SourceBytes {
 public:
  SourceBytes() = default;
  SourceBytes(const ByteSource& source, std::uint64_t offset_bytes, std::uint64_t size_bytes);

  [[nodiscard]] std::span<const std::byte> bytes() const { return copy_.empty() ? view_ : copy_; }
  [[nodiscard]] std::vector<std::byte> take() &&;

 private:
  std::span<const std::byte> view_;
  std::vector<std::byte> copy_;
};

}  // namespace isohf
