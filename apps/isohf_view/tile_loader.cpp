#include "tile_loader.h"

#include <exception>
#include <utility>

namespace isohf::view {

TileLoader::TileLoader(const TileSource& source, int workers) : source_(source) {
  for (int i = 0; i < workers; ++i) workers_.emplace_back([this] { work(); });
}

TileLoader::~TileLoader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void TileLoader::request(TileIndex tile) {
  {
    const std::lock_guard lock(mutex_);
    wanted_.push_back(tile);
  }
  ++in_flight_;
  wake_.notify_one();
}

void TileLoader::collect(std::vector<LoadedTile>& out) {
  const std::lock_guard lock(mutex_);
  in_flight_ -= ready_.size();
  for (LoadedTile& tile : ready_) out.push_back(std::move(tile));
  ready_.clear();
}

void TileLoader::work() {
  for (;;) {
    LoadedTile loaded;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || !wanted_.empty(); });
      if (stop_) return;
      loaded.tile = wanted_.front();
      wanted_.pop_front();
    }
    try {
      loaded.codes.resize(static_cast<std::size_t>(source_.grid().shape().stored_vertex_count()));
      source_.read(loaded.tile, loaded.codes);
    } catch (const std::exception& error) {
      loaded.codes.clear();
      loaded.error = error.what();
    }
    const std::lock_guard lock(mutex_);
    ready_.push_back(std::move(loaded));
  }
}

}  // namespace isohf::view
