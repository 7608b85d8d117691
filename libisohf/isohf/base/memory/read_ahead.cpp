#include "isohf/base/memory/read_ahead.h"

#include <algorithm>

namespace isohf {

std::span<const std::byte> ReadAhead::bytes(const ByteSource& source, std::uint64_t offset, std::uint64_t size) {
  require_range(source, offset, size);  // whatever is claimed, before room is made for it or sums of it are taken
  const bool is_here =
      source_ == &source && offset >= offset_ && offset - offset_ + size <= static_cast<std::uint64_t>(piece_.size());
  if (!is_here) {
    source_ = nullptr;  // where reading fails
    const std::uint64_t end = std::min(source.size_bytes(), offset + std::max(size, kPieceBytes));
    piece_.resize(end - offset);
    read_exactly(source, offset, piece_);
    source_ = &source;
    offset_ = offset;
  }
  return std::span(piece_).subspan(offset - offset_, size);
}

}  // namespace isohf
