#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gl/gl_objects.h"
#include "isohf/lattice.h"

namespace isohf::view {

/// The index arrays that all tiles of one shape share, as the library makes them. Verifying takes altered ones too.
struct IndexArrays {
  std::vector<std::vector<std::uint32_t>> strips;  ///< by level
  std::vector<std::uint32_t> stitch;               ///< level λ draws the first stitch_counts[λ]
  std::vector<std::size_t> stitch_counts;          ///< by level
  std::vector<std::vector<std::uint32_t>> sides;   ///< beside a coarser plane's tile, by TileSide; may be empty
};

/// plane_stride  between the planes; 0: there are none
[[nodiscard]] IndexArrays make_index_arrays(const TileShape& shape, int plane_stride = 0);

/// What all tiles of one shape share on the GPU (paper section 3.2): the object-space (x, z) of every stored vertex as
/// GL_SHORT pairs, and the index arrays of all levels in one buffer.
class SharedGeometry {
 public:
  SharedGeometry(const TileShape& shape, const IndexArrays& arrays);

  [[nodiscard]] const TileShape& shape() const { return shape_; }
  [[nodiscard]] GLuint xz() const { return xz_.get(); }
  [[nodiscard]] GLuint indices() const { return indices_.get(); }

  /// One draw call each, with the tile's vertex array bound.
  void draw_strip(int level) const;
  void draw_stitch(int level) const;
  /// Returns the triangles drawn.
  std::int64_t draw_side(int side) const;
  /// The arrays as the GPU holds them, for verifying.
  [[nodiscard]] std::vector<std::uint32_t> read_strip(int level) const;
  [[nodiscard]] std::vector<std::uint32_t> read_stitch(int level) const;
  [[nodiscard]] bool has_stitch(int level) const { return stitch_counts_[static_cast<std::size_t>(level)] > 0; }

 private:
  [[nodiscard]] std::vector<std::uint32_t> read(std::size_t offset_bytes, GLsizei count) const;

  TileShape shape_;
  Buffer xz_;
  Buffer indices_;
  std::vector<GLsizei> strip_counts_;
  std::vector<std::size_t> strip_offsets_bytes_;
  std::vector<GLsizei> stitch_counts_;
  std::size_t stitch_offset_bytes_ = 0;
  std::vector<GLsizei> side_counts_;
  std::vector<std::size_t> side_offsets_bytes_;
};

/// One tile on the GPU: two bytes a vertex. The vertex shader fetches them from a buffer texture, its own and those of
/// the neighbours that a normal needs: v-1..v+1, v-C-1..v-C+2 and v+C-1..v+C+2. A row and two vertices of nothing lie
/// before and behind the codes. Shadows take two more bytes a vertex, as an attribute. A slot is reused for tile after
/// tile.
class TileSlot {
 public:
  explicit TileSlot(const SharedGeometry& shared);

  /// codes [C x R]
  void upload(std::span<const std::uint16_t> codes);
  /// How deep vertices lie in the shadow, [C x R], and the share of the sun that 32767 takes; two more bytes a vertex
  /// from the first call on.
  void upload_shadow(std::span<const std::int16_t> depths, float gain);
  /// 0 without a shadow.
  [[nodiscard]] float shadow_gain() const { return shadow_gain_; }

  /// Binds the vertex array and the codes; texture unit 0 is active afterwards.
  void bind() const;

  /// What a tile takes, and what drivers keep of it besides: Mesa 3 KB for its vertex array and buffers.
  [[nodiscard]] static std::uint64_t bytes(const TileShape& shape, bool shadow = false) {
    constexpr std::uint64_t kDriverBytes = 4096;
    const std::int64_t codes = shape.stored_vertex_count() + 2 * (shape.columns() + 2);
    return static_cast<std::uint64_t>(codes + (shadow ? shape.stored_vertex_count() : 0)) * sizeof(std::uint16_t) +
           kDriverBytes;
  }

 private:
  std::size_t vertices_;
  std::size_t rim_;  ///< unused vertices before and behind the codes
  Buffer codes_;
  Texture fetched_;  ///< of codes_
  std::optional<Buffer> shadow_;
  float shadow_gain_ = 0.0F;
  VertexArray array_;
};

}  // namespace isohf::view
