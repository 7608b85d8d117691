#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gl/gl_objects.h"
#include "paging/background_loader.h"
#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

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
/// for: one whose texels are no larger than pixels. Where memory does not hold what is wanted all tiles get coarser
/// ones. Workers decode; update() uploads what is ready, a texture a frame or as many as the frame's budget holds, and
/// never waits. Lives on the GL thread.
class TextureBox {
 public:
  /// The source has textures. Throws Error{kInvalidArgument} where memory_bytes does not hold a coarsest level on its
  /// way.
  TextureBox(const TileSource& source, std::uint64_t memory_bytes, Workers& workers);

  /// Once a frame: keeps the textures of the tiles in `range` as the view wants them.
  void update(const TileRange& range, const ViewState& view, std::uint64_t upload_bytes);
  /// Updates until all is there that is wanted: for pictures, not for frames.
  void finish(
      const TileRange& range, const ViewState& view, const std::function<void()>& poll = [] {});

  /// The GL texture of a tile; 0 where there is none (yet).
  [[nodiscard]] GLuint texture(TileIndex tile) const;
  [[nodiscard]] const TextureBoxFigures& figures() const { return figures_; }
  /// The first texture that could not be read, as a message.
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  struct Request {
    TileIndex tile{};
    int finest = 0;
  };
  /// As a worker has decoded it; no levels where reading failed.
  struct Chain {
    Request request;
    std::vector<Picture> levels;
    std::string error;
  };
  struct Entry {
    TileIndex tile{};
    std::optional<Texture> texture;
    int finest = 0;  ///< of `texture`
    bool requested = false;
    bool broken = false;
    int wanted = 0;  ///< the number of levels: none
    double distance = 0.0;
  };

  [[nodiscard]] static Chain load(const TileSource& source, const Request& request);
  /// Bytes of a texture on the GPU from `level` on, RGBA; 0 beyond the last.
  [[nodiscard]] std::uint64_t bytes_from(int level) const;
  [[nodiscard]] bool is_due(const Entry& entry) const {
    return !entry.broken && entry.wanted < levels_ && (!entry.texture || entry.finest > entry.wanted);
  }
  void enter(const TileRange& range);
  void decide(const ViewState& view);
  void upload(std::uint64_t budget);
  void request();
  void release(Entry& entry);

  const TileSource& source_;
  int levels_;
  int finest_ = 0;  ///< finer levels are too large for the memory that there is
  float anisotropy_;
  std::size_t in_flight_limit_;  ///< tiles are not to wait behind many textures
  std::uint64_t memory_bytes_;
  std::uint64_t resident_bytes_ = 0;    ///< on the GPU
  std::uint64_t on_the_way_bytes_ = 0;  ///< of requests, until they are resident
  std::map<std::int64_t, Entry> entries_;
  std::deque<Chain> waiting_;
  TextureBoxFigures figures_;
  std::optional<std::string> error_;
  BackgroundLoader<Request, Chain> loader_;  // last: it stops first
};

}  // namespace isohf::view
