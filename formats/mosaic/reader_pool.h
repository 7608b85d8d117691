#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "formats/mosaic/mosaic_plan.h"
#include "isohf/raster.h"

namespace isohf {

/// Opens a mosaic's members when they are read, and keeps the last used ones open within bounds of files and memory.
/// Any number of threads, each with a member of its own.
class ReaderPool {
 public:
  /// options.buffer_bytes: what one reader may keep. most_idle_bytes: what those that nobody uses may keep together.
  ReaderPool(OpenOptions options, std::uint64_t most_idle_bytes);

  /// The member's reader, for one thread until it is given back.
  /// Throws Error: kIo if the file is not what it was; else as open_raster does.
  [[nodiscard]] std::unique_ptr<HeightSource> take(const MosaicMember& member);
  void give_back(const MosaicMember& member, std::unique_ptr<HeightSource> reader);

  [[nodiscard]] std::size_t most_open() const { return most_open_; }
  [[nodiscard]] std::int64_t times_opened() const { return times_opened_; }  ///< for measurements

 private:
  struct Idle {
    std::int64_t key;  ///< MosaicMember::order
    std::unique_ptr<HeightSource> reader;
    std::uint64_t bytes;
  };
  /// Moves the reader that was not used for longest to `closed`, which is destroyed without the lock.
  void close_oldest(std::list<Idle>& closed);
  void close_surplus(std::list<Idle>& closed);

  OpenOptions options_;
  std::size_t most_open_;
  std::mutex mutex_;
  std::list<Idle> idle_;  ///< least recently used first
  std::unordered_map<std::int64_t, std::list<Idle>::iterator> places_;
  std::size_t lent_ = 0;
  std::uint64_t idle_bytes_ = 0;
  std::uint64_t most_idle_bytes_;
  std::int64_t times_opened_ = 0;
};

}  // namespace isohf
