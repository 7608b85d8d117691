#pragma once

#include <string>
#include <vector>

#include "camera.h"
#include "gl/overlay.h"
#include "options.h"
#include "paging/texture_box.h"
#include "paging/tile_box.h"
#include "renderer.h"
#include "shadow_sun.h"

namespace isohf::view {

/// An open heightfield with a camera: all that window, picture and flight have in common. A GL context must be
/// current as long as it lives.
class Session {
 public:
  /// Throws Error{kInvalidArgument} where a level beyond the archive's is asked for, or shadows without seeds.
  Session(const TileSource& source, const Options& options);

  /// Updates the tile box and draws a frame into the bound framebuffer; never waits for a tile.
  void frame();
  /// Waits for all tiles in reach first. Throws Error{kCorrupt} where one cannot be read.
  void complete_frame();
  /// Changes the far distance by a factor.
  void scale_far(double factor) { far_distance_ = view.far_distance * factor; }
  /// Figures, and the keys where `help`, over the frame.
  void draw_overlay(double frames_per_second, bool figures, bool help) const;

  Camera camera;
  ViewState view;
  double sun_azimuth_deg;
  double sun_elevation_deg;
  bool shadows;  ///< wanted; drawn where the source has seeds

  /// True where memory ended the last frame before the far distance.
  [[nodiscard]] bool is_cut() const { return cut_; }
  [[nodiscard]] const FrameFigures& figures() const { return figures_; }
  [[nodiscard]] const TileBox& box() const { return box_; }
  /// nullptr where the source has no textures.
  [[nodiscard]] const TextureBox* textures() const { return textures_ ? &*textures_ : nullptr; }
  [[nodiscard]] const TileSource& source() const { return source_; }
  [[nodiscard]] const SharedGeometry& shared() const { return shared_; }
  [[nodiscard]] Renderer& renderer() { return renderer_; }

 private:
  void prepare();
  void draw();
  [[nodiscard]] Camera first_camera() const;
  [[nodiscard]] bool shows_textures() const { return textures_ && view.mode == ColourMode::kTexture; }
  [[nodiscard]] std::string shadow_line() const;

  const TileSource& source_;
  TileBounds whole_;
  double shadow_softness_;
  ShadowSun shadow_sun_;
  SharedGeometry shared_;
  Renderer renderer_;
  TileBox box_;
  std::optional<TextureBox> textures_;
  std::uint64_t upload_bytes_;  ///< a frame, tiles and textures together
  Overlay overlay_;
  std::optional<double> far_distance_;
  FrameFigures figures_;
  double reach_wanted_ = 0.0;  ///< the far distance, or to the farthest corner where that is nearer
  bool cut_ = false;           ///< memory shortens the far distance
};

}  // namespace isohf::view
