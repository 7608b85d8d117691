#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "paging/tile_source.h"

namespace isohf::view {

/// A tile's texture from one level on, as a worker has decoded it.
struct TextureChain {
  TileIndex tile{};
  int finest = 0;               ///< the level that `levels` begins with
  std::vector<Picture> levels;  ///< RGBA, colours multiplied by alpha; empty where reading failed
  std::string error;
};

/// Worker threads that decode textures in the background. Only the thread that owns the loader calls it; no call waits
/// for a read.
class TextureLoader {
 public:
  /// workers >= 1
  TextureLoader(const TileSource& source, int workers);
  ~TextureLoader();
  TextureLoader(const TextureLoader&) = delete;
  TextureLoader& operator=(const TextureLoader&) = delete;

  void request(TileIndex tile, int finest);
  /// Moves what is ready to the end of `out`.
  void collect(std::deque<TextureChain>& out);

 private:
  void work();
  [[nodiscard]] TextureChain load(TileIndex tile, int finest) const;

  const TileSource& source_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<TextureChain> wanted_;  ///< tile and level alone
  std::vector<TextureChain> ready_;
  bool stop_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace isohf::view
