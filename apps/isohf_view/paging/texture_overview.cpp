#include "paging/texture_overview.h"

#include <algorithm>
#include <exception>

#include "paging/texture_box.h"

namespace isohf::view {
namespace {

/// Texels of the whole on a side, at most: twice a screen's pixels.
constexpr std::int64_t kMostTexels = 2048;
constexpr std::size_t kRowsAhead = 2;

}  // namespace

TextureOverview::Strip TextureOverview::load(std::int64_t row) const {
  const std::int64_t columns = source_.grid().tile_columns();
  const int size = source_.textures()->level_size(level_);
  Strip strip{row, Picture(static_cast<int>(columns) * size, size, 4), {}};
  for (std::int64_t column = 0; column < columns; ++column) {
    if (!source_.has_texture({column, row})) continue;
    try {
      const Picture tile = read_texels(source_, {column, row}, level_);
      for (int r = 0; r < size; ++r) {
        std::copy_n(tile.row(r), tile.row_bytes(),
                    strip.texels.row(r) + static_cast<std::size_t>(column) * tile.row_bytes());
      }
    } catch (const std::exception& error) {
      if (strip.error.empty()) strip.error = error.what();
    }
  }
  return strip;
}

TextureOverview::TextureOverview(const TileSource& source, std::uint64_t memory_bytes, Workers& workers)
    : source_(source), loader_([this](const std::int64_t& row) { return load(row); }, workers) {
  const TextureInfo& info = *source.textures();
  const std::int64_t columns = source.grid().tile_columns();
  const std::int64_t rows = source.grid().tile_rows();
  const auto fits = [&](std::int64_t texels) {
    // Mip levels take a third more, rows on their way as much again. The sides come first: 2048 squared is no overflow.
    return std::max(columns, rows) * texels <= kMostTexels &&
           static_cast<std::uint64_t>(columns * rows * texels * texels) * 28 / 3 <= memory_bytes;
  };
  while (level_ < info.levels && !fits(info.level_size(level_))) ++level_;
  if (level_ == info.levels) {
    texture_ = Texture(nullptr);
    return;
  }
  const int size = info.level_size(level_);
  const Picture nothing(static_cast<int>(columns) * size, static_cast<int>(rows) * size, 4);
  glBindTexture(GL_TEXTURE_2D, texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, nothing.width, nothing.height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
               nothing.samples.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glBindTexture(GL_TEXTURE_2D, 0);
  rows_to_come_ = rows;
}

void TextureOverview::update(std::uint64_t upload_bytes) {
  if (is_whole()) return;
  // Few at a time: tiles and their own textures come first.
  while (next_row_ < source_.grid().tile_rows() && loader_.in_flight() < kRowsAhead) loader_.request(next_row_++);
  loader_.collect(waiting_);
  glBindTexture(GL_TEXTURE_2D, texture_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (std::uint64_t gone = 0; !waiting_.empty(); waiting_.pop_front(), --rows_to_come_) {
    const Strip& strip = waiting_.front();
    if (gone > 0 && gone + strip.texels.samples.size() > upload_bytes) break;
    if (!error_ && !strip.error.empty()) error_ = strip.error;
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, static_cast<GLint>(strip.row) * strip.texels.height, strip.texels.width,
                    strip.texels.height, GL_RGBA, GL_UNSIGNED_BYTE, strip.texels.samples.data());
    gone += strip.texels.samples.size();
  }
  if (is_whole()) {
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  }
  glBindTexture(GL_TEXTURE_2D, 0);
}

void TextureOverview::finish(const std::function<void()>& poll) {
  const auto is_complete = [&] {
    update(UINT64_MAX);
    return is_whole();
  };
  update_until_complete(is_complete, poll);
}

}  // namespace isohf::view
