#include "formats/reader_pool.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr std::size_t kMostOpen = 64;
/// Left to the archive, its journal, the terminal, shared libraries and whatever the caller has open.
constexpr std::size_t kFilesForOthers = 32;
/// What readers that nobody uses may keep of decoded blocks.
constexpr std::uint64_t kMostIdleBytes = std::uint64_t{256} << 20U;
/// Readers keep two rows of blocks, or this much where that is more.
constexpr std::uint64_t kReaderCacheBytes = std::uint64_t{16} << 20U;

/// At most so many bytes of samples does a reader keep.
std::uint64_t memory_of(const SourceInfo& info) {
  const auto row_bytes = static_cast<std::uint64_t>(info.width) * size_bytes(info.sample_type);
  const std::uint64_t blocks = 2 * static_cast<std::uint64_t>(std::max<std::int64_t>(info.block_height, 1)) * row_bytes;
  return std::min(static_cast<std::uint64_t>(info.height) * row_bytes, std::max(kReaderCacheBytes, blocks));
}

}  // namespace

std::size_t most_open_rasters() {
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kMostOpen;
  const auto allowed = static_cast<std::size_t>(limit.rlim_cur);
  return std::clamp<std::size_t>(allowed > kFilesForOthers ? allowed - kFilesForOthers : 1, 1, kMostOpen);
}

FileStamp FileStamp::of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    throw Error(ErrorCode::kIo, path + ": " + (errno == ENOENT ? "no such file" : std::strerror(errno)));
  }
  return {static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

ReaderPool::ReaderPool(OpenOptions options) : options_(std::move(options)), most_open_(most_open_rasters()) {}

void ReaderPool::close_oldest(std::list<Idle>& closed) {
  idle_bytes_ -= idle_.front().bytes;
  places_.erase(idle_.front().key);
  closed.splice(closed.end(), idle_, idle_.begin());
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
    if (!(FileStamp::of(member.path) == FileStamp{member.size_bytes, member.changed_s, member.changed_ns})) {
      throw Error(ErrorCode::kIo, member.path + ": was changed while the mosaic was being read; begin again");
    }
    std::unique_ptr<HeightSource> reader = open_source(member.path, options_);
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
  const std::uint64_t bytes = memory_of(reader->info());
  const std::lock_guard lock(mutex_);
  --lent_;
  idle_.push_back({key, std::move(reader), bytes});
  places_[key] = std::prev(idle_.end());
  idle_bytes_ += bytes;
  while (lent_ + idle_.size() > most_open_ || (idle_bytes_ > kMostIdleBytes && idle_.size() > 1)) close_oldest(closed);
}

}  // namespace isohf
