#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tile_source.h"

namespace isohf::view {

/// A tile that a worker has decoded, or what went wrong.
struct LoadedTile {
  TileIndex tile{};
  std::vector<std::uint16_t> codes;  ///< empty where reading failed
  std::string error;
};

/// Worker threads that read tiles in the background. Only the thread that owns the loader calls it; no call waits for
/// a read.
class TileLoader {
 public:
  /// workers >= 1
  TileLoader(const TileSource& source, int workers);
  ~TileLoader();
  TileLoader(const TileLoader&) = delete;
  TileLoader& operator=(const TileLoader&) = delete;

  void request(TileIndex tile);
  /// Moves what is ready to the end of `out`.
  void collect(std::vector<LoadedTile>& out);
  /// Requests that have not been collected.
  [[nodiscard]] std::size_t in_flight() const { return in_flight_; }

 private:
  void work();

  const TileSource& source_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<TileIndex> wanted_;
  std::vector<LoadedTile> ready_;
  bool stop_ = false;
  std::size_t in_flight_ = 0;
  std::vector<std::thread> workers_;
};

}  // namespace isohf::view
