#pragma once

#include <string>
#include <vector>

#include "camera.h"
#include "gl/overlay.h"
#include "options.h"
#include "paging/plane_boxes.h"
#include "paging/texture_box.h"
#include "renderer.h"

namespace isohf::view {

/// The sun whose shadows are drawn.
struct ShadowSun {
  enum class State {
    kNoSeeds,  ///< the source has none
    kNone,     ///< nothing is shaded: it is night, or light travels along the columns
    kExact,    ///< `sun` is the one asked for
    kNearest,  ///< the seeds do not hold for that one: `sun` is the nearest that they hold for
  };
  State state = State::kNoSeeds;
  RowSun sun;
  double seen_deg = 0.0;  ///< kExact, kNearest: elevation of `sun` as it is drawn, exaggeration included
};

/// Shadows are those of light along the rows (paper section 3.13). The sun is taken as it is seen in the rows' plane:
/// in the East or West as its azimuth has it, at the elevation whose tangent is tan(elevation) / |sin(azimuth)|, as
/// high as the real one in the due East and West, where this is `isohf shade`'s sun, and overhead due North and South.
/// Exaggerated heights cast what true ones cast under the sun of tan(elevation) / exaggeration.
/// seeds  may be nullptr      azimuth_deg  clockwise from North     elevation_deg  of the sun that shines
[[nodiscard]] ShadowSun shadow_sun(const ShadowSeedInfo* seeds, double azimuth_deg, double elevation_deg,
                                   double exaggeration);

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
  /// Figures, and the keys where `help`, over the frame; `reading` is of the place under the cursor.
  void draw_overlay(double frames_per_second, bool figures, bool help, const std::vector<std::string>& reading) const;

  Camera camera;
  ViewState view;
  double sun_azimuth_deg;
  double sun_elevation_deg;
  bool shadows;  ///< wanted; drawn where the source has seeds

  /// True where the next frame would show the same: nothing is on its way.
  [[nodiscard]] bool is_settled() const;
  /// True where memory ended the last frame before the far distance.
  [[nodiscard]] bool is_cut() const { return cut_; }
  [[nodiscard]] const FrameFigures& figures() const { return figures_; }
  [[nodiscard]] const PlaneBoxes& boxes() const { return boxes_; }
  /// nullptr where the source has no textures.
  [[nodiscard]] const TextureBox* textures() const { return textures_ ? &*textures_ : nullptr; }
  [[nodiscard]] const TileSource& source() const { return source_; }
  [[nodiscard]] const SharedGeometry& shared() const { return shared_; }
  [[nodiscard]] Renderer& renderer() { return renderer_; }

 private:
  void prepare();
  void draw();
  [[nodiscard]] Camera first_camera(Vec3& target) const;
  [[nodiscard]] bool shows_textures() const { return textures_ && view.mode == ColourMode::kTexture; }
  [[nodiscard]] std::string shadow_line() const;

  const TileSource& source_;
  TileBounds whole_;
  double shadow_softness_;
  ShadowSun shadow_sun_;
  SharedGeometry shared_;
  Renderer renderer_;
  PlaneBoxes boxes_;
  std::optional<TextureBox> textures_;
  std::uint64_t upload_bytes_;  ///< a frame, tiles and textures together
  Overlay overlay_;
  std::optional<double> far_distance_;
  FrameFigures figures_;
  double reach_wanted_ = 0.0;  ///< the far distance, or to the farthest corner where that is nearer
  bool cut_ = false;           ///< memory shortens the far distance
};

}  // namespace isohf::view
