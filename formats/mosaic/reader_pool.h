#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "formats/mosaic/mosaic_layout.h"
#include "isohf/raster.h"

namespace isohf {

/// How many rasters may be open at once: 64, or fewer where the system allows the process few open files.
[[nodiscard]] std::size_t most_open_rasters();

/// Opens a mosaic's members when they are read, and keeps the last used ones open within bounds of files and memory.
/// Any number of threads, each with a member of its own.
class ReaderPool {
 public:
  static constexpr std::uint64_t kMostIdleBytes = std::uint64_t{256} << 20U;

  explicit ReaderPool(OpenOptions options);

  /// The member's reader, for one thread until it is given back. `key` is the member's alone.
  /// Throws Error: kIo where the file is not what it was; else as open_raster does.
  [[nodiscard]] std::unique_ptr<HeightSource> take(std::int64_t key, const MosaicMember& member);
  void give_back(std::int64_t key, std::unique_ptr<HeightSource> reader);

  /// Readers that nobody uses keep no more than this; kMostIdleBytes to begin with.
  void limit_idle(std::uint64_t bytes);
  /// What every reader that is opened from now on may hold of packed contents (OpenOptions::unpacked_bytes).
  void limit_unpacked(std::uint64_t bytes) { options_.unpacked_bytes = bytes; }

  [[nodiscard]] std::size_t most_open() const { return most_open_; }
  [[nodiscard]] std::int64_t times_opened() const { return times_opened_; }  ///< for measurements

 private:
  struct Idle {
    std::int64_t key;
    std::unique_ptr<HeightSource> reader;
    std::uint64_t bytes;
  };
  void close_oldest(std::list<Idle>& closed);
  void close_surplus(std::list<Idle>& closed);

  OpenOptions options_;
  std::size_t most_open_;
  std::mutex mutex_;
  std::list<Idle> idle_;  ///< least recently used first
  std::unordered_map<std::int64_t, std::list<Idle>::iterator> places_;
  std::size_t lent_ = 0;
  std::uint64_t idle_bytes_ = 0;
  std::uint64_t most_idle_bytes_ = kMostIdleBytes;
  std::int64_t times_opened_ = 0;
};

}  // namespace isohf
