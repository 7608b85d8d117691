#include "isohf/base/memory/spill_buffer.h"

#include <algorithm>

#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kTailBytes = std::size_t{4} << 20U;

}  // namespace

void SpillBuffer::append(std::span<const std::byte> bytes) {
  tail_.insert(tail_.end(), bytes.begin(), bytes.end());
  if (!folder_ || tail_.size() < kTailBytes) return;
  if (!file_.is_open()) file_ = File::scratch(*folder_, 0);
  file_.write_at(spilled_, tail_);
  spilled_ += tail_.size();
  tail_.clear();
}

void SpillBuffer::clear() {
  spilled_ = 0;
  tail_.clear();
}

void SpillBuffer::read(std::uint64_t offset_bytes, std::span<std::byte> out) const {
  ISOHF_ASSERT(offset_bytes <= size_bytes() && out.size() <= size_bytes() - offset_bytes);
  if (offset_bytes < spilled_) {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), spilled_ - offset_bytes));
    if (file_.read_at(offset_bytes, out.first(count)) != count)
      throw Error(ErrorCode::kIo, file_.path() + ": a scratch file there was cut");
    out = out.subspan(count);
    offset_bytes += count;
  }
  if (!out.empty())
    std::copy_n(tail_.begin() + static_cast<std::ptrdiff_t>(offset_bytes - spilled_), out.size(), out.begin());
}

}  // namespace isohf
