#include "formats/mosaic/reader_pool.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
ReaderPool::ReaderPool(OpenOptions options, std::uint64_t most_idle_bytes)
    : options_(std::move(options)), most_open_(most_open_rasters()), most_idle_bytes_(most_idle_bytes) {}

void ReaderPool::close_oldest(std::list<Idle>& closed) {
  idle_bytes_ -= idle_.front().bytes;
  places_.erase(idle_.front().key);
  closed.splice(closed.end(), idle_, idle_.begin());
}

void ReaderPool::close_surplus(std::list<Idle>& closed) {
  // One alone may keep more: it was allowed to while it was read.
  const auto too_much = [&] { return idle_bytes_ > most_idle_bytes_ && lent_ + idle_.size() > 1; };
  while (!idle_.empty() && (lent_ + idle_.size() > most_open_ || too_much())) close_oldest(closed);
}

std::unique_ptr<HeightSource> ReaderPool::take(const MosaicMember& member) {
  {
    std::list<Idle> closed;
    const std::lock_guard lock(mutex_);
    ++lent_;
    if (const auto found = places_.find(member.order); found != places_.end()) {
      std::unique_ptr<HeightSource> reader = std::move(found->second->reader);
      idle_bytes_ -= found->second->bytes;
      idle_.erase(found->second);
      places_.erase(found);
      return reader;
    }
    ++times_opened_;
    while (!idle_.empty() && lent_ + idle_.size() > most_open_) close_oldest(closed);
  }
  try {
    require_unchanged(member.path, member.stamp);
    std::unique_ptr<HeightSource> reader = open_raster(member.path, options_);
    const SourceInfo& info = reader->info();
    if (info.width == member.width && info.height == member.height) return reader;
    throw Error(ErrorCode::kIo,
                fmt::format("{}: has {}x{} samples and had {}x{} when the mosaic was planned; begin again", member.path,
                            info.width, info.height, member.width, member.height));
  } catch (...) {
    const std::lock_guard lock(mutex_);
    --lent_;
    throw;
  }
}

void ReaderPool::give_back(const MosaicMember& member, std::unique_ptr<HeightSource> reader) {
  std::list<Idle> closed;
  const std::uint64_t bytes = reader->buffer_bytes();
  const std::lock_guard lock(mutex_);
  --lent_;
  idle_.push_back({member.order, std::move(reader), bytes});
  places_[member.order] = std::prev(idle_.end());
  idle_bytes_ += bytes;
  close_surplus(closed);
}

}  // namespace isohf
