#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "paging/tile_source.h"

namespace isohf::view {

/// What a worker is to do: read a tile, compute its shadow heights, or both.
struct TileRequest {
  TileIndex tile{};
  bool codes = true;             ///< false: only its shadow is wanted
  std::optional<RowSun> sun;     ///< for shadow heights; nullopt: none
  std::uint64_t sun_number = 0;  ///< handed back
};

/// A tile that a worker has decoded, or what went wrong.
struct LoadedTile {
  TileRequest request;
  std::vector<std::uint16_t> codes;   ///< empty where reading failed, or where they were not wanted
  std::vector<std::uint16_t> shadow;  ///< empty where there is none, or no seeds could be read
  std::string error;

  [[nodiscard]] std::uint64_t bytes() const { return (codes.size() + shadow.size()) * sizeof(std::uint16_t); }
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

  void request(const TileRequest& request);
  /// Moves what is ready to the end of `out`.
  void collect(std::vector<LoadedTile>& out);
  /// Requests that have not been collected.
  [[nodiscard]] std::size_t in_flight() const { return in_flight_; }

 private:
  void work();
  [[nodiscard]] LoadedTile load(const TileRequest& request) const;

  const TileSource& source_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<TileRequest> wanted_;
  std::vector<LoadedTile> ready_;
  bool stop_ = false;
  std::size_t in_flight_ = 0;
  std::vector<std::thread> workers_;
};

}  // namespace isohf::view
