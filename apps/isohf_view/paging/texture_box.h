#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "gl/gl_objects.h"
#include "paging/background_loader.h"
#include "paging/tile_box.h"
#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

/// A tile's texture from the mip level `finest` on.
struct TextureRequest {
  TileIndex tile{};
  int finest = 0;
};

/// The same as a worker has decoded it.
struct TextureChain {
  TextureRequest request;
  std::vector<Picture> levels;  ///< RGBA, colours multiplied by alpha; empty where reading failed
  std::string error;
};

/// A level of a tile's texture as it is drawn: RGBA, colours multiplied by alpha, so that texels without colour lend
/// none to their neighbours when the GPU filters. Throws as TileSource::read_texture.
[[nodiscard]] Picture read_texels(const TileSource& source, TileIndex tile, int level);

/// What one update did, and where things stand.
struct TextureBoxFigures {
  std::uint64_t upload_bytes = 0;    ///< in this frame
  std::int64_t resident = 0;         ///< tiles with a texture on the GPU
  std::int64_t to_come = 0;          ///< tiles whose texture is not there, or not as fine as wanted
  std::uint64_t resident_bytes = 0;  ///< GPU and CPU bytes of textures: never above the bound
};

/// The textures of the tiles around the camera (docs/decisions/0015), each from the mip level on that its distance asks
/// for: one whose texels are no larger than pixels. A tile gets its coarse levels first, a few kilobytes, and the fine
/// ones when they are ready. Where memory does not hold what is wanted all tiles get coarser ones. Workers decode;
/// update() uploads within the frame's budget, row by row if need be, and never waits. Lives on the GL thread.
class TextureBox {
 public:
  /// The source has textures. Throws Error{kInvalidArgument} where memory_bytes does not hold a coarsest level on its
  /// way.
  TextureBox(const TileSource& source, std::uint64_t memory_bytes, int workers);

  /// Once a frame: keeps the textures of the tiles in `range` as the view wants them. At least a row of texels goes up.
  void update(const TileRange& range, const ViewState& view, std::uint64_t upload_bytes);
  /// Updates until all is there that is wanted: for pictures, not for frames.
  void finish(
      const TileRange& range, const ViewState& view, const std::function<void()>& poll = [] {});

  /// The GL texture of a tile; 0 where there is none (yet).
  [[nodiscard]] GLuint texture(TileIndex tile) const;
  [[nodiscard]] const TextureBoxFigures& figures() const { return figures_; }
  /// The first texture that could not be read, as a message.
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

  /// Bytes of a texture on the GPU from `level` on, RGBA.
  [[nodiscard]] std::uint64_t bytes_from(int level) const;

 private:
  struct Entry {
    TileIndex tile{};
    std::optional<Texture> texture;
    int finest = 0;  ///< of `texture`
    bool requested = false;
    bool broken = false;
    int wanted = 0;  ///< the number of levels: none
    double distance = 0.0;
  };
  /// A texture that goes up row by row.
  struct Upload {
    TextureChain chain;
    Texture texture;
    std::size_t level = 0;
    int row = 0;
  };

  void enter(const TileRange& range);
  void decide(const ViewState& view);
  void upload(std::uint64_t budget);
  /// True when all of it is there.
  bool upload_rows(Upload& work, std::uint64_t budget);
  void take(Upload& done);
  void request();
  bool request(Entry& entry, int finest);
  [[nodiscard]] static bool nearer(const Entry* a, const Entry* b);
  [[nodiscard]] bool fits(int finest) const;
  bool evict_one();
  void count();

  const TileSource& source_;
  int levels_;
  int finest_;  ///< finer levels are too large for the memory that there is
  int coarse_;  ///< the level that a tile begins with
  float anisotropy_;
  std::uint64_t resident_limit_;
  std::uint64_t on_the_way_limit_;
  std::uint64_t resident_bytes_ = 0;    ///< on the GPU
  std::uint64_t on_the_way_bytes_ = 0;  ///< of requests that are not yet resident, on the GPU in the end
  std::unordered_map<std::int64_t, Entry> entries_;
  std::deque<TextureChain> waiting_;
  std::optional<Upload> upload_;
  TextureBoxFigures figures_;
  std::optional<std::string> error_;
  BackgroundLoader<TextureRequest, TextureChain> loader_;  // last: its threads stop first
};

}  // namespace isohf::view
