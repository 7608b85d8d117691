#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "gl/gl_objects.h"
#include "paging/background_loader.h"
#include "paging/texture_box.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// One picture of all textures, which coarse planes are drawn with: of each tile the mip level of as many texels as the
/// whole has room for. Tiles appear in it as they are read. Lives on the GL thread.
class TextureOverview {
 public:
  /// The source has textures. Where memory_bytes does not hold even their coarsest level, there is no picture.
  TextureOverview(const TileSource& source, std::uint64_t memory_bytes);

  /// Once a frame: takes in what has been read, as far as the frame's budget goes.
  void update(std::uint64_t upload_bytes);
  /// Updates until all is there: for pictures, not for frames.
  void finish(const std::function<void()>& poll = [] {});

  [[nodiscard]] GLuint texture() const { return texture_.get(); }  ///< 0: none
  [[nodiscard]] std::int64_t to_come() const { return to_come_; }  ///< tiles
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  void request();

  const TileSource& source_;
  std::int64_t next_ = 0;  ///< tile to ask for, by rows
  std::int64_t end_ = 0;
  std::int64_t to_come_ = 0;
  int texels_ = 0;  ///< of a tile, on a side
  Texture texture_;
  std::deque<TextureChain> waiting_;
  std::optional<std::string> error_;
  BackgroundLoader<TextureRequest, TextureChain> loader_;  // last: its thread stops first
};

}  // namespace isohf::view
