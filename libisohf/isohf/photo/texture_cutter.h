#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "isohf/lattice.h"
#include "isohf/picture.h"

namespace isohf {

/// Where a photo's pixels lie in world space.
struct PhotoFrame {
  double first_pixel_x = 0.0;  ///< world place of the middle of pixel (0, 0)
  double first_pixel_z = 0.0;
  double spacing_x = 1.0;  ///< world units between neighbouring pixels, > 0
  double spacing_z = 1.0;
};

/// Sizes of a tile's texture (docs/decisions/0015): level l has size >> l texels on a side.
struct TextureShape {
  int size = 1024;  ///< texels on a side of level 0, a power of two
  int levels = 8;   ///< the coarsest has 4 texels or more
};

inline constexpr int kMinTextureSize = 64;
inline constexpr int kMaxTextureSize = 4096;
/// The coarsest level that is stored.
inline constexpr int kCoarsestTextureSize = 8;

/// Cuts one tile's texture and its mip levels out of a photo.
///
///     edge            edge      x  texels of level 0: the outermost lie on the edges
///      x  x  x  x ... x x       [ ]  a border texel of level 1 is the mean of half, whole, half around the edge,
///     [-]                       inner ones of 2^l x 2^l texels of level 0
///      [   ][   ] ...
///
/// A texel is a function of its place in the whole texture alone: tiles compute the same bits for those that they
/// share. Means are of light, weighted by alpha.
class TextureCutter {
 public:
  /// The grid's tiles share border texels, so that one spans extent / (size - 1).
  TextureCutter(const TileGrid& grid, const PhotoFrame& frame, const TextureShape& shape);

  /// False where the tile shares no ground with the photo.
  [[nodiscard]] bool touches(const PhotoInfo& photo, TileIndex tile) const;

  /// The levels of a tile, the finest first, with the photo's channels; beyond the photo its border pixels go on.
  /// O(pixels under the tile). Memory: the result and about 100 rows of texels and of pixels under the tile.
  /// Throws as the photo does.
  [[nodiscard]] std::vector<Picture> cut(PhotoSource& photo, TileIndex tile) const;

  /// Photo rows, first and last, that the tiles of one row read; clamped to the photo.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> rows_needed(const PhotoInfo& photo, std::int64_t tile_row) const;

  /// Pixels between the middles of neighbouring texels, along x and z.
  [[nodiscard]] double pixels_per_texel_x() const { return step_x_; }
  [[nodiscard]] double pixels_per_texel_z() const { return step_z_; }

 private:
  [[nodiscard]] double pixel_x(std::int64_t texel) const { return start_x_ + static_cast<double>(texel) * step_x_; }
  [[nodiscard]] double pixel_z(std::int64_t texel) const { return start_z_ + static_cast<double>(texel) * step_z_; }

  TextureShape shape_;
  double start_x_;  ///< of texel 0 of the whole texture, in pixels from the middle of pixel 0
  double start_z_;
  double step_x_;
  double step_z_;
};

}  // namespace isohf
