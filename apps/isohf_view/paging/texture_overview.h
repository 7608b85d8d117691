#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "gl/gl_objects.h"
#include "paging/background_loader.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// One picture of all textures, which coarse planes are drawn with: of each tile the mip level of as many texels as the
/// whole has room for. Rows of tiles appear in it as they are read. Lives on the GL thread.
class TextureOverview {
 public:
  /// The source has textures. Where memory_bytes does not hold even their coarsest level, there is no picture.
  TextureOverview(const TileSource& source, std::uint64_t memory_bytes, Workers& workers);

  /// Once a frame: takes in a row that has been read, or as many as the frame's budget holds.
  void update(std::uint64_t upload_bytes);
  /// Updates until all is there: for pictures, not for frames.
  void finish(const std::function<void()>& poll = [] {});

  [[nodiscard]] GLuint texture() const { return texture_.get(); }  ///< 0: none
  [[nodiscard]] bool is_whole() const { return rows_to_come_ == 0; }
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  /// A row of tiles.
  struct Strip {
    std::int64_t row = 0;
    Picture texels;
    std::string error;
  };
  [[nodiscard]] Strip load(std::int64_t row) const;

  const TileSource& source_;
  int level_ = 0;
  std::int64_t next_row_ = 0;  ///< to ask for
  std::int64_t rows_to_come_ = 0;
  Texture texture_;
  std::deque<Strip> waiting_;
  std::optional<std::string> error_;
  BackgroundLoader<std::int64_t, Strip> loader_;  // last: it stops first
};

}  // namespace isohf::view
