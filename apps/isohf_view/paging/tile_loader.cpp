#include "paging/tile_loader.h"

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

void TileLoader::request(const TileRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    wanted_.push_back(request);
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

LoadedTile TileLoader::load(const TileRequest& request) const {
  LoadedTile loaded;
  loaded.request = request;
  const auto vertices = static_cast<std::size_t>(source_.grid().shape().stored_vertex_count());
  const auto attempt = [&](auto&& read) {
    try {
      loaded.codes.resize(vertices);
      read();
      return true;
    } catch (const std::exception& error) {
      if (loaded.error.empty()) loaded.error = error.what();
      loaded.codes.clear();
      loaded.shadow.clear();
      return false;
    }
  };
  const bool lit = request.sun && attempt([&] {
                     loaded.shadow.resize(vertices);
                     source_.read_lit(request.tile, *request.sun, loaded.codes, loaded.shadow);
                   });
  // Broken seeds take nothing but the shadow away.
  if (!lit && request.codes) attempt([&] { source_.read(request.tile, loaded.codes); });
  if (!request.codes) loaded.codes = {};
  return loaded;
}

void TileLoader::work() {
  for (;;) {
    TileRequest request;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || !wanted_.empty(); });
      if (stop_) return;
      request = wanted_.front();
      wanted_.pop_front();
    }
    LoadedTile loaded = load(request);
    const std::lock_guard lock(mutex_);
    ready_.push_back(std::move(loaded));
  }
}

}  // namespace isohf::view
