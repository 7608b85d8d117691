#include "isohf/base/read_ahead.h"

#include <algorithm>

namespace isohf {

std::span<const std::byte> ReadAhead::bytes(const ByteSource& source, std::uint64_t offset, std::uint64_t size) {
  const bool is_here =
      source_ == &source && offset >= offset_ && offset - offset_ + size <= static_cast<std::uint64_t>(piece_.size());
  if (!is_here) {
    source_ = nullptr;  // where reading fails
    const std::uint64_t end = std::min(source.size_bytes(), offset + std::max(size, kPieceBytes));
    piece_.resize(std::max(end, offset + size) - offset);
    read_exactly(source, offset, piece_);
    source_ = &source;
    offset_ = offset;
  }
  return std::span(piece_).subspan(offset - offset_, size);
}

std::size_t AheadSource::read(std::uint64_t offset_bytes, std::span<std::byte> out) const {
  const auto found = ahead_.bytes(source_, offset_bytes, out.size());
  std::copy(found.begin(), found.end(), out.begin());
  return out.size();
}

}  // namespace isohf
