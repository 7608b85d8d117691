#include "paging/texture_overview.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

namespace isohf::view {
namespace {

/// Texels of the whole on a side, at most: twice a screen's pixels.
constexpr std::int64_t kMostTexels = 2048;
/// Tiles asked for ahead.
constexpr std::size_t kInFlight = 64;

TextureChain load_level(const TileSource& source, const TextureRequest& request) {
  TextureChain chain{request, {}, {}};
  try {
    chain.levels.push_back(read_texels(source, request.tile, request.finest));
  } catch (const std::exception& error) {
    chain.error = error.what();
  }
  return chain;
}

}  // namespace

TextureOverview::TextureOverview(const TileSource& source, std::uint64_t memory_bytes)
    : source_(source), loader_([&source](const TextureRequest& request) { return load_level(source, request); }, 1) {
  const TextureInfo& info = *source.textures();
  const std::int64_t columns = source.grid().tile_columns();
  const std::int64_t rows = source.grid().tile_rows();
  const auto fits = [&](std::int64_t texels) {
    // Mip levels take a third more. The sides come first: 2048 squared is no overflow.
    return std::max(columns, rows) * texels <= kMostTexels &&
           static_cast<std::uint64_t>(columns * rows * texels * texels) * 16 / 3 <= memory_bytes;
  };
  for (int level = 0; level < info.levels && texels_ == 0; ++level) {
    if (fits(info.level_size(level))) texels_ = info.level_size(level);
  }
  if (texels_ == 0) {
    texture_ = Texture(nullptr);
    return;
  }
  end_ = to_come_ = columns * rows;
  const std::vector<std::uint8_t> nothing(static_cast<std::size_t>(end_ * texels_ * texels_ * 4));
  glBindTexture(GL_TEXTURE_2D, texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, static_cast<GLsizei>(columns * texels_),
               static_cast<GLsizei>(rows * texels_), 0, GL_RGBA, GL_UNSIGNED_BYTE, nothing.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glBindTexture(GL_TEXTURE_2D, 0);
}

void TextureOverview::request() {
  const TileGrid& grid = source_.grid();
  int level = 0;
  while (source_.textures()->level_size(level) > texels_) ++level;
  for (; next_ < end_ && loader_.in_flight() < kInFlight; ++next_) {
    const TileIndex tile{next_ % grid.tile_columns(), next_ / grid.tile_columns()};
    if (source_.has_texture(tile)) {
      loader_.request({tile, level});
    } else {
      --to_come_;
    }
  }
}

void TextureOverview::update(std::uint64_t upload_bytes) {
  if (to_come_ == 0) return;
  request();
  loader_.collect(waiting_);
  glBindTexture(GL_TEXTURE_2D, texture_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  const auto tile_bytes = static_cast<std::uint64_t>(texels_) * static_cast<std::uint64_t>(texels_) * 4;
  for (std::uint64_t gone = 0; !waiting_.empty() && (gone == 0 || gone + tile_bytes <= upload_bytes); --to_come_) {
    const TextureChain chain = std::move(waiting_.front());
    waiting_.pop_front();
    if (chain.levels.empty()) {
      if (!error_) error_ = chain.error;
      continue;
    }
    glTexSubImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(chain.request.tile.column * texels_),
                    static_cast<GLint>(chain.request.tile.row * texels_), texels_, texels_, GL_RGBA, GL_UNSIGNED_BYTE,
                    chain.levels.front().samples.data());
    gone += tile_bytes;
  }
  if (to_come_ == 0) {
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  }
  glBindTexture(GL_TEXTURE_2D, 0);
}

void TextureOverview::finish(const std::function<void()>& poll) {
  for (;;) {
    update(UINT64_MAX);
    if (to_come_ == 0) return;
    poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace isohf::view
