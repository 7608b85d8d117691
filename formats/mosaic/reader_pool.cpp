#include "formats/mosaic/reader_pool.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <utility>

#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::size_t kMostOpen = 64;
/// Left to the archive, its journal, the terminal, shared libraries and whatever the caller has open.
constexpr std::size_t kFilesForOthers = 32;

}  // namespace

std::size_t most_open_rasters() {
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kMostOpen;
  const auto allowed = static_cast<std::size_t>(limit.rlim_cur);
  return std::clamp<std::size_t>(allowed > kFilesForOthers ? allowed - kFilesForOthers : 1, 1, kMostOpen);
}

ReaderPool::ReaderPool(OpenOptions options) : options_(std::move(options)), most_open_(most_open_rasters()) {}

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

void ReaderPool::limit_idle(std::uint64_t bytes) {
  std::list<Idle> closed;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  most_idle_bytes_ = std::min(bytes, kMostIdleBytes);
  close_surplus(closed);
}

std::unique_ptr<HeightSource> ReaderPool::take(std::int64_t key, const MosaicMember& member) {
  std::list<Idle> closed;  // destroyed without the lock
  {
    const std::lock_guard lock(mutex_);
    ++lent_;
    if (const auto found = places_.find(key); found != places_.end()) {
      std::unique_ptr<HeightSource> reader = std::move(found->second->reader);
      idle_bytes_ -= found->second->bytes;
      idle_.erase(found->second);
      places_.erase(found);
      return reader;
    }
    ++times_opened_;
    while (!idle_.empty() && lent_ + idle_.size() > most_open_) close_oldest(closed);
  }
  closed.clear();
  try {
    require_unchanged(member.path, member.stamp);
    std::unique_ptr<HeightSource> reader = open_raster(member.path, options_);
    const SourceInfo& info = reader->info();
    if (info.width != member.width || info.height != member.height) {
      throw Error(ErrorCode::kIo, fmt::format("{}: has {}x{} samples and had {}x{} when the mosaic was planned; begin "
                                              "again",
                                              member.path, info.width, info.height, member.width, member.height));
    }
    return reader;
  } catch (...) {
    const std::lock_guard lock(mutex_);
    --lent_;
    throw;
  }
}

void ReaderPool::give_back(std::int64_t key, std::unique_ptr<HeightSource> reader) {
  std::list<Idle> closed;
  const std::uint64_t bytes = reader->buffer_bytes(UINT64_MAX);
  const std::lock_guard lock(mutex_);
  --lent_;
  idle_.push_back({key, std::move(reader), bytes});
  places_[key] = std::prev(idle_.end());
  idle_bytes_ += bytes;
  close_surplus(closed);
}

}  // namespace isohf
