#include "paging/texture_loader.h"

#include <exception>
#include <utility>

namespace isohf::view {
namespace {

/// So that texels without colour lend none to their neighbours when the GPU filters.
void multiply_by_alpha(Picture& picture) {
  for (std::size_t i = 0; i < picture.samples.size(); i += 4) {
    const unsigned alpha = picture.samples[i + 3];
    if (alpha == 255) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.samples[i + c] = static_cast<std::uint8_t>((picture.samples[i + c] * alpha + 127) / 255);
    }
  }
}

}  // namespace

TextureLoader::TextureLoader(const TileSource& source, int workers) : source_(source) {
  for (int i = 0; i < workers; ++i) workers_.emplace_back([this] { work(); });
}

TextureLoader::~TextureLoader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void TextureLoader::request(TileIndex tile, int finest) {
  {
    const std::lock_guard lock(mutex_);
    wanted_.push_back({tile, finest, {}, {}});
  }
  wake_.notify_one();
}

void TextureLoader::collect(std::deque<TextureChain>& out) {
  const std::lock_guard lock(mutex_);
  for (TextureChain& chain : ready_) out.push_back(std::move(chain));
  ready_.clear();
}

TextureChain TextureLoader::load(TileIndex tile, int finest) const {
  TextureChain chain{tile, finest, {}, {}};
  try {
    for (int level = finest; level < source_.textures()->levels; ++level) {
      chain.levels.push_back(source_.read_texture(tile, level));
      multiply_by_alpha(chain.levels.back());
    }
  } catch (const std::exception& error) {
    chain.error = error.what();
    chain.levels.clear();
  }
  return chain;
}

void TextureLoader::work() {
  for (;;) {
    TextureChain wanted;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || !wanted_.empty(); });
      if (stop_) return;
      wanted = std::move(wanted_.front());
      wanted_.pop_front();
    }
    TextureChain loaded = load(wanted.tile, wanted.finest);
    const std::lock_guard lock(mutex_);
    ready_.push_back(std::move(loaded));
  }
}

}  // namespace isohf::view
