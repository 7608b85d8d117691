#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "gl/terrain_program.h"
#include "gl/tile_buffers.h"
#include "isohf/lattice/lod.h"
#include "paging/plane_choice.h"
#include "paging/tile_source.h"
#include "view_state.h"

namespace isohf::view {

/// What light comes from beside the sun: linear colours of the sky, and of what it lends level ground.
struct Air {
  Vec3 horizon;
  Vec3 zenith;
  Vec3 light;
  bool reddens = true;  ///< the light of a low sun
};

/// What one frame drew.
struct FrameFigures {
  std::int64_t visible_tiles = 0;  ///< in the view and resident
  std::int64_t absent_tiles = 0;   ///< in the view, stored, not resident yet
  std::int64_t triangles = 0;
};

/// Finds a tile's buffers; nullptr where the tile is not resident.
using ResidentTile = std::function<const TileSlot*(PlaneTile)>;

/// The GL texture that a tile of any plane is drawn with: its own, or above plane 0 one of the whole archive. 0 where
/// there is none.
using TileTexture = std::function<GLuint(PlaneTile)>;

/// Draws the heightfield: sky, opaque pass, fading pass (paper sections 3.3-3.9), wires.
class Renderer {
 public:
  Renderer(const TileSource& source, const SharedGeometry& shared);

  /// Where ColourMode::kTexture finds its textures.
  void set_textures(TileTexture textures) { textures_ = std::move(textures); }

  /// Colours of the ground from one elevation to another, in the source's units.
  void set_palette(const std::vector<ColourStop>& stops, double low, double high);

  /// Draws what the tiles of a range of the coarsest plane stand for, as far as resident, into the bound framebuffer.
  FrameFigures draw(const ViewState& view, const TileRange& top, const ResidentTile& resident);

  /// The tiles that the last frame drew.
  [[nodiscard]] const std::vector<PlaneTile>& drawn() const { return drawn_; }

 private:
  struct Item {
    PlaneTile at;
    unsigned coarser_sides;
    const TileSlot* slot;
    bool is_cut;  ///< reaches beyond what the source covers
    double distance;
    double nearest;  ///< distance of the nearest point of the tile's box
    LodBlend blend;
    GLuint texture;  ///< 0: not wanted
  };
  /// True where the second mesh shows: less than half an 8-bit step of it does not.
  [[nodiscard]] static bool fades(const Item& item) {
    return item.blend.alpha > 0.5 / 255.0 && item.blend.second != item.blend.first;
  }

  /// What the passes over one frame's tiles share.
  struct Frame {
    const ViewState& view;
    TerrainFrame terrain;
    std::vector<Item> items;  ///< nearest first
    FrameFigures figures;
  };

  /// Level of detail through all planes at which a tile is wanted, fractional, by what is nearest of it; of a tile of
  /// plane 0 by its middle.
  [[nodiscard]] double level_of(const ViewState& view, PlaneTile at) const;
  void find_visible(Frame& frame, const TileRange& top, const ResidentTile& resident) const;
  /// Made when first wanted.
  [[nodiscard]] const TerrainProgram& shading(ColourMode mode);
  void draw_sky(const ViewState& view) const;
  void draw_opaque(Frame& frame);
  void draw_fading(Frame& frame);
  void draw_wires(Frame& frame) const;
  void place_texture(const TerrainProgram& program, PlaneTile at) const;
  void draw_mesh(Frame& frame, const TerrainProgram& program, const Item& item, int level) const;
  void begin_shading(const Frame& frame, const TerrainProgram& program) const;

  const TileSource& source_;
  const SharedGeometry& shared_;
  Planes planes_;
  TileBounds whole_;
  Air air_;
  std::map<ColourMode, TerrainProgram> shading_;
  std::vector<PlaneTile> drawn_;
  TerrainProgram flat_;
  Program sky_;
  TileTexture textures_;
  Texture no_texture_;  ///< one texel without alpha
  Texture palette_;
  VertexArray nothing_;
};

}  // namespace isohf::view
